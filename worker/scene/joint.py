"""Parts of one body that gmsh meshes together, so that their meshes have common nodes."""

from collections.abc import Callable
from pathlib import Path

from conoid.cases.model.bodies import Mesh, Primitive, Symmetric
from conoid.cases.model.joined import bodies
from conoid.cases.model.schema import Case, Part
from conoid.cases.model.solids import Meshed

from ..mesh.build import build_together
from ..mesh.model import TetMesh


def asked(part: Part) -> Mesh:
    """Return the mesh that the case requests for a part. The default of ``aligned`` depends on the erosion of the
    part.
    """
    mesh = part.mesh
    if isinstance(mesh, Symmetric) and mesh.aligned is None:
        return mesh.model_copy(update={"aligned": part.erosion is not None})
    return mesh


def grouped(case: Case, index: int) -> list[int]:
    """Return the parts that gmsh meshes together with part ``index``: all parts of its body that gmsh meshes."""
    body = bodies(case)
    made = [isinstance(part.mesh, Primitive | Meshed) and part.mesh.generator == "gmsh" for part in case.parts]
    return [i for i, of in enumerate(body) if of == body[index] and made[i]] if made[index] else []


def built_together(
    case: Case, group: list[int], folder: Path, before: Callable[[], None] = lambda: None
) -> dict[int, TetMesh]:
    """Return a dictionary from part numbers to meshes, for the parts of a ``group``. ``before`` is called before the
    meshes are made."""
    meshes = {f"parts[{i}].mesh": asked(case.parts[i]) for i in group}
    return dict(zip(group, build_together(meshes, folder, made=before), strict=True))
