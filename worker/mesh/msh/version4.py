"""Nodes and elements of the .msh format 4.1. The file has one block for each geometric entity. A physical group is a
property of an entity.
"""

from collections import defaultdict

import numpy as np

from ..model import Floats, Ids
from .blocks import VOLUME, Block, Read, shape_of
from .sections import Numbers, Sections

Groups = dict[tuple[int, int], frozenset[int]]
"""Physical groups of each geometric entity; the key is the dimension and the number of the entity."""


def read_version4(file: Sections) -> Read:
    """Read the file; return all nodes and elements. Raises MeshError."""
    groups: Groups = {}
    partitions: dict[int, frozenset[int]] = {}
    ghosts = frozenset[int]()
    if "Entities" in file.parts:
        groups |= _entities(file.numbers("Entities"))
    if "PartitionedEntities" in file.parts:
        more, partitions, ghosts = _partitioned(file.numbers("PartitionedEntities"))
        groups |= more
    nodes, points = _nodes(file.numbers("Nodes"))
    blocks, filled = _elements(file.numbers("Elements"), groups, ghosts)
    return Read(nodes, points, blocks, tuple(_lacking(partitions, filled)))


def _entities(numbers: Numbers) -> Groups:
    found: Groups = {}
    for dimension, many in enumerate(numbers.sizes(4)):
        for _ in range(many):
            tag = int(numbers.ints(1)[0])
            numbers.floats(3 if dimension == 0 else 6)
            found[dimension, tag] = _listed(numbers)
            if dimension:
                numbers.ints(numbers.count())
    numbers.close()
    return found


def _partitioned(numbers: Numbers) -> tuple[Groups, dict[int, frozenset[int]], frozenset[int]]:
    """Read the section of partitioned entities. Return the groups of each entity, the partitions of each volume, and
    the entities of ghost cells.
    """
    found: Groups = {}
    partitions: dict[int, frozenset[int]] = {}
    numbers.sizes(1)
    ghosts = frozenset(numbers.ints(2 * numbers.count())[::2].tolist())
    for dimension, many in enumerate(numbers.sizes(4)):
        for _ in range(many):
            tag = int(numbers.ints(3)[0])
            of = frozenset(numbers.ints(numbers.count()).tolist())
            numbers.floats(3 if dimension == 0 else 6)
            found[dimension, tag] = _listed(numbers)
            if dimension:
                numbers.ints(numbers.count())
            if dimension == VOLUME:
                partitions[tag] = of
    numbers.close()
    return found, partitions, ghosts


def _listed(numbers: Numbers) -> frozenset[int]:
    """Return the physical groups of an entity. A negative number is the same physical group with reversed
    orientation.
    """
    return frozenset(np.abs(numbers.ints(numbers.count())).tolist())


def _nodes(numbers: Numbers) -> tuple[Ids, Floats]:
    many, total, *_ = numbers.sizes(4)
    tags, points = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for _ in range(many):
        dimension, _, parametric = numbers.ints(3)
        n = numbers.count()
        tags.append(numbers.sizes(n))
        columns = 3 + (int(dimension) if parametric else 0)
        points.append(numbers.floats(columns * n).reshape(n, columns)[:, :3])
    numbers.close()
    if sum(map(len, tags)) != total:
        raise numbers.damaged(f"has other than {total} nodes")
    return np.concatenate(tags), np.concatenate(points)


def _elements(numbers: Numbers, groups: Groups, ghosts: frozenset[int]) -> tuple[list[Block], set[int]]:
    """Return the blocks of elements, and the volumes that have elements.

    Ghost cells are omitted, because they are copies of elements of another file.
    """
    many, total, *_ = numbers.sizes(4)
    found: list[Block] = []
    filled: set[int] = set()
    count = 0
    for _ in range(many):
        dimension, tag, kind = (int(each) for each in numbers.ints(3))
        m, nodes = numbers.count(), shape_of(kind)[1]
        rows = numbers.sizes(m * (1 + nodes)).reshape(m, 1 + nodes)
        count += m
        if dimension == VOLUME and tag in ghosts:
            continue
        found.append(Block(kind, rows[:, 0], rows[:, 1:], groups.get((dimension, tag), frozenset())))
        if dimension == VOLUME and m:
            filled.add(tag)
    numbers.close()
    if count != total:
        raise numbers.damaged(f"has other than {total} elements")
    return found, filled


def _lacking(partitions: dict[int, frozenset[int]], filled: set[int]) -> list[str]:
    """Return a remark if the file has no elements of some partitions."""
    volumes = defaultdict(set)
    for tag, each in partitions.items():
        for partition in each:
            volumes[partition].add(tag)
    lacking = sorted(partition for partition, tags in volumes.items() if not tags & filled)
    if not lacking:
        return []
    listed = ", ".join(map(str, lacking))
    return [f"the file is a part of a mesh: of {len(volumes)} partitions, these are missing: {listed}"]
