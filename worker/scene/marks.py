"""Nodes and faces that belong to sets of mesh files. A case refers to such sets by the key ``on``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from conoid.cases.checks import on
from conoid.cases.model.schema import Case, Symmetry
from conoid.cases.reading.problems import dotted

from ..errors import MeshError
from ..mesh.lookup import known, meant
from ..mesh.model import NodeSet, TetMesh
from ..model.state import Flags, Indices, Ints

Meshes = Mapping[int, tuple[TetMesh, Ints]]
"""Dictionary from part numbers to pairs: a mesh, and the global indices (n,) of its nodes."""


@dataclass
class Marks:
    """Membership of nodes and faces in the sets of mesh files."""

    nodes: Ints
    """(n,) sets that contain each node: bit b is set if the node is in the set with the bit b of ``cases.on.bits``. The
    array is (0,) if the case refers to no set."""
    faces: dict[int, Ints] = field(default_factory=dict)
    """Dictionary from the bit of a surface to (k, 3) the nodes of its faces. The nodes of a face are ascending."""
    surfaces: dict[int, set[int]] = field(default_factory=dict)
    """Dictionary from the bit of a set to the parts in which the set is a surface."""
    warnings: list[str] = field(default_factory=list)
    """Warnings for the user."""

    def holds(self, bit: int) -> Flags:
        """Return (n,) True for each node that is in the set of a bit."""
        return held(self.nodes, bit)

    def chosen(self, bit: int, faces: Indices, part: Indices) -> Flags:
        """Return (m,) True for each of the exposed faces (m, 3) that a set contains. ``part``: (m,) the parts of the
        faces.

        A surface contains its faces. A set of nodes contains the faces with all nodes in the set.
        """
        of_surface = np.isin(part, sorted(self.surfaces.get(bit, ())))
        by_nodes = self.holds(bit)[faces].all(axis=1)
        if bit not in self.faces:
            return np.asarray(by_nodes)
        rows = np.concatenate([self.faces[bit], np.sort(faces, axis=1).astype(np.int64)])
        _, of = np.unique(rows, axis=0, return_inverse=True)
        of, first = of.reshape(-1), len(self.faces[bit])
        listed = np.isin(of[first:], of[:first])
        return np.asarray(np.where(of_surface, listed, by_nodes))


def held(marks: Ints, bit: int) -> Flags:
    """Return (n,) True for each node that has the bit of a set."""
    return np.asarray((marks >> bit & 1).astype(bool))


def marks(case: Case, meshes: Meshes, n: int, boundary: int | None = None) -> Marks:
    """Return the marks of ``n`` nodes. Raises MeshError if a set does not exist or has no node, or if a name is
    ambiguous.

    ``boundary``: if it is given, only the sets of this boundary and of symmetry planes are used.
    """
    bits = on.bits(case)
    made = Marks(np.zeros(n if bits else 0, np.int64))
    numbers = {part.name: index for index, part in enumerate(case.parts)}
    for location, spec in on.ons(case):
        if boundary is not None and location[:2] != ("boundaries", boundary) and not isinstance(spec, Symmetry):
            continue
        candidates = [numbers[part.name] for part in on.parts(case, spec)]
        where = f"{dotted(location)} = {spec.on!r}"
        try:
            found = _found(case, spec.on or "", [i for i in candidates if i in meshes], meshes, bool(on.named(spec)))
        except MeshError as error:
            raise MeshError(f"{where}: {error}") from None
        for index, one in found:
            _mark(made, bits[spec.on or ""], index, one, meshes[index][1])
            if one.inner and hasattr(spec, "pressure"):
                name = case.parts[index].name
                made.warnings.append(f"{where}: {one.inner} of its faces are inside of {name!r} and carry no load")
    return made


def _found(case: Case, name: str, candidates: Sequence[int], meshes: Meshes, each: bool) -> list[tuple[int, NodeSet]]:
    """Return, for each part, the set with the given name. ``each``: True if every part must have the set."""
    if not candidates:
        return []
    found = [(index, meant(meshes[index][0].sets, name)) for index in candidates]
    there = [(index, one) for index, one in found if one is not None]
    lacking = [index for index, one in found if one is None]
    if lacking and (each or not there):
        sets = [one for index in lacking for one in meshes[index][0].sets]
        raise MeshError(f"the mesh of {case.parts[lacking[0]].name!r} has no set of this name; known: {known(sets)}")
    filled = [(index, one) for index, one in there if len(one.nodes)]
    if not filled or (each and len(filled) < len(there)):
        empty = next(index for index, one in there if not len(one.nodes))
        raise MeshError(f"no node of {case.parts[empty].name!r} is in it")
    files = {origin.file for index, _ in filled if (origin := meshes[index][0].origin) is not None}
    if len(files) > 1:
        names = ", ".join(repr(case.parts[index].name) for index, _ in filled)
        raise MeshError(f"sets of several files have this name, in {names}; name the parts that are meant")
    return filled


def _mark(made: Marks, bit: int, index: int, one: NodeSet, places: Ints) -> None:
    made.nodes[places[one.nodes]] |= np.int64(1) << np.int64(bit)
    if one.faces is not None:
        faces = np.sort(places[one.faces], axis=1)
        made.faces[bit] = np.concatenate([made.faces.get(bit, np.zeros((0, 3), np.int64)), faces])
        made.surfaces.setdefault(bit, set()).add(index)
