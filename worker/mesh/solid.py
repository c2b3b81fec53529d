"""Conversion of the elements of a file into a mesh of tets, for all file formats."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import MeshError
from . import bricks, second_order
from .cells import TET10, Cells, Form
from .model import Floats, Ids, Ints, Names, TetMesh, volume_and_area
from .named import NamedMesh
from .second_order import Way
from .sets import Named, members

_SEEN = 1e-6
"""Change of the volume as a fraction of the volume. For a smaller change no note is given. Chosen value: the round-off
of coordinates with six digits."""


@dataclass(frozen=True, eq=False)
class Content:
    """Data that a reader gets from a file, in the unit of the file."""

    tags: Ids
    """(n,) numbers of the nodes in the file, for messages."""
    points: Floats
    """(n, 3) positions of the nodes."""
    cells: list[Cells]
    """Volume elements; their nodes are indices into ``points``. Faces are cut according to the order of the indices."""
    named: list[Named] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    included: tuple[Path, ...] = ()
    """Further files that were read for the mesh."""
    length: str = ""
    """Unit of length that the file gives; empty if the file gives no unit."""


@dataclass(frozen=True, eq=False)
class _Tets:
    """Tets, and the elements from which these tets were made."""

    nodes: Ids
    numbers: Ids
    lines: Ids
    middles: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    """(j, 3) positions of the nodes that were added in the middle of elements. The indices of the added nodes follow
    the indices of the nodes of the file."""
    of: Ids = field(default_factory=lambda: np.zeros(0, np.int64))
    """(j,) element of each added node."""


def solid(content: Content, way: Way | None = None) -> NamedMesh:
    """Return the mesh of all elements: positive tets with matching faces. The mesh is not yet checked.

    ``way``: treatment of a tet of ten nodes: it is cut into ``eight`` tets, or it becomes one tet of its ``corners``.
    Raises MeshError for an element that is inverted, flat or too distorted.
    """
    tets = [each for each in content.cells if each.kind.form is Form.TET]
    chosen, remarks = _ordered(content, tets, way)
    some = bricks.bricks(content.cells)
    cut = bricks.cut_up(some, bricks.triangles_of(content.cells), content.points)
    made = [
        *(_tets(each, content.points, content.tags, chosen) for each in tets),
        _Tets(cut.tets, some.numbers[cut.owner], some.lines[cut.owner], cut.middles, some.numbers[cut.of]),
    ]
    edges = _edges(tets) if chosen == "eight" else np.zeros((0, 3), np.int64)
    remarks += bricks.notes_of_middles(content.cells, content.points, content.tags)
    volume = float(volume_and_area(np.concatenate([content.points, cut.middles]), cut.tets)[0].sum())
    remarks += bricks.notes_of_cut(some, cut, content.points, volume)
    return _gathered(content, made, edges, (*content.notes, *remarks))


def _gathered(content: Content, made: list[_Tets], edges: Ids, notes: tuple[str, ...]) -> NamedMesh:
    nodes, numbers, lines, middles, of = (
        np.concatenate([getattr(each, name) for each in made])
        for name in ("nodes", "numbers", "lines", "middles", "of")
    )
    used, inverse = np.unique(nodes, return_inverse=True)
    tets: Ints = inverse.reshape(-1, 4).astype(np.int32)
    points, tags = np.concatenate([content.points, middles]), np.concatenate([content.tags, -of])
    places = np.where(used < len(content.points), used, -1 - used)
    sets = members(content.named, used, tets, edges)
    mesh = TetMesh(points[used], tets, sets=sets)
    return NamedMesh(mesh, Names(tags[used], numbers, lines), places, notes)


# Tets -----------------------------------------------------------------------------------------------------------------


def _ordered(content: Content, tets: list[Cells], way: Way | None) -> tuple[Way, list[str]]:
    """Return the tets that are made from tets of ten nodes, and notes for the user about the cut."""
    curved = [each for each in tets if each.kind.edges and len(each.numbers)]
    if not curved:
        return "corners", []
    others = sum(len(each.numbers) for each in content.cells if not (each.kind.edges and each.kind.form is Form.TET))
    for each in curved:
        second_order.checked(each, content.points, content.tags)
    if others and way == "eight":
        raise MeshError(
            f"second_order = 'eight': {others} elements have no nodes in the middle of their edges, or are no tets; "
            "their faces would not match; allowed: 'corners'"
        )
    straight = sum(float(volume_and_area(content.points, each.corners)[0].sum()) for each in curved)
    more = sum(second_order.lost(each, content.points) for each in curved)
    share = more / (straight + more) if straight + more > 0 else 0.0
    chosen: Way = way or ("eight" if abs(share) > second_order.LOST and not others else "corners")
    return chosen, [_note(sum(len(each.numbers) for each in curved), share, chosen, way is None and not others)]


def _note(many: int, share: float, chosen: Way, free: bool) -> str:
    loss = f"{100 * abs(share):.2g} % {'less' if share >= 0 else 'more'} volume than the curved elements"
    if chosen == "eight":
        what = f"eight tets of 4 nodes each; their corners alone would have {loss}"
        other = "; second_order = 'corners' takes an eighth of the tets and about half of the steps"
    else:
        what = f"the tets of their 4 corners, with {loss if abs(share) > _SEEN else 'the same volume'}"
        other = "; second_order = 'eight' keeps all nodes, with 8 times the tets and about twice the steps"
    return f"{many} tets of 10 nodes are taken as {what}{other if free else ''}"


def _tets(cells: Cells, points: Floats, tags: Ids, way: Way) -> _Tets:
    if not cells.kind.edges or way == "corners":
        return _Tets(cells.corners, cells.numbers, cells.lines)
    second_order.refuse_halves(cells, tags)
    nodes = second_order.eight(np.column_stack([cells.corners, _sorted(cells)]), points)
    return _Tets(nodes.reshape(-1, 4), np.repeat(cells.numbers, 8), np.repeat(cells.lines, 8))


def _sorted(cells: Cells) -> Ids:
    """Return (m, 6) the midside nodes, in the order of ``TET10``."""
    places = {frozenset(edge): k for k, edge in enumerate(cells.kind.edges)}
    return cells.middles[:, [places[frozenset(edge)] for edge in TET10.edges]]


def _edges(tets: list[Cells]) -> Ids:
    """Return (k, 3) the two corners of each edge, ascending, and its midside node."""
    rows = [
        np.column_stack([np.sort(each.corners[:, edge], axis=1), middle])
        for each in tets
        for edge, middle in zip(each.kind.edges, each.middles.T, strict=True)
    ]
    return np.unique(np.concatenate(rows), axis=0)
