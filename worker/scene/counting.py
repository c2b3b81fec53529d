"""Counts of the nodes and faces that tractions and prescribed velocities select in meshes from files. The counts are
made in a check before a run.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from conoid.cases.model.joined import bodies
from conoid.cases.model.schema import Case, Prescribed, Symmetry, Traction
from conoid.cases.shapes.load import Load

from ..mesh.faces import FACES, across
from ..mesh.joining import Placed, joined
from ..mesh.model import TetMesh
from . import selection
from .marks import marks
from .setting import turned

Meshes = Mapping[int, TetMesh]
"""Dictionary from part numbers to meshes. The meshes are not yet rotated with their part."""


def loads(case: Case, meshes: Meshes) -> Iterator[Load]:
    """Yield the count of each boundary whose parts all have a mesh in ``meshes``. The run gives the same counts.

    Raises InputError if a bond has no common nodes.
    """
    body = bodies(case)
    for number, spec in enumerate(case.boundaries):
        if isinstance(spec, Traction | Prescribed):
            chosen = np.flatnonzero(selection.meant(case, spec)).tolist()
            if chosen and all(index in meshes for index in chosen):
                with_them = {body[index] for index in chosen}
                yield _load(case, number, {i: mesh for i, mesh in meshes.items() if body[i] in with_them})


def _load(case: Case, number: int, meshes: Meshes) -> Load:
    placed, n = dict[int, Placed](), 0
    for index, mesh in meshes.items():
        placed[index] = n, mesh.origin, turned(mesh.points, case.parts[index].turn)
        n += len(mesh.points)
    stands = joined(case, placed, n)
    x = np.concatenate([points for _, _, points in placed.values()])
    t = stands[np.concatenate([mesh.tets + placed[index][0] for index, mesh in meshes.items()])]
    of = np.repeat(np.array(list(meshes), np.int32), [len(mesh.tets) for mesh in meshes.values()])
    members = np.unique(np.column_stack([t.reshape(-1), np.repeat(of, 4)]), axis=0).T
    near = selection.nearness(case, x, (members[0], members[1]), t, of)
    tet, face = np.nonzero(across(t) < 0)
    nodes = {i: (mesh, stands[placed[i][0] + np.arange(len(mesh.points))]) for i, mesh in meshes.items()}
    marked = marks(case, nodes, len(x), number)
    found, _ = selection.counted(
        case, number, x, (members[0], members[1]), (t[tet[:, None], FACES[face]], of[tet]), near, marked
    )
    if isinstance(case.boundaries[number], Traction):
        return Load(number, area=found.area, faces=found.faces, exact=True)
    return Load(number, nodes=found.nodes, exact=True)


def empty(case: Case, found: list[Load]) -> Iterator[str]:
    """Yield an error message for each boundary that selects no node or face."""
    planes = case.boundaries_of(Symmetry)
    for load in found:
        if not (load.faces or load.nodes):
            what = "face" if isinstance(case.boundaries[load.boundary], Traction) else "node"
            cut = "; faces on a plane of symmetry carry no load" if what == "face" and planes else ""
            yield f"boundaries[{load.boundary}]: no {what} of its meshes lies in its region{cut}"
