"""Unstructured meshes of the primitives by gmsh (OpenCASCADE bodies, HXT Delaunay). The meshes are made in the child
process.

The best of all tested settings is HXT with an optimisation threshold of 0.45, followed by ``smooth``. The Delaunay and
frontal meshers with the Netgen optimiser left worse tets and took two to four times as long. gmsh runs on one thread
with a fixed seed, so equal requests give bit-identical meshes.
"""

import math
from typing import Any

from conoid.cases.model.bodies import Box, Cylinder, Plate, RingSector, Sphere, Tube
from conoid.cases.shapes.geometry import Generated, centre, cut_directions
from conoid.cases.shapes.profile import Revolved

from ..errors import MeshError
from .frame import block, refuse_impossible, to_space
from .gmsh_session import OPTIONS, session, tet_mesh
from .model import REGULAR_STEP, TetMesh
from .occ.body import primitive
from .occ.frame import Frame, scale_of
from .occ.meshing import WANTED
from .occ.sizes import set_size
from .skin import Skin
from .smooth import smoothed


def unstructured(body: Generated, key: str = "mesh") -> TetMesh:
    """Return the gmsh mesh of a body. Raises MeshError, naming ``key``, if gmsh cannot make it."""
    if isinstance(body, Revolved | RingSector):
        return primitive(body, key)
    refuse_impossible(body, key)
    low, high = block(body)
    scale = scale_of(max(b - a for a, b in zip(low, high, strict=True)))
    with session(OPTIONS) as gmsh:
        draw(gmsh, body, scale)
        gmsh.model.occ.synchronize()
        cuts = [(k, 0.0) for k in range(len(cut_directions(body, body.axis)))]
        set_size(gmsh, body.element_size, body.grading, Frame(centre(body), body.axis, scale), cuts)
        gmsh.model.mesh.generate(3)
        mesh = tet_mesh(gmsh)
    if mesh.volumes().sum() < 0:
        mesh = TetMesh(mesh.points, mesh.tets[:, [0, 2, 1, 3]])
    skin, points = Skin.of(body, mesh, scale)
    mesh = smoothed(TetMesh(points, mesh.tets), skin, WANTED * REGULAR_STEP * body.element_size / scale)
    return TetMesh(to_space(body, mesh.points * scale), mesh.tets)


def draw(gmsh: Any, body: Generated, scale: float) -> None:
    """Draw the body in its own frame. Lengths are divided by ``scale``, because the tolerances of gmsh are absolute."""
    if isinstance(body, Plate | Cylinder | Tube | Sphere) and body.aligned and body.sector != "quarter":
        _draw_quarters(gmsh, body, scale)
    elif isinstance(body, Box | Plate):
        low, high = ([v / scale for v in corner] for corner in block(body))
        gmsh.model.occ.addBox(*low, *(b - a for a, b in zip(low, high, strict=True)))
    elif isinstance(body, Sphere):
        _draw_sphere(gmsh.model.occ, body, scale)
    elif isinstance(body, Cylinder | Tube):
        _draw_cylinder(gmsh.model.occ, body, scale)
    else:
        raise MeshError(f"gmsh does not draw {body.shape}; use generator = 'structured'")


def _draw_quarters(gmsh: Any, body: Plate | Cylinder | Tube | Sphere, scale: float) -> None:
    """Draw a quarter of a body and its mirror images, with common faces; they form a half or the whole body.

    gmsh puts nodes on the common faces and on the axis; after the smoothing most of these nodes are still near the
    faces and the axis.
    """
    occ = gmsh.model.occ
    draw(gmsh, body.model_copy(update={"sector": "quarter"}), scale)
    made = occ.getEntities(3)
    for normal in ((0, 1), (1, 0))[: 1 if body.sector == "half" else 2]:
        images = occ.copy(made)
        occ.mirror(images, *normal, 0, 0)
        made = made + images
    occ.fragment(made[:1], made[1:])


def _draw_sphere(occ: Any, body: Sphere, scale: float) -> None:
    """Draw a sphere. The pole of a half sphere is in the middle of the dome, because at a pole on the rim gmsh leaves
    short edges.
    """
    radius, right = body.radius / scale, math.pi / 2
    if body.sector == "half":
        dome = occ.addSphere(0, 0, 0, radius, angle1=0, angle2=right)
        occ.rotate([(3, dome)], 0, 0, 0, 0, 1, 0, right)
    else:
        occ.addSphere(0, 0, 0, radius, angle3=right if body.sector == "quarter" else 4 * right)


def _draw_cylinder(occ: Any, body: Cylinder | Tube, scale: float) -> None:
    angle = {"full": 2 * math.pi, "half": math.pi, "quarter": math.pi / 2}[body.sector]
    made = [(3, occ.addCylinder(0, 0, 0, 0, 0, body.length / scale, body.radius / scale, angle=angle))]
    if isinstance(body, Tube):
        hole = occ.addCylinder(0, 0, 0, 0, 0, body.length / scale, body.inner_radius / scale, angle=angle)
        made, _ = occ.cut(made, [(3, hole)])
    if body.sector == "half":
        occ.rotate(made, 0, 0, 0, 0, 0, 1, -math.pi / 2)
