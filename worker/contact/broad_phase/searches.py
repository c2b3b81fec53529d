"""Searches of all ranks. The module contains the schedule and the horizon of searches, and the scene that a search
makes.
"""

import math
from functools import cached_property

import numpy as np

from conoid.cases.model.schema import Case

from ...clock import Clock
from ...migration.parcel import Parcel
from ...model.columns import ABSENT
from ...model.state import Flags, Floats, Ints, Model, Nodes
from ...model.topology import Split
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour
from .. import part_pairs
from ..exterior import Exterior
from ..narrow_phase.crack_contact import widening
from ..narrow_phase.cracks import AGE
from ..scene import layout
from ..scene.near_surface import HALO, Rules
from ..scene.scene import Scene
from ..scene.split_update import SplitUpdate
from ..scene.topology_updates import exchange
from ..surface import normals
from .extrapolation import courses
from .registration import Registration, carry

_SHORTEST = 10.0
"""Smallest horizon of a search, in steps. The horizon is at most twice the number of steps since the last search, but
never below the smallest horizon."""
_LONGEST = 80.0
"""Largest horizon of a search, in steps, if bodies break. With a horizon of 300 steps the additional pairs between
fragments would take a quarter more time than the omitted searches save (docs/performance/bench.md, the bar to 40
us)."""
_AHEAD = 2.0
"""Number of steps before the end of the horizon at which the next search is scheduled. The value is two, because the
narrow phase also detects the contacts of the step after the present one."""
_LEAST = 3.0 + _AHEAD
"""Smallest remaining horizon, in steps, with which the candidates of the last search are kept. With a shorter horizon
the next search would follow immediately. Chosen value: three steps more than _AHEAD. One of the three allows for a time
step that increases."""


class Searches:
    """Scene of a rank, and the searches that make new scenes."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], exterior: Exterior, comm: Comm, clock: Clock,
        registered: Registration,
    ) -> None:  # fmt: skip
        """Creates an object without a scene; the first search makes the scene."""
        self._case, self._model, self._neighbours, self._exterior = case, model, neighbours, exterior
        self._comm, self._clock, self._registered, self._fractures = comm, clock, registered, case.fractures
        self.mu = part_pairs.friction(case)
        """(parts, parts) Coulomb's coefficient of friction for each pair of parts; NaN if the two parts cannot be in
        contact."""
        self.scene: Scene | None = None
        model.nodes.columns.declare(self, "scene.own", place=ABSENT)
        self.due = True
        """True if the next step begins with a search."""
        self.many = 0
        """Number of searches so far."""
        self._last = -math.inf
        """Number of the step in which the last complete search was made."""
        self._kept: tuple[Ints, Floats] = np.zeros((0, 2), np.int64), np.zeros((0, 4))
        """Pairs with their stored impulses, from before a repartition or a restart. The next search assigns the stored
        impulses to its pairs."""

    @cached_property
    def rubs(self) -> bool:
        """True if any pair of parts has friction."""
        return bool(np.nanmax(self.mu, initial=0.0) > 0.0)

    @cached_property
    def _self_contact(self) -> Flags:
        """(parts,) True if the body of the part can be in contact with itself."""
        return part_pairs.self_contact(self._case, self.mu)

    @property
    def rules(self) -> Rules:
        """Parameters of the searches."""
        contact, size = self._case.contact, self._exterior.size
        assert contact is not None
        return Rules(
            contact.domain, ~np.isnan(self.mu), 2.0 * size, contact.skin * size, HALO * size, self._self_contact
        )

    def keep(self, parcel: Parcel) -> None:
        """Adds the stored impulses of pairs to the ``parcel`` (a checkpoint or migration message). The candidate pairs
        are not added, because a search finds them again.
        """
        keys, kept = self._kept if self.scene is None else self.scene.kept
        parcel.rows["contact.kept"] = {"node": keys[:, 0], "face": keys[:, 1], "kept": kept}

    def resume(self, parcel: Parcel) -> None:
        """Restores the stored impulses of pairs from a parcel."""
        kept = parcel.rows["contact.kept"]
        self._kept = np.column_stack([kept["node"], kept["face"]]), kept["kept"]

    def spent(self, nodes: Nodes) -> bool:
        """Returns True if a surface node will depart from its line, within _AHEAD steps, by more than the last search
        allows.
        """
        return self._exterior.motion.spent(nodes, self._clock.t, _AHEAD * self._clock.dt)

    @property
    def scheduled(self) -> bool:
        """True if ``begin`` must be called before the next step."""
        return self.due or self.scene is None or self._clock.step % normals.EVERY == 0 or self._ages

    @property
    def _ages(self) -> bool:
        """True if the ages of cracks must be tested before the next step."""
        return self._fractures and self._clock.step % AGE == 0

    def begin(self, nodes: Nodes) -> None:
        """Recomputes the mean normals every EVERY steps. Makes a search if one is scheduled; to be called before a
        step. Collective.
        """
        if self._clock.step % normals.EVERY == 0:
            self._exterior.turn()
            if self.scene is not None:
                self._exterior.show(self.scene, self.scene.own.local)
        if self._ages:
            self.due |= self._exterior.age()
        if self.due or self.scene is None:
            self._search(nodes)

    def _search(self, nodes: Nodes) -> None:
        """Makes a new scene by a search. Collective."""
        motion, old, exterior = self._exterior.motion, self.scene, self._exterior
        if old is not None:
            old.free()
            self._kept = old.kept
        exterior.take_up()
        goes_on = old is not None and self._clock.t + _LEAST * self._clock.dt <= motion.until
        now = self.scene = self._laid_out(nodes, goes_on)
        if old is not None:
            now.active = old.active
            now.active.begin()
        if old is not None and goes_on:
            carry(now, old)
        self._connect(now, nodes)
        now.store_before(nodes)
        exterior.show(now, now.own.local)
        now.enliven(np.flatnonzero(now.faces.exposed).astype(np.int32))
        self.foresee(anew=True)
        self._registered.register_new(now)
        now.remember(*self._kept, nodes, self._comm)
        self.due = False
        self.many += 1

    def _laid_out(self, nodes: Nodes, goes_on: bool) -> Scene:
        """Makes a scene of the present surface, without pairs. If ``goes_on`` is True, the scene has the remaining
        horizon of the last complete search, else a new horizon. Collective.
        """
        clock, motion = self._clock, self._exterior.motion
        self._exterior.refresh(self._courses(nodes), clock.t)
        steps, drift = motion.foresight(clock.dt)
        if not goes_on:
            longest = _LONGEST if self._fractures else steps
            horizon = max(min(steps, longest, 2.0 * (clock.step - self._last)), _SHORTEST) * clock.dt
            motion.until, self._last = clock.t + horizon, clock.step
        passes = self._registered.scene
        return layout.build(motion.sides, self.rules, motion.until - clock.t, drift, nodes, self._comm, passes)

    def _courses(self, nodes: Nodes) -> Floats:
        """(nodes, 3) extrapolated velocities of the nodes. Collective."""
        if not self._fractures:
            return nodes.v
        return courses(self._model.blocks, nodes, self._neighbours, self._comm, self._registered.rigid)

    def _connect(self, found: Scene, nodes: Nodes) -> None:
        """Adds the cracks to a new scene, and exchanges the lists of shared nodes. Collective."""
        follower = SplitUpdate(found, self._exterior.motion.here(nodes), nodes)
        if self._fractures:
            follower.cracks(self._exterior.cracks, self._model.blocks)
        follower.settle(self._neighbours, self._comm)

    def foresee(self, *, anew: bool = False) -> None:
        """Adds the faces of cracks that may open soon to the broad phase of all ranks that have these faces. ``anew``:
        True after a search; then faces that were already in the broad phase must be added again. Collective.
        """
        now, cracks = self.scene, self._exterior.cracks
        if now is None or not self._fractures:
            return
        rows = widening(now.cracks, now.surface_nodes.x, self._exterior.size)
        faces = cracks.faces[rows[cracks.foreseen[rows]]]
        if not anew:
            faces = faces[~now.faces.live[now.rows_of(faces[:, 0])]]
        sides = now.rows_of(self._comm.join(faces.reshape(-1)))
        now.enliven(sides[~now.faces.live[sides]])

    def separate(self, split: Split, cracks: Ints) -> None:
        """Updates the scene after the separation of nodes. ``cracks``: rows of the cracks at separated nodes. All ranks
        must call the method; topology_updates.py describes which ranks exchange messages.
        """
        if self.scene is None:
            return
        nodes, here = self._model.nodes, self._exterior.motion.here(self._model.nodes)
        received = exchange(split, self.scene, here, self._comm) if self._comm.size > 1 else None
        if not split.copies.n and received is None:
            return
        follower = SplitUpdate(self.scene, here, nodes)
        follower.follow(split, received, self._exterior.cracks, cracks, self._model.blocks, self._neighbours)
        if self._comm.size > 1:
            follower.share(split, received, self._neighbours)

    def pushed(self, nodes: Ints) -> Flags:
        """(k,) True for each of the local ``nodes`` (k,) that had a contact impulse in the last step."""
        if (now := self.scene) is None:
            return np.zeros(len(nodes), bool)
        places = now.own.place[nodes]
        return np.asarray((places >= 0) & now.slots.total[places].any(axis=1))

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        if self.scene is not None:
            self.scene.free()
