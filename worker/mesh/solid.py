"""From the elements of a file to a mesh of tets: one for all formats."""

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
"""Of the volume: less is not told. Chosen: what rounding of coordinates to six digits makes."""


@dataclass(frozen=True, eq=False)
class Content:
    """What a reader takes of a file, in its unit."""

    tags: Ids
    """(n,) what the file calls its nodes, for messages."""
    points: Floats
    """(n, 3)."""
    cells: list[Cells]
    """Elements with a volume, by places in these arrays; the order of places decides how faces are cut."""
    named: list[Named] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    included: tuple[Path, ...] = ()
    """Other files that were read for it."""


@dataclass(frozen=True, eq=False)
class _Tets:
    """Tets, each of an element."""

    nodes: Ids
    numbers: Ids
    lines: Ids
    middles: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    """(j, 3) nodes behind those of the file."""
    of: Ids = field(default_factory=lambda: np.zeros(0, np.int64))
    """(j,) the element in whose middle each is."""


def solid(content: Content, way: Way | None = None) -> NamedMesh:
    """The mesh of all elements, positive tets that meet face to face, not yet checked. ``way``: of tets of ten nodes.

    Raises MeshError for an element that is inverted, flat or too distorted.
    """
    tets = [each for each in content.cells if each.kind.form is Form.TET]
    chosen, told = _ordered(content, tets, way)
    some = bricks.bricks(content.cells)
    cut = bricks.cut_up(some, bricks.triangles_of(content.cells), content.points)
    made = [
        *(_tets(each, content.points, content.tags, chosen) for each in tets),
        _Tets(cut.tets, some.numbers[cut.owner], some.lines[cut.owner], cut.middles, some.numbers[cut.of]),
    ]
    edges = _edges(tets) if chosen == "eight" else np.zeros((0, 3), np.int64)
    told += bricks.told_of_middles(content.cells, content.points, content.tags)
    volume = float(volume_and_area(np.concatenate([content.points, cut.middles]), cut.tets)[0].sum())
    told += bricks.told(some, cut, content.points, volume)
    return _gathered(content, made, edges, (*content.notes, *told))


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
    """What becomes of tets of ten nodes, and what the user should know of it."""
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
    return chosen, [_told(sum(len(each.numbers) for each in curved), share, chosen, way is None and not others)]


def _told(many: int, share: float, chosen: Way, free: bool) -> str:
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
    """(m, 6) the nodes in the middle of edges in the order of ``TET10``."""
    places = {frozenset(edge): k for k, edge in enumerate(cells.kind.edges)}
    return cells.middles[:, [places[frozenset(edge)] for edge in TET10.edges]]


def _edges(tets: list[Cells]) -> Ids:
    """(k, 3) two corners, ascending, and the node between them."""
    rows = [
        np.column_stack([np.sort(each.corners[:, edge], axis=1), middle])
        for each in tets
        for edge, middle in zip(each.kind.edges, each.middles.T, strict=True)
    ]
    return np.unique(np.concatenate(rows), axis=0)
