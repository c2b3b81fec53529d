"""Selection of elements from a .msh file: all volume elements, or the volume elements of a physical group."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import MeshError
from ..cells import Cells, cells
from ..model import Ids
from ..named import placed, refuse_repeated
from ..solid import Content
from .blocks import KINDS, VOLUME, Block, Read
from .sections import Sections, read_sections
from .sets import named_sets
from .version2 import read_version2
from .version4 import read_version4

_NAME = re.compile(r'\s*([0-3])\s+(-?\d+)\s+"(.*)"\s*')
_KINDS = ("points", "curves", "surfaces", "volumes")
_LISTED = {
    "Comments", "Elements", "ElementData", "ElementNodeData", "Entities", "GhostElements", "InterpolationScheme",
    "MeshFormat", "NodeData", "Nodes", "ParametricNodes", "Parametrizations", "PartitionedEntities", "Periodic",
    "PhysicalNames",
}  # fmt: skip
"""Sections that the format defines. The reader skips those without mesh data."""


def read_msh(path: Path, group: str | None, key: str) -> Content:
    """Return all volume elements of a .msh file, or the volume elements of a physical group. The physical groups of
    points, curves and surfaces are returned as sets.

    ``group`` is the name of the physical group, or its number. Physical groups with equal names are united. Raises
    MeshError.
    """
    file = read_sections(path)
    found = read_version2(file) if file.version == "2.2" else read_version4(file)
    names = _names(file)
    volumes = [block for block in found.blocks if block.dimension == VOLUME]
    wanted = None if group is None else _wanted(names, volumes, group, key)
    chosen = [block for block in volumes if wanted is None or block.groups & wanted]
    _refuse_others(chosen)
    order = np.argsort(found.nodes, kind="stable")
    tags = found.nodes[order]
    refuse_repeated("node", tags)
    every = [_cells(block, tags) for block in (_once(chosen) if file.version == "2.2" else chosen)]
    refuse_repeated("element", np.concatenate([np.zeros(0, np.int64), *(each.numbers for each in every)]))
    notes = tuple(_notes(file, found, wanted, group))
    return Content(tags, found.points[order], every, list(named_sets(found.blocks, names, tags)), notes)


def _cells(block: Block, tags: Ids) -> Cells:
    kind = KINDS[block.kind]
    return cells(kind, block.numbers, placed(tags, block.nodes, lambda k: f"{kind.form.word} {block.numbers[k]}"))


def _names(file: Sections) -> dict[tuple[int, int], str]:
    """Return the names of the physical groups. A key of the result consists of the dimension and the number of the
    group.
    """
    count, *lines = file.parts.get("PhysicalNames", b"0").decode("utf-8", "replace").strip().splitlines()
    read = [_NAME.fullmatch(line) for line in lines]
    found = {(int(line[1]), int(line[2])): line[3] for line in read if line is not None}
    if count.strip() != str(len(lines)) or len(found) != len(lines):
        raise MeshError("the file is damaged: the count of the section $PhysicalNames is wrong")
    return found


def _wanted(names: dict[tuple[int, int], str], volumes: list[Block], group: str, key: str) -> frozenset[int]:
    """Return the numbers of the physical groups with the name ``group``. Raises MeshError if there is no such group."""
    used = frozenset[int]().union(*(block.groups for block in volumes))
    here = {tag: name for (dimension, tag), name in names.items() if dimension == VOLUME}
    by_name = frozenset(tag for tag, name in here.items() if name == group)
    by_number = frozenset(tag for tag in used | here.keys() if str(tag) == group)
    if by_name and by_number - by_name:
        raise MeshError(f"{key}.group = {group!r}: the name of one group and the number of another group; rename it")
    if found := by_name or by_number:
        return found
    known = [here.get(tag) or str(tag) for tag in sorted(used | here.keys())]
    other = next((_KINDS[dimension] for (dimension, _), name in names.items() if name == group), None)
    but = f" ({group!r} is a group of {other})" if other else ""
    listed = ", ".join(dict.fromkeys(known)) or "none"
    raise MeshError(f"{key}.group = {group!r}: no such group of volumes{but}; known: {listed}")


def _refuse_others(chosen: list[Block]) -> None:
    for block in chosen:
        if block.kind not in KINDS and len(block.numbers):
            raise MeshError(
                f"{len(block.numbers)} elements of the {block.name} (the first is {block.numbers[0]}); elements with a "
                "volume can be tets, hexahedra, prisms and pyramids of first and second order"
            )


def _once(chosen: list[Block]) -> list[Block]:
    """Remove repeated elements from the blocks. In the format 2.2 an element is written once for each of its groups."""
    found = []
    for kind in dict.fromkeys(block.kind for block in chosen):
        alike = [block for block in chosen if block.kind == kind]
        numbers, nodes = (np.concatenate([getattr(each, what) for each in alike]) for what in ("numbers", "nodes"))
        group = np.concatenate([np.full(len(each.numbers), min(each.groups, default=0)) for each in alike])
        both = np.column_stack([nodes, group])
        kept = np.arange(len(both))
        if len(np.unique(both, axis=0)) == len(both):
            kept = np.sort(np.unique(nodes, axis=0, return_index=True)[1])
        found.append(Block(kind, numbers[kept], nodes[kept], frozenset()))
    return found


def _notes(file: Sections, content: Read, wanted: frozenset[int] | None, group: str | None) -> Iterator[str]:
    """Return remarks for the user: contents of the file that are not in the mesh, and groups that are united."""
    yield from content.notes
    if wanted is not None and len(wanted) > 1:
        yield f"several groups have the name {group!r} and are united: {', '.join(map(str, sorted(wanted)))}"
    left = {
        block.name: sum(len(b.numbers) for b in content.blocks if b.kind == block.kind)
        for block in content.blocks
        if block.dimension == VOLUME and block.kind not in KINDS
    }
    if left:
        listed = ", ".join(f"{n} of the {name}" for name, n in sorted(left.items()))
        yield f"elements that cannot be read are outside of the group: {listed}"
    if strange := sorted(set(file.parts) - _LISTED):
        yield f"unknown sections are ignored: {', '.join(f'${name}' for name in strange)}"
