"""What a scene knows of its slots, faces and edges: a column each, by their rows."""

from dataclasses import dataclass

import numpy as np

from ..state import Flags, Floats, Indices, Ints, extended
from .normals import COLUMNS
from .records import Crowd


@dataclass
class OwnSlots:
    """The slots of the nodes that this rank holds."""

    slots: Indices
    """(h,) which they are."""
    local: Indices
    """(h,) indices of their nodes on this rank."""
    place: Indices
    """(nodes,) slot of each node of this rank, -1 for those that have none."""


@dataclass
class SceneSlots:
    """The slots."""

    slave: Flags
    """(slots,) the nodes whose contacts with faces this rank computes."""
    pushes: Flags
    """(slots,) which nodes a contact of this rank may push."""
    live: Flags
    """(slots,) the slaves that are searched."""
    new: Flags
    """(slots,) which have to be registered."""
    fresh: Flags
    """(slots,) whose pairs have to be tested, for they have other mean normals."""
    tracked: Flags
    """(slots,) nodes of what is searched."""
    on_surface: Flags
    """(slots,) of nodes that are held here: only those on the surface meet faces."""
    first: Indices
    """(slots,) the first pair with a face, -1 for none."""
    normals: Floats
    """(slots, COLUMNS) mean normals; see narrow_phase.SlotTable."""
    total: Ints
    """(slots, 3) impulses of the last step, quanta."""
    before: Floats
    """(slots, 3) v(n-1/2)."""

    @classmethod
    def at_rest(cls, slave: Flags, pushes: Flags) -> "SceneSlots":
        """Nothing is searched yet."""
        n = len(slave)
        live, new, fresh, tracked, on_surface = np.zeros((5, n), bool)
        first, normals, total, before = (
            np.full(n, -1, np.int32), np.zeros((n, COLUMNS)), np.zeros((n, 3), np.int64), np.zeros((n, 3)),
        )  # fmt: skip
        return cls(slave, pushes, live, new, fresh, tracked, on_surface, first, normals, total, before)

    def add(self, rows: Crowd) -> None:
        """Takes up more slots."""
        more = SceneSlots.at_rest(*np.zeros((2, rows.n), bool))
        more.before = rows.v
        for name, column in vars(more).items():
            setattr(self, name, extended(getattr(self, name), column))

    def inherit(self, copies: Indices, parents: Indices) -> None:
        """Copies have the normals of their parents, are searched as they are, and pushed by the same ranks."""
        for column in (self.normals, self.slave, self.on_surface, self.pushes, self.live, self.new, self.tracked):
            column[copies] = column[parents]


@dataclass
class SceneFaces:
    """The faces."""

    corners: Indices
    """(f, 4) slots."""
    id: Ints
    """(f,) ascending."""
    size: Floats
    exposed: Flags
    """(f,) only exposed faces are met."""
    live: Flags
    """(f,) which are searched: what is exposed, and what may be soon."""
    new: Flags
    """(f,) which have to be registered."""
    fresh: Flags
    """(f,) whose pairs have to be tested: new corners, newly exposed."""

    @classmethod
    def at_rest(cls, corners: Indices, ids: Ints, size: Floats, exposed: Flags) -> "SceneFaces":
        """Nothing is searched yet."""
        return cls(corners, ids, size, exposed, *np.zeros((3, len(corners)), bool))


@dataclass
class SceneEdges:
    """The edges; only sharp ones are searched."""

    corners: Indices
    """(e, 4) slots."""
    sides: Ints
    """(e, 2) ids of their faces."""
    faces: Indices
    """(e, 2) rows of these, -1 for a face that is not here."""
    size: Floats
    exposed: Flags
    """(e, 2) whether either face is; only edges between exposed faces are met."""
    sharp: Flags
    """(e,) whether it is, or has been (sharp.py)."""
    own: Flags
    """(e,) whose face of smaller id is of this rank."""
    rank: Ints
    """(e,) of two edges, that of lower rank has the pair."""
    far: Ints
    """Rows of edges with a face that is not here."""
    live: Flags
    """(e,) which are searched."""
    new: Flags
    """(e,) which have to be registered."""
    fresh: Flags
    """(e,) whose pairs have to be tested."""

    @classmethod
    def at_rest(
        cls, corners: Indices, sides: Ints, faces: Indices, size: Floats, exposed: Flags, sharp: Flags, own: Flags,
        rank: Ints,
    ) -> "SceneEdges":  # fmt: skip
        """Nothing is searched yet."""
        far = np.flatnonzero((faces < 0).any(axis=1))
        return cls(corners, sides, faces, size, exposed, sharp, own, rank, far, *np.zeros((3, len(corners)), bool))

    @property
    def names(self) -> Ints:
        """(e,) the two faces of each edge as one number: two faces have one edge in common."""
        return (self.sides[:, 0] << 32) + self.sides[:, 1]
