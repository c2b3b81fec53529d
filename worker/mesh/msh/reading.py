"""The mesh that a case takes from a .msh file: all of its tets, or those of a physical group."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import MeshError
from ..model import Ids
from ..named import NamedMesh, gathered
from .blocks import TET, VOLUME, Block, Content
from .sections import Sections, read_sections
from .version2 import read_version2
from .version4 import read_version4

_NAME = re.compile(r'\s*([0-3])\s+(-?\d+)\s+"(.*)"\s*')
_KINDS = ("points", "curves", "surfaces", "volumes")
_LISTED = {
    "Comments", "Elements", "ElementData", "ElementNodeData", "Entities", "GhostElements", "InterpolationScheme",
    "MeshFormat", "NodeData", "Nodes", "ParametricNodes", "Parametrizations", "PartitionedEntities", "Periodic",
    "PhysicalNames",
}  # fmt: skip
"""Sections of the format; those that hold no part of the mesh are passed over."""


def read_msh(path: Path, group: str | None, key: str) -> NamedMesh:
    """The tets of a .msh file, all or those of a physical group of volumes, in the unit of the file.

    ``group`` is the name of the physical group, or its number. Groups that have the same name are taken together. Node
    and tet names are the numbers in the file. Raises MeshError.
    """
    file = read_sections(path)
    content = read_version2(file) if file.version == "2.2" else read_version4(file)
    names = _names(file)
    volumes = [block for block in content.blocks if block.dimension == VOLUME]
    wanted = None if group is None else _wanted(names, volumes, group, key)
    chosen = [block for block in volumes if wanted is None or block.groups & wanted]
    _refuse_others(chosen)
    numbers, corners = _tets(chosen)
    if file.version == "2.2":
        numbers, corners = _once(chosen, numbers, corners)
    _refuse_repeated("node", content.nodes)
    _refuse_repeated("element", numbers)
    found = gathered(content.nodes, content.points, numbers, corners)
    return NamedMesh(found.mesh, found.names, found.places, tuple(_notes(file, content, wanted, group)))


def _names(file: Sections) -> dict[tuple[int, int], str]:
    """Names of physical groups by dimension and number."""
    count, *lines = file.parts.get("PhysicalNames", b"0").decode("utf-8", "replace").strip().splitlines()
    read = [_NAME.fullmatch(line) for line in lines]
    found = {(int(line[1]), int(line[2])): line[3] for line in read if line is not None}
    if count.strip() != str(len(lines)) or len(found) != len(lines):
        raise MeshError("the file is damaged: the section $PhysicalNames does not hold what it says")
    return found


def _wanted(names: dict[tuple[int, int], str], volumes: list[Block], group: str, key: str) -> frozenset[int]:
    """The numbers of the physical groups that ``group`` means. Raises MeshError."""
    used = frozenset[int]().union(*(block.groups for block in volumes))
    here = {tag: name for (dimension, tag), name in names.items() if dimension == VOLUME}
    by_name = frozenset(tag for tag, name in here.items() if name == group)
    by_number = frozenset(tag for tag in used | here.keys() if str(tag) == group)
    if by_name and by_number - by_name:
        raise MeshError(f"{key}.group = {group!r}: the name of one group and the number of another one; rename it")
    if found := by_name or by_number:
        return found
    known = [here.get(tag) or str(tag) for tag in sorted(used | here.keys())]
    other = next((_KINDS[dimension] for (dimension, _), name in names.items() if name == group), None)
    but = f" ({group!r} is a group of {other})" if other else ""
    listed = ", ".join(dict.fromkeys(known)) or "none"
    raise MeshError(f"{key}.group = {group!r}: no such group of volumes{but}; known: {listed}")


def _refuse_others(chosen: list[Block]) -> None:
    for block in chosen:
        if block.kind != TET and len(block.numbers):
            raise MeshError(
                f"{len(block.numbers)} elements of the {_called(block)} (the first is {block.numbers[0]}); only 4-node "
                "tets can be used"
            )


def _called(block: Block) -> str:
    return block.name if block.name.startswith("type") else f"type {block.name}"


def _tets(chosen: list[Block]) -> tuple[Ids, Ids]:
    """Numbers and nodes of the tets."""
    numbers = np.concatenate([np.zeros(0, np.int64), *(block.numbers for block in chosen)])
    corners = np.concatenate([np.zeros((0, 4), np.int64), *(block.nodes for block in chosen)])
    return numbers, corners


def _once(chosen: list[Block], numbers: Ids, corners: Ids) -> tuple[Ids, Ids]:
    """The same, each tet once: in the format 2.2 one that is in several groups stands there for each of them."""
    group = np.concatenate(
        [np.zeros(0, np.int64), *(np.full(len(b.numbers), min(b.groups, default=0)) for b in chosen)]
    )
    both = np.column_stack([corners, group])
    if len(np.unique(both, axis=0)) < len(both):
        return numbers, corners
    first = np.sort(np.unique(corners, axis=0, return_index=True)[1])
    return numbers[first], corners[first]


def _refuse_repeated(what: str, numbers: Ids) -> None:
    found, times = np.unique(numbers, return_counts=True)
    if len(found) < len(numbers):
        raise MeshError(f"{what} {found[times > 1][0]} is defined twice")


def _notes(file: Sections, content: Content, wanted: frozenset[int] | None, group: str | None) -> Iterator[str]:
    """What of the file is not in the mesh, or is taken together, in a line each."""
    yield from content.notes
    if wanted is not None and len(wanted) > 1:
        yield f"the name {group!r} is that of the groups {', '.join(map(str, sorted(wanted)))}; they are taken together"
    left = {
        block.name: sum(len(b.numbers) for b in content.blocks if b.kind == block.kind)
        for block in content.blocks
        if block.dimension == VOLUME and block.kind != TET
    }
    if left:
        listed = ", ".join(f"{n} of the type {name}" for name, n in sorted(left.items()))
        yield f"elements that are no 4-node tets are outside of the group: {listed}"
    if strange := sorted(set(file.parts) - _LISTED):
        yield f"sections that are not known are passed over: {', '.join(f'${name}' for name in strange)}"
