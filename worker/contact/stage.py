"""Contact in the time step. If a search is scheduled, the stage finds candidate pairs. Then it detects active contacts,
applies impulses, and computes the work of the impulses.

Every contact is computed by one rank: the owner of its node, or the rank of its first edge. This rank has ghosts of the
surfaces of other ranks. Impulses on a node are summed over all ranks that have the node or compute a contact of the
node. Therefore the velocities of all copies of the node are bit-identical.
"""

from dataclasses import dataclass

import numpy as np

from conoid.cases.estimates.impact import pressed, sweeps
from conoid.cases.model.schema import Case

from ..accounts.timers import Timers
from ..boundaries.boundaries import Boundary
from ..clock import Clock
from ..migration.parcel import Parcel
from ..model.state import Flags, Floats, Indices, Ints, Model, Nodes
from ..model.topology import Split
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..parallel.team import Team
from ..reduction import StepReduction
from ..rigid.stage import Rigid
from . import part_pairs
from .books import Books
from .broad_phase.registration import Registration
from .broad_phase.searches import Searches
from .effort import effort
from .exterior import Exterior
from .narrow_phase.detection import Ahead, Detected, Detection
from .narrow_phase.tables import PUSH_OUT
from .scene.scene import Scene
from .solver.solver import ActiveSet
from .solver.step import SolverStep
from .solver.stops import Stops
from .solver.sweep_count import SweepCount
from .surface import normals, sharp

_FORESIGHT = 32
"""Number of steps between two checks of the widths of cracks."""


@dataclass(frozen=True)
class _Scheme:
    """Settings of contact that are constant during the run."""

    restitution: float
    interval: int
    """Number of steps between two searches for edges that have become sharp."""
    sharp: Floats
    """(parts,) cosine of the smallest angle between the normals of the two faces of a sharp edge."""

    @classmethod
    def of(cls, case: Case) -> "_Scheme":
        assert case.contact is not None
        some = np.array(pressed(case))
        interval = sharp.PRESSED if some.any() else normals.EVERY
        return cls(case.contact.restitution, interval, np.where(some, sharp.BENT, sharp.SHARP))


class Contact:
    """Contact of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], bounds: list[Boundary],
        comm: Comm, clock: Clock, timers: Timers, team: Team, extremes: tuple[float, float], rigid: Rigid | None = None,
    ) -> None:  # fmt: skip
        """``extremes``: largest nodal mass, kg, and largest speed, m/s, of the scene; ``rigid``: rigid bodies of the
        case.
        """
        assert case.contact is not None
        self._fractures, self._comm, self._clock, self._timers = case.fractures, comm, clock, timers
        self.exterior = Exterior(model, neighbours, bounds, case.contact.edges, comm, team)
        registered = Registration(team)
        self.searches = Searches(case, model, neighbours, self.exterior, comm, clock, registered)
        largest, speed = extremes
        mass = part_pairs.lighter(self.searches.mu, model.nodes, self.exterior.motion.mobility, comm, rigid) or largest
        self.books = Books(model.nodes, case, mass * speed, mass * speed * speed, team)
        bodies = rigid.contacts if rigid is not None else None
        self._active = ActiveSet(self.books.scale, Stops.of(case, model, comm), team, bodies)
        self._scheme, self.sweep_count = _Scheme.of(case), SweepCount(sweeps(case))
        self.detection = Detection(team, registered, lasting=not (case.fractures or case.erodes))
        self.limit = 0.0
        """Inverse of the largest time step, 1/s, in which no node of any rank passes more than half of a tet with which
        it is in contact."""
        self.last_push = 0.0
        """Simulated time of the last contact impulse on a node of this rank, s."""
        self._mean_dt = 0.0
        """Mean time step at the last step with a scene, s, which the kick of that step used."""

    def keep(self, parcel: Parcel) -> None:
        """Adds the state of contact to the ``parcel`` of a checkpoint or migration message. The candidate pairs are not
        added, because a search finds them again."""
        books = self.books
        parcel.known["contact"] = (
            books.scale, books.friction.scale, self.limit, self.searches.many, self._mean_dt, self.exterior.size,
            self._active.stops.sides, self.sweep_count.known(), books.account.known(),
        )  # fmt: skip
        self.books.keep(parcel, self.searches.scene)
        self.exterior.keep(parcel)
        self.searches.keep(parcel)

    def resume(self, parcel: Parcel) -> None:
        """Restores the state of contact from a parcel. Collective."""
        books = self.books
        (
            books.scale, books.friction.scale, self.limit, self.searches.many, self._mean_dt, size,
            sides, need, account,
        ) = parcel.known["contact"]  # fmt: skip
        self._active.go_on(books.scale, sides)
        self.sweep_count.resume(need)
        books.resume(parcel, account)
        books.agreed = self._comm.sum(books.account.words)
        self.exterior.resume(parcel, size, self._fractures)
        self.searches.resume(parcel)

    def require_faces(self) -> None:
        """Raises InputError on all ranks if a part that may be in contact has no exposed face."""
        self.exterior.require_faces(~np.isnan(self.searches.mu))

    @property
    def outside(self) -> int:
        """Number of surface nodes that this rank owns."""
        return int(self.on_surface.sum())

    @property
    def on_surface(self) -> Flags:
        """(nodes,) whether each node is a surface node that this rank owns."""
        return self.exterior.owned

    def effort(self) -> Floats:
        """(nodes, 2) cost of contact for each node of this rank, in units of 50 ns; see ``effort.effort``."""
        return effort(self.searches.scene, self.on_surface)

    def impulses(self) -> Floats:
        """(parts, 3) sum of the contact impulses on each part so far, N s. Collective."""
        return self.books.impulses(self._comm)

    def uncover(self, gone: Ints, loose: Flags, removed: Flags) -> None:
        """Updates the surface after erosion. ``gone`` (k, exposure.WORDS): removed tets of this rank; ``loose``
        (nodes,): nodes without tets that stay in the model; ``removed`` (nodes,): nodes that are removed from the
        model. Collective.
        """
        with self._timers.phase("contact"):
            self.searches.due |= self.exterior.uncover(gone, loose, removed, self.searches.scene)

    def crack(self, faces: Ints, nodes: Indices, sides: Indices) -> None:
        """Adds broken facets that have a side on this rank. ``nodes`` (m, 3): local nodes of the sides; ``faces`` and
        ``sides``: see ``Cracks``.
        """
        self.exterior.cracks.add(faces, nodes, sides)

    @property
    def costs(self) -> Ints:
        """(4,) words of the energy account of this rank."""
        return self.books.account.words.reshape(-1)

    def agree(self, all_ranks: StepReduction) -> None:
        """Reads the results of the reduction of the step that concern contact. Collective."""
        self.sweep_count.agree(all_ranks.unsettled)
        self.books.agreed = all_ranks.costs.reshape(2, 2)
        self.searches.due |= all_ranks.search
        self.found.stray = all_ranks.stray
        self.limit = all_ranks.approach
        if all_ranks.opening:
            self.open_cracks()

    @property
    def found(self) -> Detected:
        """Result of the last detection of active contacts on this rank."""
        return self.detection.found

    @property
    def approach(self) -> float:
        """Inverse of the largest time step, 1/s, in which no contact node of this rank passes more than half a tet."""
        return self.found.approach

    @property
    def stray(self) -> bool:
        """True if a slot will soon depart too far from its reference motion, so that it must be registered again."""
        return self.found.stray

    @property
    def opening(self) -> bool:
        """True if a crack is wide enough, after the last step, to become part of the surface."""
        return len(self.found.opening) > 0

    def open_cracks(self) -> None:
        """Adds the sides of wide cracks to the surface. Collective."""
        with self._timers.phase("contact"):
            received = self._comm.join(self.exterior.widened(self.found.opening))
            self.found.opening = self.found.opening[:0]
            self.searches.due |= self.exterior.open(received, self.searches.scene)

    def separate(self, split: Split) -> None:
        """Updates contact after the separation of nodes (topology_updates.py). All ranks must call the method."""
        self.searches.separate(split, self.exterior.separate(split))

    def grow(self, split: Split, ids: Ints) -> None:
        """Updates the mobilities of separated nodes."""
        self.exterior.grow(split)

    def note(self, state: Nodes) -> None:
        """Stores v(n-1/2), and adds the second half of the work of the last impulses; to be called before the kick."""
        now = self.searches.scene
        self.books.due()
        self.sweep_count.unsettled[:] = 0
        if now is None:
            self.books.book_resumed(state, self.exterior.motion.mobility)
            return
        with self._timers.phase("contact"):
            now.store_before(state)
            self.books.book(now, self._active.places)
            now.slots.total[:] = 0

    def search_if_due(self, state: Nodes) -> None:
        """Finds the candidate pairs of the next steps, if a search is scheduled. Collective."""
        if self.searches.scheduled:
            with self._timers.phase("contact"):
                self.searches.begin(state)

    def spent(self, state: Nodes) -> bool:
        """Returns True if a surface node will depart in one step by more than the last search allows."""
        return self.searches.spent(state)

    def look_ahead(self, state: Nodes) -> bool:
        """Limits the first step because of the pairs that approach each other. Returns True if any pairs approach each
        other. Collective.
        """
        if (now := self.searches.scene) is None:
            return False
        with self._timers.phase("contact"):
            self.detection.take(now, state)
            ahead = Ahead(0.0, self._clock.dt, self.exterior.size, 1.0 + self._scheme.restitution)
            found = self.detection.detect(now, self.exterior, self.searches.mu, ahead, True, together=False)
            self.limit = float(self._comm.maximum(np.array([found.approach]))[0])
        return self.limit > 0.0

    def solve(self, state: Nodes, dt: float, t: float) -> None:
        """Corrects v(n+1/2) by the impulses of active contacts at time ``t``, s; to be called after the kick.
        Collective.
        """
        if (now := self.searches.scene) is not None:
            with self._timers.phase("contact"):
                self._push(now, state, dt, t)

    def _push(self, now: Scene, state: Nodes, dt: float, t: float) -> None:
        surface_nodes = now.surface_nodes
        now.messages.copies.begin(state)
        self.detection.take(now, state)
        now.messages.copies.finish(surface_nodes.x, surface_nodes.v, now.slots.before)
        give = PUSH_OUT if self.books.account.settle(self.books.agreed) else 0.0
        self._meet(now, give, dt)
        self.detection.retarget(now, self._scheme.restitution, give)
        shared = now.messages.company.agree(now.active, surface_nodes.local)
        kept, ratio = now.stored(self.exterior.cracks.kept), self._resume(give)
        of, many, slots = self.exterior, self.sweep_count, now.slots
        step = SolverStep(
            now.active, surface_nodes, slots.before, slots.total, state, of.motion.loose, self.books, many.unsettled,
            kept, ratio, many.sweeps, self.searches.rubs, of.size, dt,
        )  # fmt: skip
        if self._active.solve(step, shared):
            self.last_push = t
            self.books.press(now)
        self._active.press(self.books.pressed)
        shared.free()

    def _resume(self, give: float) -> float:
        """Length of this step divided by the length of the last step; the stored impulses are multiplied by this
        factor. Without restitution the factor is 0 while contact has no energy to return (``give`` = 0), because a
        stored impulse that is too large adds energy.
        """
        mean_dt = self._clock.mean_dt
        ratio = mean_dt / self._mean_dt if self._mean_dt > 0.0 else 0.0
        self._mean_dt = mean_dt
        return ratio if give > 0.0 or self._scheme.restitution > 0.0 else 0.0

    def _meet(self, now: Scene, give: float, dt: float) -> None:
        """Detects the active contacts of the step. ``give``: fraction of a penetration that is corrected in the step
        (tables.PUSH_OUT)."""
        step = self._clock.step
        if step % _FORESIGHT == 0:
            self.searches.foresee()
        redraw = step % normals.EVERY == 0
        if step % self._scheme.interval == 0:
            self.exterior.sharpen(now, self._scheme.sharp)
            self.detection.clearance.clear()
        ahead = Ahead(dt, self._clock.longest, self.exterior.size, 1.0 + self._scheme.restitution, give)
        self.detection.detect(now, self.exterior, self.searches.mu, ahead, redraw, self.found.stray)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self.searches.free()
