"""Searches of all ranks: when one is due, how far ahead it looks, and the scene that it leaves."""

import math
from functools import cached_property

import numpy as np

from conoid.cases.model.schema import Case

from ...clock import Clock
from ...migration.parcel import Parcel
from ...model.state import Flags, Floats, Ints, Model, Nodes
from ...model.topology import Split
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour
from .. import part_pairs
from ..exterior import Exterior
from ..narrow_phase.cracks import AGE, widening
from ..scene import layout
from ..scene.near_surface import HALO, Rules
from ..scene.scene import Scene
from ..scene.split_update import SplitUpdate
from ..scene.topology_updates import gather
from ..surface import normals
from . import registration
from .extrapolation import courses

_SHORTEST = 10.0
"""Steps of free flight that a search looks ahead at least; at most twice what the last search was good for."""
_LONGEST = 80.0
"""The same at most where bodies break: with 300 steps the pairs between fragments cost a quarter more than the searches
that they save (docs/performance/bench.md, the bar to 40 us).
"""
_AHEAD = 2.0
"""Steps before the end of what a search looked ahead at which another one is due: the second is the one that
narrow_phase looks ahead.
"""
_LEAST = 3.0 + _AHEAD
"""Steps that a search must be good for still, so that what has changed is added to it: with fewer the next one would
be due at once. Chosen: one more than that, and one for a step that grows.
"""


class Searches:
    """The scene of a rank, and the searches that renew it."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], exterior: Exterior, comm: Comm, clock: Clock
    ) -> None:
        """Nothing is searched yet."""
        self._case, self._model, self._neighbours, self._exterior = case, model, neighbours, exterior
        self._comm, self._clock = comm, clock
        self.mu = part_pairs.friction(case)
        """(parts, parts) Coulomb's coefficient, NaN where two parts do not meet."""
        self.scene: Scene | None = None
        self.due = True
        """Whether the next step begins with a search."""
        self.many = 0
        """Searches so far."""
        self._last = -math.inf
        """Step of the last one from nothing."""
        self._kept: tuple[Ints, Floats] = np.zeros((0, 2), np.int64), np.zeros((0, 4))
        """Candidates, and what they have kept, that the next search takes over from elsewhere."""

    @cached_property
    def rubs(self) -> bool:
        """Whether there is friction anywhere."""
        return bool(np.nanmax(self.mu, initial=0.0) > 0.0)

    @cached_property
    def _itself(self) -> Flags:
        """(parts,) whether the body of each may meet itself."""
        return part_pairs.itself(self._case, self.mu)

    @property
    def rules(self) -> Rules:
        """How to search."""
        contact, size = self._case.contact, self._exterior.size
        assert contact is not None
        return Rules(contact.domain, ~np.isnan(self.mu), 2.0 * size, contact.skin * size, HALO * size, self._itself)

    def keep(self, parcel: Parcel) -> None:
        """Adds what pairs have kept: the candidates themselves a search finds again."""
        keys, kept = self._kept if self.scene is None else self.scene.kept
        parcel.rows["contact.kept"] = {"node": keys[:, 0], "face": keys[:, 1], "kept": kept}

    def resume(self, parcel: Parcel) -> None:
        """Takes it back."""
        kept = parcel.rows["contact.kept"]
        self._kept = np.column_stack([kept["node"], kept["face"]]), kept["kept"]

    def spent(self, nodes: Nodes) -> bool:
        """Whether a node of the surface will soon (_AHEAD) leave what the last search has allowed for."""
        return self._exterior.motion.spent(nodes, self._clock.t, _AHEAD * self._clock.dt)

    def begin(self, nodes: Nodes) -> None:
        """Before a step: mean normals when it is their turn, a search when it is due; all ranks take part."""
        if self._clock.step % normals.EVERY == 0:
            self._exterior.turn()
            if self.scene is not None:
                self._exterior.show(self.scene, self.scene.own.local)
        if self._case.fractures and self._clock.step % AGE == 0:
            self.due |= self._exterior.age()
        if self.due or self.scene is None:
            self._search(nodes)

    def _search(self, nodes: Nodes) -> None:
        """The scene anew; all ranks take part."""
        motion, old, exterior = self._exterior.motion, self.scene, self._exterior
        if old is not None:
            old.free()
            self._kept = old.kept
        exterior.take_up()
        goes_on = old is not None and self._clock.t + _LEAST * self._clock.dt <= motion.until
        now = self.scene = self._laid_out(nodes, goes_on)
        if old is not None and goes_on:
            registration.carry(now, old)
        self._connect(now, nodes)
        now.look(nodes)
        exterior.show(now, now.own.local)
        now.enliven(np.flatnonzero(now.faces.exposed).astype(np.int32))
        self.foresee(anew=True)
        registration.register_new(now)
        now.remember(*self._kept, nodes, self._comm)
        self.due = False
        self.many += 1

    def _laid_out(self, nodes: Nodes, goes_on: bool) -> Scene:
        """The surface as it is, without pairs: for what is left of the last search from nothing, if it ``goes_on``; all
        ranks take part.
        """
        clock, motion = self._clock, self._exterior.motion
        self._exterior.refresh(self._courses(nodes), clock.t)
        steps, drift = motion.foresight(clock.dt)
        if not goes_on:
            longest = _LONGEST if self._case.fractures else steps
            horizon = max(min(steps, longest, 2.0 * (clock.step - self._last)), _SHORTEST) * clock.dt
            motion.until, self._last = clock.t + horizon, clock.step
        return layout.build(motion.sides, self.rules, motion.until - clock.t, drift, nodes, self._comm)

    def _courses(self, nodes: Nodes) -> Floats:
        """(nodes, 3) how the nodes fly on; all ranks take part."""
        if not self._case.fractures:
            return nodes.v
        return courses(self._model.blocks, nodes, self._neighbours, self._comm)

    def _connect(self, found: Scene, nodes: Nodes) -> None:
        """Takes the cracks up into a new scene, and settles who shares what of it; all ranks take part."""
        follower = SplitUpdate(found, self._exterior.motion.here(nodes), nodes)
        if self._case.fractures:
            follower.cracks(self._exterior.cracks, self._model.blocks)
        follower.settle(self._neighbours, self._comm)

    def foresee(self, *, anew: bool = False) -> None:
        """The faces of cracks that may open soon are searched, by all ranks that have them; all take part. ``anew``:
        after a search, when others have come near.
        """
        now, cracks = self.scene, self._exterior.cracks
        if now is None or not self._case.fractures:
            return
        rows = widening(now.cracks, now.surface_nodes.x, self._exterior.size)
        faces = cracks.faces[rows[cracks.foreseen[rows]]]
        if not anew:
            faces = faces[~now.faces.live[now.rows_of(faces[:, 0])]]
        sides = now.rows_of(self._comm.join(faces.reshape(-1)))
        now.enliven(sides[~now.faces.live[sides]])

    def separate(self, split: Split) -> None:
        """Follows nodes as they separate; called on all ranks, see topology_updates.py for those that take part."""
        if self.scene is None:
            return
        nodes, here = self._model.nodes, self._exterior.motion.here(self._model.nodes)
        heard = gather(split, self.scene, here, self._comm)
        if heard is None:
            return
        follower = SplitUpdate(self.scene, here, nodes)
        follower.follow(heard, self._exterior.cracks, self._model.blocks, self._neighbours)
        if self._comm.size > 1:
            follower.share(heard, self._neighbours)

    def pushed(self, nodes: Ints) -> Flags:
        """(k,) which of these ``nodes`` (k,) of this rank contact has pushed in the last step."""
        if (now := self.scene) is None:
            return np.zeros(len(nodes), bool)
        places = now.own.place[nodes]
        return np.asarray((places >= 0) & now.slots.total[places].any(axis=1))

    def free(self) -> None:
        """Gives the messages back to MPI."""
        if self.scene is not None:
            self.scene.free()
