"""Solids of one body that touch in edges or points only. Such solids have common nodes in these edges or points, and
the joint carries no moment.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from .draw import Solids


def hinges(gmsh: Any, solids: Solids) -> Iterator[str]:
    """Yield a note if some solids of a body have no common face with the other solids of that body."""
    faces = [_boundary(gmsh, [each]) for each in solids]
    lines = [_boundary(gmsh, sorted(each)) for each in faces]
    points = [_boundary(gmsh, sorted(each)) for each in lines]
    of = list(range(len(solids)))
    for i, j in combinations(range(len(solids)), 2):
        if faces[i] & faces[j]:
            of = [of[i] if one == of[j] else one for one in of]
    pairs = [(i, j) for i, j in combinations(range(len(solids)), 2) if of[i] != of[j] and points[i] & points[j]]
    if pairs:
        where = "edges" if any(lines[i] & lines[j] for i, j in pairs) else "points"
        yield (
            f"some of its solids touch each other only in {where}, which act as hinges; let these solids overlap or "
            "touch with faces, or make each of them a part"
        )


def _boundary(gmsh: Any, entities: Solids) -> set[tuple[int, int]]:
    return set(gmsh.model.getBoundary(entities, combined=False, oriented=False)) if entities else set()
