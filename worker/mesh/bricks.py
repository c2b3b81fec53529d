"""Cuts of hexahedra, wedges and pyramids of a mesh file into tets, and notes to the user about these cuts."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import MeshError
from . import second_order
from .cells import Cells, Form, sides
from .cutting import Cut, cut, pattern
from .folding import folded
from .model import Floats, Ids
from .patterns import QUADS, skin

_SEEN = 1e-6
"""Change of the volume as a fraction of the volume. For a smaller change no note is given. Chosen value: the round-off
of coordinates with six digits."""


@dataclass(frozen=True, eq=False)
class Bricks:
    """Elements that are not yet cut into tets. Hexahedra, wedges and pyramids are in one list."""

    nodes: Ids
    """(m, 8) indices of the corners; each element is written as a hexahedron with repeated corners."""
    numbers: Ids
    lines: Ids
    forms: list[Form]
    """Form of each kind of element, in the order of the kinds."""
    counts: list[int]

    def called(self, k: int) -> str:
        """Return the name of an element: ``wedge 7 (line 12)``."""
        form = self.forms[int(np.searchsorted(np.cumsum(self.counts), k, side="right"))]
        return f"{form.word} {self.numbers[k]}" + (f" (line {self.lines[k]})" if self.lines[k] else "")


def bricks(cells: list[Cells]) -> Bricks:
    """Return the elements of ``cells`` that are not tets. Raises MeshError for coincident nodes that no form allows."""
    found = [each for each in cells if each.kind.form is not Form.TET]
    rows = [folded(each.corners[:, each.kind.form.inside]) for each in found]
    for each, (_, good) in zip(found, rows, strict=True):
        if not good.all():
            k = int(np.flatnonzero(~good)[0])
            raise MeshError(f"{each.called(k)} repeats nodes in a way that leaves no wedge, pyramid or tet")
    none = np.zeros(0, np.int64)
    return Bricks(
        np.concatenate([np.zeros((0, 8), np.int64), *(nodes for nodes, _ in rows)]),
        np.concatenate([none, *(each.numbers for each in found)]),
        np.concatenate([none, *(each.lines for each in found)]),
        [each.kind.form for each in found],
        [len(each.numbers) for each in found],
    )  # fmt: skip


def cut_up(some: Bricks, triangles: Ids, points: Floats) -> Cut:
    """Cut the elements into tets and return the tets. The ``triangles`` (k, 3) of neighbouring elements become faces of
    the tets.

    Raises MeshError for an element that is inverted, flat or too distorted.
    """
    diagonals = _fitting(some.nodes, triangles)
    made = cut(some.nodes, points, diagonals)
    if len(made.flat):
        k = int(made.flat[0])
        raise MeshError(
            f"{some.called(k)} {_what(some.nodes[k], points, int(diagonals[k]))} ({len(made.flat):,} of "
            f"{len(some.numbers):,} elements)"
        )
    return made


def _what(nodes: Ids, points: Floats, diagonals: int) -> str:
    """Return the reason why an element cannot be cut."""
    at = points[nodes]
    volume = sum(float((np.cross(at[a] - at[0], at[b] - at[0]) * (at[c] - at[0])).sum()) for a, b, c in skin(diagonals))
    size = float(np.ptp(at, axis=0).max()) ** 3
    if abs(volume) <= _SEEN * size:
        return "is flat"
    return "is inverted" if volume < 0 else "is so distorted that tets between its faces would be inverted"


def _fitting(nodes: Ids, triangles: Ids) -> Ids:
    """Return (m,) the diagonals of the faces of each element. A diagonal is determined by node numbers, or by triangles
    of neighbouring elements.
    """
    diagonals = pattern(nodes)
    if not len(triangles):
        return diagonals
    for bit, quad in enumerate(QUADS):
        corners = nodes[:, quad]
        second = (diagonals >> bit & 1).astype(bool)[:, None, None]
        ways = corners[:, [[0, 1, 2], [0, 2, 3]]], corners[:, [[1, 2, 3], [1, 3, 0]]]
        own, other = np.where(second, ways[1], ways[0]), np.where(second, ways[0], ways[1])
        flip = _known(other, triangles).any(axis=1) & ~_known(own, triangles).any(axis=1)
        diagonals = diagonals ^ flip.astype(np.int64) << bit
    return diagonals


def _known(faces: Ids, triangles: Ids) -> "np.ndarray":
    """Return (m, k) True for each of the faces (m, k, 3) that is among the triangles, in any rotation of the
    corners.
    """
    both = np.sort(np.concatenate([triangles, faces.reshape(-1, 3)]), axis=1)
    _, of = np.unique(both, axis=0, return_inverse=True)
    of = of.reshape(-1)
    seen = np.zeros(int(of.max(initial=0)) + 1, bool)
    seen[of[: len(triangles)]] = True
    return np.asarray(seen[of[len(triangles) :]].reshape(faces.shape[:2]))


def triangles_of(cells: list[Cells]) -> Ids:
    """Return (k, 3) the triangular faces of the elements. If no element has a face with four corners, return no
    face.
    """
    if not any(len(side) == 4 for each in cells for side in sides(each.kind.form)):
        return np.zeros((0, 3), np.int64)
    faces = [each.corners[:, side] for each in cells for side in sides(each.kind.form) if len(side) == 3]
    return np.concatenate([np.zeros((0, 3), np.int64), *faces])


# Notes ----------------------------------------------------------------------------------------------------------------


def notes_of_cut(some: Bricks, made: Cut, points: Floats, volume: float) -> Iterator[str]:
    """Return two kinds of notes: the number of tets into which the elements were cut, and the effect of warped faces on
    the ``volume``.
    """
    if not len(some.numbers):
        return
    counts = Counter[Form]()
    for form, many in zip(some.forms, some.counts, strict=True):
        counts[form] += many
    listed = " and ".join(f"{many:,} {form.several}" for form, many in counts.items() if many)
    middle = f", {len(made.of):,} of them around an added node in the middle of an element" if len(made.of) else ""
    yield f"{listed} are cut into {len(made.tets):,} tets of 4 nodes with matching faces{middle}"
    share = _warped(some.nodes, points) / volume if volume else 0.0
    if abs(share) > _SEEN:
        how = "less" if share > 0 else "more"
        yield f"each face that is not flat becomes two triangles, with {100 * abs(share):.2g} % {how} volume"


def _warped(nodes: Ids, points: Floats) -> float:
    """Return the volume between bilinear faces and the two triangles into which each face is cut.

    The volume of a face is a twelfth of the triple product of three edges, with the sign of the diagonal, because the
    bilinear face has the mean volume of its two cuts.
    """
    diagonals, total = pattern(nodes), 0.0
    for bit, quad in enumerate(QUADS):
        a, b, c, d = (points[nodes[:, k]] for k in quad)
        product = ((b - a) * np.cross(c - a, d - a)).sum(axis=1) / 12.0
        total += float(np.where(diagonals >> bit & 1, -product, product).sum())
    return total


def notes_of_middles(cells: list[Cells], points: Floats, tags: Ids) -> Iterator[str]:
    """Return notes about hexahedra, wedges and pyramids of second order. Also return the volume that is lost because
    only the corners of these elements are used.

    Raises MeshError if a node is not near the middle of its edge.
    """
    for each in cells:
        if each.kind.form is Form.TET or not each.kind.edges or not len(each.numbers):
            continue
        second_order.checked(each, points, tags)
        share = second_order.lost(each, points) / max(abs(_volume(each, points)), np.finfo(np.float64).tiny)
        loss = (
            f"{100 * abs(share):.2g} % {'less' if share > 0 else 'more'} volume"
            if abs(share) > _SEEN
            else "the same volume"
        )
        many = f"{len(each.numbers):,} {each.kind.form.several} of {each.kind.nodes} nodes"
        yield f"{many} are read with their corners only, with {loss}"


def _volume(cells: Cells, points: Floats) -> float:
    """Return the approximate volume of the elements, as if their edges were straight."""
    total, start = 0.0, points[cells.corners[:, 0]]
    for side in sides(cells.kind.form):
        a, b, c, d = (points[cells.corners[:, k]] - start for k in [*side, side[0]][:4])
        total += float((a * np.cross(b, c)).sum() + (a * np.cross(c, d)).sum()) / 6.0
    return total
