"""Contact across cracks.

The two sides of a facet that has broken lie on each other, and no search is needed to know that they meet: from the
moment of separation the nodes across, which were one, push each other apart along the normal of their facet, from a gap
of exactly zero. That holds as long as they are near. What else could reach the faces of a crack has to enter it, so
they are no part of the surface until they are apart by a share of a facet's size: then a search is due, after which
they, their nodes and edges are surface like all other. However finely a body shatters, what has not moved costs no
search.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..migration.parcel import Table
from ..state import WIDE, Block, Floats, Indices, Ints, Nodes, extended
from ..topology import Split, keys
from .meetings import DEEP_SELF, NEAR, needed

_APART = 0.3
"""Of the typical size of a face: two sides that have moved so far apart call for a search."""
_WIDE = 0.1
"""Of it: those that a search makes surface, so that it serves many."""


@dataclass
class Cracks:
    """Facets that have broken and are not surface yet, with a side on this rank."""

    tets: Ints
    """(m, 2) global ids, the smaller first."""
    nodes: Indices
    """(m, 6) local nodes of the first side, counter-clockwise seen from outside of it, and those across."""
    sides: Indices
    """(m, 2, 3) block, place and face of either side, -1 for one of another rank."""

    @classmethod
    def none(cls) -> "Cracks":
        """No facet."""
        return cls(np.zeros((0, 2), np.int64), np.zeros((0, 6), np.int32), np.zeros((0, 2, 3), np.int32))

    def add(self, tets: Ints, nodes: Indices, sides: Indices) -> None:
        """Takes up facets with their three ``nodes`` (m, 3)."""
        self.tets, self.sides = extended(self.tets, tets), extended(self.sides, sides)
        self.nodes = extended(self.nodes, np.concatenate([nodes, nodes], axis=1))

    def follow(self, split: Split, ids: Ints) -> None:
        """Takes up the copies of a split; ``ids``: of the local nodes."""
        parents = np.zeros(len(ids), bool)
        parents[split.copies.parents] = True
        rows = touching(self.nodes, parents)
        self.nodes[rows] = split.followed_sides(self.nodes[rows], ids, self.tets[rows])

    def keep(self, blocks: list[Block], ids: Ints) -> Table:
        """The facets as a table; ``ids``: of the local nodes."""
        one, two = (self._seen_from(blocks, k) for k in (0, 1))
        faces = np.where(one >= 0, one, two[:, ::-1])
        rows = np.concatenate([np.flatnonzero(self.sides[:, k, 1] >= 0) for k in (0, 1)])
        tet = np.concatenate([self.tets[self.sides[:, k, 1] >= 0, k] for k in (0, 1)])
        return {
            "tet": tet, "key": keys(*self.tets[rows].T), "tets": self.tets[rows], "faces": faces[rows],
            "with": ids[self.nodes[rows]],
        }  # fmt: skip

    def _seen_from(self, blocks: list[Block], k: int) -> Ints:
        """(m, 2) local faces of side ``k`` and of the other, as side ``k`` knows them; -1 where it is elsewhere."""
        found = np.full((len(self.tets), 2), -1, np.int64)
        for b, block in enumerate(blocks):
            here = np.flatnonzero((self.sides[:, k, 0] == b) & (self.sides[:, k, 1] >= 0))
            place, face = self.sides[here, k, 1], self.sides[here, k, 2]
            found[here] = np.column_stack([face, block.across[place, face] % 4])
        return found

    @classmethod
    def resume(cls, table: Table, blocks: list[Block], nodes: Nodes) -> "Cracks":
        """Facets from a table."""
        sides = np.full((len(table["tets"]), 2, 3), -1, np.int32)
        for b, block in enumerate(blocks):
            order = np.argsort(block.id)
            at = order[np.minimum(np.searchsorted(block.id[order], table["tets"]), block.n - 1)]
            rows, k = np.nonzero(block.id[at] == table["tets"])
            sides[rows, k] = np.column_stack([np.full(len(rows), b), at[rows, k], table["faces"][rows, k]])
        return cls(table["tets"], nodes.places(table["with"]), sides)

    def release(self, blocks: list[Block], x: Floats, size: float) -> int:
        """Makes surface of what is wide at the positions ``x`` (nodes, 3); returns how many facets."""
        apart = x[self.nodes[:, 3:]] - x[self.nodes[:, :3]]
        wide = ((apart * apart).sum(axis=2) > (_WIDE * size) ** 2).any(axis=1)
        sides = self.sides[wide].reshape(-1, 3)
        for b, block in enumerate(blocks):
            mine = sides[(sides[:, 0] == b) & (sides[:, 1] >= 0)]
            if len(mine):
                block.bond[mine[:, 1], mine[:, 2]] = WIDE
        self.tets, self.nodes, self.sides = self.tets[~wide], self.nodes[~wide], self.sides[~wide]
        return int(wide.sum())


@njit("int64[::1](int32[:, ::1], boolean[::1])", cache=True)
def touching(table, flags):  # type: ignore[no-untyped-def]
    """Rows of ``table`` (n, k) with an entry that is flagged."""
    rows = np.empty(len(table), np.int64)
    n = 0
    for i in range(len(table)):
        for k in range(table.shape[1]):
            if flags[table[i, k]]:
                rows[n] = i
                n += 1
                break
    return rows[:n].copy()


@njit(
    "UniTuple(int64, 2)(int32[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], int32[::1], "
    "int64, int32[:, ::1], float64, float64[:, ::1], float64[:, ::1], int32[::1], float64[:, ::1], float64, "
    "float64)",
    cache=True,
    error_model="numpy",
)
def across(nodes, weights, normals, wanted, friction, pair, n, cracks, typical, x, v, part, mu, give, dt):  # type: ignore[no-untyped-def]
    """Nodes across ``cracks`` (m, 6) that close on each other, from row ``n`` on (meetings.node_face).

    ``typical``: size of a face, m. Returns the new number of rows, and 1 when two sides have moved so far apart that a
    search is due, else 0.
    """
    e, f, m = np.empty(3), np.empty(3), np.empty(3)
    far = 0
    for c in range(len(cracks)):
        for i in range(3):
            start = x[cracks[c, 0], i] + x[cracks[c, 3], i]
            e[i] = 0.5 * (x[cracks[c, 1], i] + x[cracks[c, 4], i] - start)
            f[i] = 0.5 * (x[cracks[c, 2], i] + x[cracks[c, 5], i] - start)
        square = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            m[i] = e[j] * f[k] - e[k] * f[j]
            square += m[i] * m[i]
        size = np.sqrt(np.sqrt(square))
        for i in range(3):
            m[i] /= np.sqrt(square)
        for k in range(3):
            p, q = cracks[c, k], cracks[c, 3 + k]
            if p == q:
                continue
            gap0, speed, apart = 0.0, 0.0, 0.0
            for i in range(3):
                opening = x[q, i] - x[p, i]
                gap0 += m[i] * opening
                speed += m[i] * (v[q, i] - v[p, i])
                apart += opening * opening
            if apart > (_APART * typical) ** 2:
                far = 1
            gap1 = gap0 + dt * speed
            if not (gap1 <= NEAR * size and gap0 >= -DEEP_SELF * size and mu[part[p], part[q]] >= 0.0):
                continue
            nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = q, p, p, p
            weights[n, 0], weights[n, 1], weights[n, 2], weights[n, 3] = 1.0, -1.0, 0.0, 0.0
            for i in range(3):
                normals[n, i] = m[i]
            wanted[n] = speed + needed(gap0, gap1, speed, give, dt)
            friction[n], pair[n] = mu[part[p], part[q]], -1
            n += 1
    return n, far
