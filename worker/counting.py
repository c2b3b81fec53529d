"""What tractions and prescribed velocities act on in meshes that have been read, before a run."""

from collections.abc import Iterator, Mapping

import numpy as np

from conoid.cases.loaded import Load
from conoid.cases.schema import Case, Prescribed, Traction

from . import selection
from .mesh.faces import boundary_faces
from .mesh.model import TetMesh
from .setting import turned

Meshes = Mapping[int, TetMesh]
"""Of parts by their numbers, not yet turned."""


def loads(case: Case, meshes: Meshes) -> Iterator[Load]:
    """Of each boundary that is for parts with these meshes and for no others, as the run will count it."""
    for number, spec in enumerate(case.boundaries):
        if isinstance(spec, Traction | Prescribed):
            chosen = np.flatnonzero(selection.named(spec, [part.name for part in case.parts])).tolist()
            if chosen and all(index in meshes for index in chosen):
                yield _load(case, number, {index: meshes[index] for index in chosen})


def _load(case: Case, number: int, meshes: Meshes) -> Load:
    points = [turned(mesh.points, case.parts[index].turn) for index, mesh in meshes.items()]
    tets = [mesh.tets for mesh in meshes.values()]
    starts = np.cumsum([0, *map(len, points)])
    x, t = np.concatenate(points), np.concatenate([each + first for each, first in zip(tets, starts, strict=False)])
    part = np.repeat(np.array(list(meshes), np.int32), np.diff(starts))
    near = selection.nearness(case, x, part, t, part[t[:, 0]])
    found, _ = selection.counted(case, number, x, part, boundary_faces(t), near)
    if isinstance(case.boundaries[number], Traction):
        return Load(number, area=found.area, faces=found.faces, exact=True)
    return Load(number, nodes=found.nodes, exact=True)


def empty(case: Case, found: list[Load]) -> Iterator[str]:
    """A refusal for each that acts on nothing."""
    for load in found:
        if not (load.faces or load.nodes):
            what = "face" if isinstance(case.boundaries[load.boundary], Traction) else "node"
            yield f"boundaries[{load.boundary}]: no {what} of the meshes that it is for lies in its region"
