"""Contact in the time step: search when it is due, find who meets, push them apart, book what it cost.

Every meeting is computed by one rank, the one that owns its node or has its first edge; ghosts of other ranks'
surfaces make that possible. The impulses on a node are completed over all ranks that push or hold it, so that
everybody ends with the same velocity, to the bit.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from conoid.cases.schema import Case

from ..boundaries import Boundary, PrescribedVelocity, SymmetryPlane
from ..clock import Clock
from ..errors import InputError
from ..migration.parcel import Parcel
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..state import Flags, Floats, Indices, Ints, Model, Nodes, extended
from ..timers import Timers
from ..topology import Split
from . import held, meetings, pairing, scene, surface, sweeps
from .account import Account
from .course import courses
from .cracks import Cracks, across
from .flight import Flight
from .follower import Follower, news
from .scene import Rules, Scene

_SHORTEST = 10.0
"""Steps of free flight that a search looks ahead at least; at most twice what the last search was good for."""
_SURFACE, _AWAKE, _MEETING = 6.0, 3.0, 5.0
"""Candidates (found, and resting) that cost as much as a node of the surface, as a candidate that is looked at, as a
meeting; fitted to the CPU times of the shattering bar on 16 ranks and of the eroding rod on eight.
"""
_KINEMATIC = 2.0
"""One over the share of a tet's altitude that anything may pass in a step."""


Parted = tuple[Indices, Indices]
"""Which meetings have nodes that another rank shares, and which have none."""


class Contact(Boundary):
    """The contact of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], bounds: list[Boundary],
        comm: Comm, clock: Clock, timers: Timers, extremes: tuple[float, float],
    ) -> None:  # fmt: skip
        """``extremes``: largest nodal mass, kg, and speed, m/s, of the scene."""
        super().__init__(np.arange(model.nodes.n, dtype=np.int32))
        assert case.contact is not None
        self._sweeps = case.contact.sweeps
        self._model, self._neighbours, self._comm = model, neighbours, comm
        self._clock, self._timers = clock, timers
        self._mobility, self._planes = _mobility(model.nodes, bounds), _planes(model.nodes.n, bounds)
        self._edges = case.contact.edges
        self._surface = surface.build(model, self._planes, neighbours, comm, self._edges)
        self._mu = pairing.friction(case)
        self._flight = Flight(self._surface, model.nodes, self._mobility, case.contact.skin, neighbours, comm)
        self._rules = Rules(case.contact.domain, ~np.isnan(self._mu), 2.0 * self._flight.size)
        largest, fastest = extremes
        self._scale = fixed_point.scale_for(largest * fastest)
        self._friction = fixed_point.Tally(np.array([largest * fastest * fastest]))
        self._account = Account(largest * fastest * fastest)
        self._give_back = 0.0
        """Of penetrations, taken back in this step (meetings.PUSH_OUT)."""
        self._parts = np.zeros((len(case.parts), 3), np.int64)
        self._scene: Scene | None = None
        self.due = True
        """Whether the next step begins with a search."""
        self.limit = 0.0
        """One over the step in which no node passes more than half of a tet that it may meet, 1/s."""
        self._changed = False
        """Whether the surface is another one than that of the last search."""
        self._fractures = case.fractures
        self._stale = False
        """Whether nodes have separated since the surface was made."""
        self._cracks = Cracks.none()
        self._apart = False
        """Whether some crack is wide enough for a search."""
        self.searches = 0
        self._last = -math.inf
        """Step of the last search."""
        self._rubs = bool(np.nanmax(self._mu, initial=0.0) > 0.0)
        self._mean_dt = 0.0
        """Of the last step with a scene, s."""

    def keep(self, parcel: Parcel, name: str) -> None:
        super().keep(parcel, name)
        parcel.known["contact"] = (
            self._scale, self._friction.scale, self.due, self.limit, self._stale, self.searches, self._last,
            self._mean_dt, self._scene is not None, self._account.known(),
        )  # fmt: skip
        parcel.sums["contact.parts"], parcel.sums["contact.friction"] = self._parts, self._friction.words
        parcel.sums["contact.account"] = self._account.words
        self._flight.keep(parcel)
        edges = self._surface.edges if not self._stale else self._surface.edges.take(np.zeros(0, np.int64))
        parcel.rows["contact.edges"] = {
            "tet": edges.sides.min(axis=1, initial=np.iinfo(np.int64).max) // 4, "ends": edges.nodes,
            "sides": edges.sides, "size": edges.size,
        }  # fmt: skip
        parcel.rows["contact.cracks"] = self._cracks.keep(self._model.blocks, parcel.nodes["id"])
        total = np.zeros((self._model.nodes.n, 3), np.int64)
        if self._scene is not None:
            total[self._scene.local] = self._scene.total[self._scene.held]
            self._scene.keep(parcel, self._rubs)
        parcel.nodes["contact.total"] = total

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        super().resume(parcel, name, dt)
        (
            self._scale, self._friction.scale, self.due, self.limit, self._stale, self.searches, self._last,
            self._mean_dt, searched, account,
        ) = parcel.known["contact"]  # fmt: skip
        self._parts, self._friction.words = parcel.sums["contact.parts"], parcel.sums["contact.friction"]
        self._account.resume(parcel.sums["contact.account"], account)
        state = self._model.nodes
        self._surface.flags = parcel.nodes["flight.flags"]
        self._surface = surface.with_edges(self._surface, parcel.rows["contact.edges"], state)
        self._flight.resume(self._surface, state, self._mobility, parcel)
        self._rules = replace(self._rules, cell=2.0 * self._flight.size)
        self._cracks = Cracks.resume(parcel.rows["contact.cracks"], self._model.blocks, state)
        if searched:
            here = self._flight.here(state)
            self._scene = scene.resume(parcel, here, self._flight.sides.skin, state, self._comm)
            self._connect(self._scene, state)
            self._scene.total[self._scene.held] = parcel.nodes["contact.total"][self._scene.local]

    def require_faces(self) -> None:
        """Raises InputError, on every rank alike, when a part that may meet has no face to meet with."""
        model, allowed = self._model, ~np.isnan(self._mu)
        first = np.searchsorted(model.nodes.id, self._surface.faces.nodes[:, 0])
        counts = self._comm.sum(np.bincount(model.nodes.part[first], minlength=len(model.parts)).astype(np.int64))
        for index in np.flatnonzero((counts == 0) & allowed.any(axis=1)):
            raise InputError(
                f"contact: part {model.parts[index]!r} has no exposed face, all lie on symmetry planes; "
                "leave it out of contact.parts"
            )

    def friction_work(self) -> float:
        """Heat of friction so far of the meetings of all ranks, J; all ranks take part."""
        return float(self._friction.total(self._comm)[0])

    @property
    def outside(self) -> int:
        """Nodes of the surface that this rank owns."""
        return int(self.on_surface.sum())

    @property
    def on_surface(self) -> Flags:
        """(nodes,) which they are."""
        return self._surface.flags & self._model.nodes.owned

    def effort(self) -> Floats:
        """(nodes, 2) what contact does here for each node, in candidates: to search, and to push in every step."""
        n = self._model.nodes.n
        search, push = _SURFACE * (self._surface.flags & self._model.nodes.owned), np.zeros(n)
        if (now := self._scene) is not None:
            slaves, firsts = now.node_face[:, 0], now.edges[now.edge_edge[:, 0], 0]
            pairs, edges = now.rest.looked
            for effort, weight, places in (
                (search, 1.0, np.concatenate([slaves, firsts])),
                (push, _AWAKE, np.concatenate([slaves[pairs], firsts[edges], now.cracks[:, :3].reshape(-1)])),
                (push, _MEETING, now.room.nodes[: now.met, 0]),
            ):
                at = now.crowd.local[places]
                effort += weight * np.bincount(at[at >= 0], minlength=n)
        return np.column_stack([search, push])

    def impulses(self) -> Floats:
        """(parts, 3) what contact has given each part so far, N s; all ranks take part."""
        return np.asarray(self._comm.sum(self._parts) / self._scale)

    def uncover(self, gone: Ints, loose: Flags, removed: Flags) -> None:
        """The surface after tets have left; see surface.uncovered. All ranks take part."""
        with self._timers.phase("contact"):
            self._surface = surface.uncovered(
                self._surface, gone, loose, removed, self._model, self._planes, self._neighbours, self._comm
            )
            self.due = self._changed = True

    def crack(self, tets: Ints, nodes: Indices, sides: Indices) -> None:
        """Takes up broken facets that have a side here, with the local ``nodes`` (m, 3) that the sides have in common;
        see ``Cracks`` for ``tets`` and ``sides``.
        """
        self._cracks.add(tets, nodes, sides)

    def separate(self, split: Split) -> None:
        """Follows nodes as they separate; all ranks take part."""
        state = self._model.nodes
        self._stale = True
        if split.copies.n:
            self._cracks.follow(split, state.id)
        if self._scene is None:
            return
        if split.copies.n:
            self._flight.grow(split.copies.parents)
            self._flight.mobility = self._mobility
        here = self._flight.here(state)
        heard = news(split, self._scene, here, self._comm)
        if heard is None:
            return
        follower = Follower(self._scene, here, state)
        follower.follow(heard, self._cracks, self._neighbours)
        if self._comm.size > 1:
            follower.share(heard, self._neighbours, self._comm)

    def _expose(self, state: Nodes) -> None:
        """The surface anew, with the cracks that are wide; all ranks take part."""
        released = self._cracks.release(self._model.blocks, state.x, self._flight.size)
        if not int(self._comm.sum(np.array([released]))[0]) and not self._stale:
            return
        old = self._surface.flags
        self._surface = surface.build(self._model, self._planes, self._neighbours, self._comm, self._edges)
        self._surface.flags[: len(old)] |= old
        self._stale, self._changed = False, True

    def _inherit(self, at: Ints, copies: Indices) -> None:
        super()._inherit(at, copies)
        self._mobility = extended(self._mobility, self._mobility[at])
        self._planes = extended(self._planes, self._planes[at])
        for some in (at, copies):
            free = self._mobility[some] > 0.0
            self._mobility[some] = np.where(free, 1.0 / self._model.nodes.mass[some, None], 0.0)

    def note(self, state: Nodes) -> None:
        with self._timers.phase("contact"):
            if self._scene is not None:
                self._look(self._scene, state)
                self._book(self._scene)
                self._scene.total[:] = 0
            if (self.due or self._scene is None) and self._clock.dt > 0.0:
                self._search(state)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        if dt > 0.0 and self._scene is not None:
            with self._timers.phase("contact"):
                self._push(self._scene, state, dt, t)

    def free(self) -> None:
        """Gives the messages back to MPI."""
        if self._scene is not None:
            self._scene.free()

    def _look(self, now: Scene, state: Nodes) -> None:
        held.gather(now.before, state.v, now.held, now.local)
        now.copies.note(state)

    def _search(self, state: Nodes) -> None:
        """Looks for candidates; all ranks take part."""
        clock, flight, old = self._clock, self._flight, self._scene
        if old is not None:
            old.free()
        if self._fractures:
            self._expose(state)
        flight.begin(state, self._courses(state), clock.t)
        if self._changed:
            flight.follow(self._surface, state, self._mobility)
            self._changed = False
        else:
            flight.refresh(state)
        steps, drift = flight.foresight(clock.dt)
        horizon = max(min(steps, 2.0 * (clock.step - self._last)), _SHORTEST) * clock.dt
        self._scene = scene.build(flight.sides, self._rules, horizon, drift, state, self._comm)
        self.limit = _KINEMATIC * float(self._comm.maximum(np.array([self._scene.approach()]))[0])
        self._connect(self._scene, state)
        if old is not None and self._rubs:
            self._scene.remember(old, state, self._comm)
        self._look(self._scene, state)
        self._scene.normals[self._scene.held] = flight.normals(state)[self._scene.local]
        flight.until = clock.t + horizon
        self.due, self._apart, self._last = False, False, clock.step
        self.searches += 1

    def _courses(self, state: Nodes) -> Floats:
        """(nodes, 3) how the nodes fly on; all ranks take part."""
        if not self._fractures:
            return state.v
        return courses(self._model.blocks, state, self._neighbours, self._comm)

    def _connect(self, found: Scene, state: Nodes) -> None:
        """Takes the cracks up into a new scene, and settles who shares what of it; all ranks take part."""
        follower = Follower(found, self._flight.here(state), state)
        if self._fractures:
            follower.cracks(self._cracks)
        follower.settle(self._neighbours, self._comm)

    def spent(self, state: Nodes) -> bool:
        """Whether a node of the surface will leave, in a step more, what the last search has allowed for."""
        with self._timers.phase("contact"):
            return self._apart or self._flight.spent(state, self._clock.t, self._clock.dt)

    def _push(self, now: Scene, state: Nodes, dt: float, t: float) -> None:
        crowd, room = now.crowd, now.room
        now.copies.begin(state)
        held.take(crowd.x, crowd.v, now.held, state.x, state.v, now.local)
        now.copies.finish(crowd.x, crowd.v, now.before)
        self._give_back = meetings.PUSH_OUT if self._account.settle(self._comm) else 0.0
        n = now.met = self._meet(now, dt)
        rows = sweeps.parted(room.nodes, now.shared, n)
        self._weigh(now, n, rows)
        room_of = (room.nodes, room.weights, room.normals)
        now.push[:n] = 0.0
        if self._rubs:
            slip = sweeps.rates(now.before, room.nodes, room.weights, n)
            self._resume(now, rows)
        sweep = now.impulse, now.push, crowd.v, *room_of, room.wanted, room.friction, now.diagonal, self._scale
        for _ in range(self._sweeps):
            self._give(now, rows, sweeps.sweep, *sweep)
        if self._rubs:
            now.kept[:] = 0.0
            faces = room.pair[:n] >= 0
            now.kept[room.pair[:n][faces]] = now.push[:n][faces]
            heat = self._friction
            sweeps.heat(heat.words.reshape(-1), now.push, slip, crowd.v, *room_of, room.friction, heat.scale[0], n)
        account = self._account
        sweeps.cost(account.words, now.push, now.before, crowd.v, *room_of, account.scale, n)
        self._book(now)
        if held.give_back(state.v, self._parts, now.local, now.held, crowd.v, now.total, state.part, state.owned):
            self.last_push = t

    def _resume(self, now: Scene, rows: Parted) -> None:
        """Begins with what the same pairs were pushed with in the step before."""
        room, mean_dt = now.room, self._clock.mean_dt
        ratio = mean_dt / self._mean_dt if self._mean_dt > 0.0 else 0.0
        self._mean_dt = mean_dt
        room_of = (room.nodes, room.weights, room.normals)
        resume = now.impulse, now.push, now.kept, room.pair, *room_of, room.friction, ratio, self._scale
        self._give(now, rows, sweeps.resume, *resume)

    def _give(self, now: Scene, rows: Parted, sweep: Callable[..., None], *of: Any) -> None:
        """Completes the impulses of a sweep and turns them into velocities; meetings of nodes that no other rank shares
        are swept while those of the others travel.
        """
        border, inner = rows
        sweep(*of, border)
        now.shared_impulse.begin(now.impulse)
        sweep(*of, inner)
        now.shared_impulse.finish(now.impulse)
        sweeps.give(now.crowd.v, now.total, now.impulse, now.crowd.mobility, self._scale)

    def _meet(self, now: Scene, dt: float) -> int:
        crowd, room = now.crowd, now.room
        out = (room.nodes, room.weights, room.normals, room.wanted, room.friction, room.pair)
        found = (crowd.x, crowd.v, crowd.part, self._mu, self._give_back, dt)
        rest = now.rest
        surfaces = now.faces, now.face_size, now.edges, now.edge_size, now.normals
        if rest.fresh:
            pairs, edges = _all(now.node_face), _all(now.edge_edge)
            rest.settle(pairs, edges, now.node_face, now.edge_edge, *surfaces, crowd.x, crowd.part)
        rest.move(crowd.x, crowd.v, now.faces, now.edges, dt)
        pairs, edges = rest.awake(now.node_face, now.edge_edge)
        n = meetings.node_face(*out, 0, now.faces, now.face_size, now.normals, now.node_face, pairs, *found)
        n = meetings.edge_edge(*out, n, now.edges, now.edge_size, now.edge_edge, edges, *found)
        rest.settle(pairs, edges, now.node_face, now.edge_edge, *surfaces, crowd.x + dt * crowd.v, crowd.part)
        n, apart = across(*out, n, now.cracks, self._flight.size, *found)
        self._apart |= bool(apart)
        return int(n)

    def _weigh(self, now: Scene, n: int, rows: Parted) -> None:
        room, (border, inner) = now.room, rows
        now.shares[:] = 0
        sweeps.add_shares(now.shares, room.nodes, room.weights, room.normals, border)
        now.shared_shares.begin(now.shares)
        sweeps.add_shares(now.shares, room.nodes, room.weights, room.normals, inner)
        now.shared_shares.finish(now.shares)
        sweeps.mobilities(now.diagonal, room.nodes, room.weights, room.normals, now.shares, now.crowd.mobility, n)

    def _book(self, now: Scene) -> None:
        """Half of the work of the last impulses, with the velocities in ``before``."""
        held.book(
            self.contact_loss, self.external_work, now.local, now.held, now.before, now.total, now.crowd.mobility,
            self._scale,
        )  # fmt: skip


def _all(rows: Indices) -> Indices:
    return np.arange(len(rows), dtype=np.int32)


def _mobility(nodes: Nodes, bounds: list[Boundary]) -> Floats:
    """(nodes, 3) one over the mass, zero where a velocity is held."""
    mobility = np.repeat(1.0 / nodes.mass[:, None], 3, axis=1)
    for bound in bounds:
        if isinstance(bound, SymmetryPlane):
            mobility[bound.nodes, bound.axis] = 0.0
        elif isinstance(bound, PrescribedVelocity):
            rows = mobility[bound.nodes]
            rows[bound.held] = 0.0
            mobility[bound.nodes] = rows
    return mobility


def _planes(n: int, bounds: list[Boundary]) -> Flags:
    """(nodes, planes) which of ``n`` nodes lie on which symmetry plane; two planes across one axis are two columns."""
    mirrors = [bound for bound in bounds if bound.mirrors]
    planes = np.zeros((n, len(mirrors)), bool)
    for k, bound in enumerate(mirrors):
        planes[bound.nodes, k] = True
    return planes
