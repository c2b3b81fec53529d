"""Contact in the time step: search when it is due, find who meets, push them apart, book what it cost.

Every meeting is computed by one rank, the one that owns its node or has its first edge; ghosts of other ranks'
surfaces make that possible. The impulses on a node are completed over all ranks that push or hold it, so that
everybody ends with the same velocity, to the bit.
"""

import math

import numpy as np

from conoid.cases.schema import Case

from ..boundaries import FREE, Boundary
from ..clock import Clock
from ..errors import InputError
from ..migration.parcel import Parcel
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..state import Flags, Floats, Indices, Ints, Model, Nodes, extended
from ..timers import Timers
from ..topology import Split
from . import booking, held, layout, normals, pairing, registration, surface
from .account import Account
from .course import courses
from .cracks import Cracks, widening
from .detection import detect
from .flight import Flight, typical
from .follower import Follower
from .narrow_phase import PUSH_OUT
from .news import news
from .scene import Scene
from .sides import HALO, Rules
from .solver import ActiveSet

_SHORTEST = 10.0
"""Steps of free flight that a search looks ahead at least; at most twice what the last search was good for."""
_LONGEST = 80.0
"""The same at most where bodies break: with 300 steps the pairs between fragments cost a quarter more than the searches
that they save (docs/bench.md, the bar to 40 us).
"""
_SURFACE, _LISTED, _TESTED, _ACTIVE = 9.0, 0.1, 3.0, 4.0
"""What a step costs for a node of the surface (searches and registrations, shared out), for a pair that is listed, for
one that is tested, as a crack is, and for an active contact: 450, 3, 150 and 200 ns by the profile of the shattering
bar to 40 us on one rank."""
_FORESIGHT = 8
"""Steps between two looks at how wide the cracks are."""
_WORDS = 27
"""Of the row of a crack that opens (Contact._opened)."""
_NO_SIDES = np.zeros((0, 3), np.int32)
"""Of cracks that may open: none (block, place, face)."""


class Contact:
    """The contact of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], bounds: list[Boundary],
        comm: Comm, clock: Clock, timers: Timers, extremes: tuple[float, float],
    ) -> None:  # fmt: skip
        """``extremes``: largest nodal mass, kg, and speed, m/s, of the scene."""
        self.contact_loss = np.zeros(model.nodes.n)
        """(nodes,) energy lost by impact and friction, J."""
        self.external_work = np.zeros(model.nodes.n)
        """(nodes,) work that what holds nodes does against contact, J."""
        self.last_push = 0.0
        """Last time at which nodes of this rank were pushed, s."""
        assert case.contact is not None
        self._sweeps = case.contact.sweeps
        self._model, self._neighbours, self._comm = model, neighbours, comm
        self._clock, self._timers = clock, timers
        self._mobility, self._planes = _mobility(model.nodes, bounds), _planes(model.nodes.n, bounds)
        self._edges = case.contact.edges
        self._cracks, self._size = Cracks.none(), 0.0
        self._surface = self._build(np.zeros(model.nodes.n, bool))
        self._mu = pairing.friction(case)
        self._size = typical(self._surface.faces.size, comm)
        """Of the faces of all ranks at the start, m."""
        self._flight = Flight(self._surface, model.nodes, self._mobility, self._size, comm)
        self._skin, self._domain = case.contact.skin, case.contact.domain
        self._moments = np.zeros((model.nodes.n, 9), np.int64)
        largest, fastest = extremes
        self._scale = fixed_point.scale_for(largest * fastest)
        self._friction = fixed_point.Tally(np.array([largest * fastest * fastest]))
        self._account = Account(largest * fastest * fastest)
        self._active = ActiveSet(self._scale)
        self._give_back = 0.0
        """Of penetrations, taken back in this step (narrow_phase.PUSH_OUT)."""
        self._parts = np.zeros((len(case.parts), 3), np.int64)
        self._scene: Scene | None = None
        self.due = True
        """Whether the next step begins with a search."""
        self.limit = 0.0
        """One over the step in which no node of any rank passes more than half of a tet that it meets, 1/s."""
        self.approach = 0.0
        """The same of the last step of this rank."""
        self._changed = False
        """Whether the surface is another one than that of the last search."""
        self._separated = False
        """Whether nodes of any rank have separated: cracks may be open."""
        self._fractures = case.fractures
        self._opening: Ints = np.zeros(0, np.int64)
        """Cracks of the scene that have become wide in the last step."""
        self._total: Ints = np.zeros((0, 3), np.int64)
        """(nodes, 3) impulses of the last step, quanta, of a run that goes on here; (0, 3) once they are booked."""
        self.searches = 0
        self._last = -math.inf
        """Step of the last search."""
        self._rubs = bool(np.nanmax(self._mu, initial=0.0) > 0.0)
        self._mean_dt = 0.0
        """Of the last step with a scene, s."""
        self._kept: tuple[Ints, Floats] = np.zeros((0, 2), np.int64), np.zeros((0, 4))
        """Candidates with friction, and what they have kept, that the next search takes over from elsewhere."""

    def keep(self, parcel: Parcel) -> None:
        """Adds all but what was found of candidates: a search finds it again."""
        parcel.nodes["contact.contact_loss"] = self.contact_loss
        parcel.nodes["contact.external_work"] = self.external_work
        parcel.known["contact"] = (
            self._scale, self._friction.scale, self.limit, self.searches, self._mean_dt, self._size,
            self._account.known(),
        )  # fmt: skip
        parcel.sums["contact.parts"], parcel.sums["contact.friction"] = self._parts, self._friction.words
        parcel.sums["contact.account"] = self._account.words
        parcel.rows["contact.cracks"] = self._cracks.keep(parcel.nodes["id"])
        parcel.nodes["contact.flags"], parcel.nodes["contact.moments"] = self._surface.flags, self._moments
        total = np.array(self._total) if len(self._total) else np.zeros((self._model.nodes.n, 3), np.int64)
        keys, kept = self._kept
        if (now := self._scene) is not None:
            total[now.local] = now.total[now.held]
            keys, kept = now.kept
        parcel.nodes["contact.total"] = total
        parcel.rows["contact.kept"] = {"node": keys[:, 0], "face": keys[:, 1], "kept": kept}

    def resume(self, parcel: Parcel) -> None:
        """Takes it back; all ranks take part."""
        self.contact_loss = np.array(parcel.nodes["contact.contact_loss"])
        self.external_work = np.array(parcel.nodes["contact.external_work"])
        (
            self._scale, self._friction.scale, self.limit, self.searches, self._mean_dt, self._size, account,
        ) = parcel.known["contact"]  # fmt: skip
        self._active = ActiveSet(self._scale)
        self._account.resume(parcel.sums["contact.account"], account)
        self._parts, self._friction.words = parcel.sums["contact.parts"], parcel.sums["contact.friction"]
        self._surface.flags = np.array(parcel.nodes["contact.flags"])
        self._moments = np.array(parcel.nodes["contact.moments"])
        state = self._model.nodes
        self._flight = Flight(self._surface, state, self._mobility, self._size, self._comm)
        self._cracks = Cracks.resume(parcel.rows["contact.cracks"], self._model.blocks, state)
        kept = parcel.rows["contact.kept"]
        self._kept = np.column_stack([kept["node"], kept["face"]]), kept["kept"]
        self._total = parcel.nodes["contact.total"]
        self._separated = self._fractures

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
        """(nodes, 2) what contact does here for each node, in units of 50 ns: to search, and to push in every step."""
        n = self._model.nodes.n
        search, push = _SURFACE * (self._surface.flags & self._model.nodes.owned), np.zeros(n)
        if (now := self._scene) is not None:
            nodes, firsts = now.node_face.rows[:, 0], now.edges[now.edge_edge.rows[:, 0], 0]
            cracks = now.cracks[now.cracks[:, 0] >= 0, 0]
            tested = np.concatenate([nodes[now.node_face.tested], firsts[now.edge_edge.tested], cracks])
            for effort, weight, slots in (
                (search, _LISTED, np.concatenate([nodes, firsts])),
                (push, _TESTED, tested),
                (push, _ACTIVE, now.room.nodes[: now.met, 0]),
            ):
                at = now.crowd.local[slots]
                effort += weight * np.bincount(at[at >= 0], minlength=n)
        return np.column_stack([search, push])

    def impulses(self) -> Floats:
        """(parts, 3) what contact has given each part so far, N s; all ranks take part."""
        return np.asarray(self._comm.sum(self._parts) / self._scale)

    def _build(self, flags: Flags) -> surface.Surface:
        """The surface, with sides of cracks that may open; nodes that have been on it, ``flags`` (n,), still are. All
        ranks take part.
        """
        sides = self._cracks.foresee() if len(self._cracks.faces) else _NO_SIDES
        found = surface.build(self._model, self._planes, self._neighbours, self._comm, self._edges, sides)
        found.flags[: len(flags)] |= flags
        return found

    def uncover(self, loose: Flags, removed: Flags) -> None:
        """The surface after tets have left; ``loose`` (nodes,): nodes without tets that fly on, ``removed``: those that
        have left. All ranks take part.
        """
        with self._timers.phase("contact"):
            self._surface = self._build(self._surface.flags | loose)
            self._surface.flags &= ~removed
            self._look_round()
            if self._scene is not None:
                self._scene.node_face.wake()
            self.due = self._changed = True

    def crack(self, tets: Ints, nodes: Indices, sides: Indices) -> None:
        """Takes up broken facets that have a side here, with the local ``nodes`` (m, 3) that the sides have in common;
        see ``Cracks`` for ``tets`` and ``sides``.
        """
        self._cracks.add(tets, nodes, sides, self._model.blocks)

    def agree(self, search: bool, approach: float, opening: bool) -> None:
        """Takes what all ranks have found in the step; all ranks take part."""
        self.due |= search
        self.limit = approach
        if opening:
            self.open_cracks()

    @property
    def opening(self) -> bool:
        """Whether a crack has become so wide in the last step that it opens."""
        return len(self._opening) > 0

    def open_cracks(self) -> None:
        """Makes surface of the cracks that have become wide; all ranks take part."""
        with self._timers.phase("contact"):
            told = self._comm.join(self._opened()).reshape(-1, _WORDS)
            self._opening = self._opening[:0]
            nodes, sides = self._model.nodes, told[:, 3:9].reshape(-1, 3)
            local = nodes.places(sides)
            normals.add(self._moments, told[:, 9:].reshape(-1, 9), local)
            local = np.unique(local[local >= 0])
            self._surface.flags[local] = True
            faces = np.sort(told[:, 1:3].reshape(-1))
            self._cracks.open(faces, self._model.blocks)
            self.due |= bool((told[:, 0] == 0).any())
            if self._scene is not None:
                self._scene.expose(faces)
                self._scene.node_fresh[self._face(self._scene, local)] = True
                self._scene.cracks = self._cracks.places

    def _opened(self) -> Ints:
        """(k, 27) cracks that open here: whether the last search has taken them up; ids of both sides; of the nodes of
        either, outward; and what each side adds to the moments of its nodes.
        """
        if self._scene is None or not self.opening:
            return np.zeros((0, _WORDS), np.int64)
        nodes, rows = self._model.nodes, self._opening
        sides = self._cracks.nodes[rows][:, [0, 1, 2, 3, 5, 4]]
        shares = normals.shares(nodes.x, sides.reshape(-1, 3), self._size).reshape(-1, 18)
        return np.column_stack([self._cracks.foreseen[rows], self._cracks.faces[rows], nodes.id[sides], shares])

    def _face(self, now: Scene, local: "np.ndarray") -> "np.ndarray":
        """Gives the scene the mean normals of some nodes of this rank, and whether they are on the surface; returns
        their places.
        """
        place = now.place[local]
        local, place = local[place >= 0], place[place >= 0]
        now.normals[place] = normals.means(self._moments[local])
        now.on_surface[place] = self._surface.flags[local]
        return np.asarray(place)

    def _look_round(self) -> None:
        """Mean normals of all nodes anew; all ranks take part."""
        self._moments = normals.moments(self._model, self._planes, self._size, self._neighbours, self._comm)

    def separate(self, split: Split) -> None:
        """Follows nodes as they separate; all ranks take part."""
        state, self._separated = self._model.nodes, True
        if split.copies.n:
            parents = split.copies.parents
            self._cracks.follow(split, state.id)
            self._flight.grow(parents)
            self._flight.mobility = self._mobility
            self._moments = extended(self._moments, self._moments[parents])
        if self._scene is None:
            return
        here = self._flight.here(state)
        heard = news(split, self._scene, here, self._comm)
        if heard is None:
            return
        follower = Follower(self._scene, here, state)
        follower.follow(heard, self._cracks, self._neighbours)
        if self._comm.size > 1:
            follower.share(heard, self._neighbours, self._comm)

    def _expose(self) -> None:
        """The surface anew, with the cracks that may open; all ranks take part."""
        if self._separated:
            self._surface, self._changed = self._build(self._surface.flags), True

    def grow(self, split: Split, ids: Ints) -> None:
        """Takes up the copies of nodes; what has been booked stays with their parents."""
        parents, none = split.copies.parents, np.zeros(split.copies.n)
        self.contact_loss = extended(self.contact_loss, none)
        self.external_work = extended(self.external_work, none)
        self._mobility = extended(self._mobility, self._mobility[parents])
        self._planes = extended(self._planes, self._planes[parents])
        for some in (parents, split.first + np.arange(split.copies.n)):
            free = self._mobility[some] > 0.0
            self._mobility[some] = np.where(free, 1.0 / self._model.nodes.mass[some, None], 0.0)

    def note(self, state: Nodes) -> None:
        """Before the kick: keeps v(n-1/2), and books the second half of the last impulses' work."""
        if self._scene is not None:
            with self._timers.phase("contact"):
                self._look(self._scene, state)
                self._book(self._scene)
                self._scene.total[:] = 0
        elif len(self._total):
            self._book_resumed(state)

    def search_if_due(self, state: Nodes) -> None:
        """Finds the candidate pairs of the next steps, when that is due; all ranks take part."""
        if not self._clock.dt > 0.0:
            return
        with self._timers.phase("contact"):
            if self._clock.step % normals.EVERY == 0:
                self._look_round()
                if self._scene is not None:
                    self._face(self._scene, self._scene.local)
            if self.due or self._scene is None:
                self._search(state)

    def solve(self, state: Nodes, dt: float, t: float) -> None:
        """After the kick: the impulses of active contacts correct v(n+1/2) at time ``t``, s; all ranks take part."""
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
        flight, old = self._flight, self._scene
        if old is not None:
            old.free()
            self._kept = old.kept
        if self._fractures:
            self._expose()
        goes_on = old is not None and self._clock.t + self._clock.dt <= flight.until
        now = self._scene = self._laid_out(state, goes_on)
        if old is not None and goes_on:
            registration.carry(now, old)
        self._connect(now, state)
        self._look(now, state)
        self._face(now, now.local)
        now.enliven(np.flatnonzero(now.face_exposed).astype(np.int32))
        self._foresee(now)
        registration.news(now)
        if self._rubs:
            now.remember(*self._kept, state, self._comm)
        self.due = False
        self.searches += 1

    def _laid_out(self, state: Nodes, goes_on: bool) -> Scene:
        """The surface as it is, without pairs: for what is left of the last search from nothing, if it ``goes_on``; all
        ranks take part.
        """
        clock, flight, size = self._clock, self._flight, self._size
        flight.begin(state, self._courses(state), clock.t)
        if self._changed:
            flight.follow(self._surface, state, self._mobility)
            self._changed = False
        else:
            flight.refresh(state)
        steps, drift = flight.foresight(clock.dt)
        if not goes_on:
            longest = _LONGEST if self._fractures else steps
            horizon = max(min(steps, longest, 2.0 * (clock.step - self._last)), _SHORTEST) * clock.dt
            flight.until, self._last = clock.t + horizon, clock.step
        rules = Rules(self._domain, ~np.isnan(self._mu), 2.0 * size, self._skin * size, HALO * size, self._rubs)
        return layout.build(flight.sides, rules, flight.until - clock.t, drift, state, self._comm)

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
            return self._flight.spent(state, self._clock.t, self._clock.dt)

    def _push(self, now: Scene, state: Nodes, dt: float, t: float) -> None:
        crowd = now.crowd
        now.copies.begin(state)
        held.take(crowd.x, crowd.v, now.held, state.x, state.v, now.local)
        now.copies.finish(crowd.x, crowd.v, now.before)
        self._give_back = PUSH_OUT if self._account.settle(self._comm) else 0.0
        n = now.met = self._meet(now, dt)
        active, impulse = self._active, (now.impulse, now.shared_impulse)
        active.begin(now.room, n, crowd, now.company)
        active.weigh(now.shares, now.shared_shares)
        if self._rubs:
            active.resume(now.node_face.kept, self._resume(), *impulse)
        active.sweep(self._sweeps, *impulse)
        if self._rubs:
            now.node_face.kept[:] = 0.0
            active.store(now.node_face.kept)
            active.heat(self._friction, now.before)
        active.cost(self._account, now.before)
        if active.leave(crowd, now.total, state, self._parts):
            self.last_push = t
        self._book(now)

    def _resume(self) -> float:
        """The step over the one before: what impulses of the same pairs are worth now."""
        mean_dt = self._clock.mean_dt
        ratio = mean_dt / self._mean_dt if self._mean_dt > 0.0 else 0.0
        self._mean_dt = mean_dt
        return ratio

    def _meet(self, now: Scene, dt: float) -> int:
        """The active contacts of the step; returns how many."""
        step = self._clock.step
        if step % _FORESIGHT == 0:
            self._foresee(now)
        found = detect(now, self._mu, self._give_back, dt, self._size, step % normals.EVERY == 0)
        self.approach, self._opening = found.approach, found.opening
        return found.contacts

    def _foresee(self, now: Scene) -> None:
        """The faces of cracks that may open soon are searched."""
        if len(now.cracks):
            rows = widening(now.cracks, now.crowd.x, self._size)
            sides = now.rows_of(self._cracks.faces[rows].reshape(-1))
            now.enliven(sides[~now.face_live[sides]])

    def _book_resumed(self, state: Nodes) -> None:
        """The second half of the work of impulses from before a run went on here."""
        local = np.flatnonzero(self._total.any(axis=1)).astype(np.int32)
        index = np.arange(len(self._total), dtype=np.int32)
        booking.book(
            self.contact_loss, self.external_work, local, index, state.v, self._total, self._mobility, self._scale
        )  # fmt: skip
        self._total = self._total[:0]

    def _book(self, now: Scene) -> None:
        """Half of the work of the last impulses, with the velocities in ``before``."""
        booking.book(
            self.contact_loss, self.external_work, self._active.places, now.crowd.local, now.before, now.total,
            now.crowd.mobility, self._scale,
        )  # fmt: skip


def _mobility(nodes: Nodes, bounds: list[Boundary]) -> Floats:
    """(nodes, 3) one over the mass, zero where a velocity is held."""
    mobility = np.repeat(1.0 / nodes.mass[:, None], 3, axis=1)
    for bound in bounds:
        mobility[bound.nodes] = np.where(bound.held_components() == FREE, mobility[bound.nodes], 0.0)
    return mobility


def _planes(n: int, bounds: list[Boundary]) -> Flags:
    """(nodes, planes) which of ``n`` nodes lie on which symmetry plane; two planes across one axis are two columns."""
    mirrors = [bound for bound in bounds if bound.mirrors]
    planes = np.zeros((n, len(mirrors)), bool)
    for k, bound in enumerate(mirrors):
        planes[bound.nodes, k] = True
    return planes
