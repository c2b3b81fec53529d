"""Loops over the surface that sort by ranges have the same results as plain loops, in the same order on any number of
threads.
"""

import numpy as np
import pytest

from conoid.worker.contact.surface.families import CornerLists, Families
from conoid.worker.contact.surface.half_edges import HalfEdges
from conoid.worker.parallel.team import team

from .bodies import Flags, Floats, Indices

NODES, MANY = 3000, 5000
"""Numbers of nodes, and of cracks or faces, that need several tasks and all ranges."""
Corner = tuple[int, int, int]


def cracks_and_families(seed: int) -> tuple[Indices, Indices, Families]:
    """Cracks between random nodes of random families; a third of the sides is on another rank or block."""
    draw = np.random.default_rng(seed)
    root = np.sort(draw.integers(0, NODES // 2, NODES))
    cracks = draw.integers(0, NODES, (MANY, 6)).astype(np.int32)
    same = draw.uniform(size=(MANY, 3)) < 0.5
    cracks[:, 3:] = np.where(same, cracks[:, :3], cracks[:, 3:])
    sides = draw.integers(-1, 2, (MANY, 2, 3)).astype(np.int32)
    return cracks, sides, Families.of(root)


def by_family(cracks: Indices, sides: Indices, block: int, root: "np.ndarray") -> dict[int, list[int]]:
    """Codes of the corners of each root node, from the definition."""
    many, found = np.bincount(root), dict[int, list[int]]()
    for c, h, k in np.ndindex(len(cracks), 2, 3):
        p = cracks[c, 3 * h + k]
        if sides[c, h, 1] >= 0 and sides[c, h, 0] == block and p != cracks[c, 3 - 3 * h + k] and many[root[p]] > 2:
            found.setdefault(int(root[p]), []).append(8 * c + 4 * h + k)
    return found


@pytest.mark.parametrize("threads", [1, 3])
def test_corners_of_narrow_sides_are_listed_by_family(threads: int) -> None:
    cracks, sides, families = cracks_and_families(1)
    root = families.root
    for block in (0, 1):
        expected = by_family(cracks, sides, block, root)
        found = CornerLists(team(threads)).of(cracks, sides, block, families)
        lists = {}
        for f, (begin, end) in enumerate(zip(found.begin[:-1], found.begin[1:], strict=True)):
            members = found.members[begin:end]
            assert sorted(members) == np.flatnonzero(root == root[members[0]]).tolist()
            assert (found.among[members] == np.arange(begin, end)).all()
            lists[int(root[members[0]])] = found.corners[found.start[f] : found.start[f + 1]].tolist()
        assert lists == expected
        assert len(lists) > 100


def faces_of(seed: int) -> tuple[Indices, Flags, Floats]:
    """Random faces with few different nodes, so that many faces share an edge; flags and normals of the faces."""
    draw = np.random.default_rng(seed)
    first = draw.integers(0, NODES // 40, MANY)
    corners = (20 * first[:, None] + draw.permuted(np.tile(np.arange(6), (MANY, 1)), axis=1)[:, :3]).astype(np.int32)
    units = draw.normal(size=(MANY, 3))
    return corners, draw.uniform(size=(MANY, 3)) < 0.8, units / np.linalg.norm(units, axis=1)[:, None]


def edges_of(corners: Indices, half: Flags, units: Floats, sharp: float) -> list[list[int]]:
    """Edges of the faces, from the definition."""
    halves, found = dict[Corner | tuple[int, int], list[tuple[int, int]]](), []
    for f, k in np.argwhere(half).tolist():
        ends = int(corners[f, k]), int(corners[f, (k + 1) % 3])
        halves.setdefault((min(ends), max(ends)), []).append((f, k))
    for one in halves.values():
        for i, (f, k) in enumerate(one):
            for g, m in one[i + 1 :]:
                opposite = corners[g, m] != corners[f, k]
                if opposite and corners[g, (m + 2) % 3] != corners[f, (k + 2) % 3]:
                    found.append([f, k, g, m, int(units[f] @ units[g] < sharp)])
    return sorted(found, key=lambda edge: (edge[0], edge[2], edge[1]))


@pytest.mark.parametrize("threads", [1, 3])
def test_half_edges_of_opposite_direction_make_an_edge(threads: int) -> None:
    """The search begins with more edges than there is memory for."""
    corners, half, units = faces_of(2)
    expected = edges_of(corners, half, units, 0.3)
    found = HalfEdges(team(threads)).pairs(corners, half, units, NODES, 0.3)
    assert len(expected) > 3 * MANY
    assert sorted(found.tolist(), key=lambda edge: (edge[0], edge[2], edge[1])) == expected
    assert (np.diff(found[:, 0]) >= 0).all()
