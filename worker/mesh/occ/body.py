"""Cones, ogives, caps and ring sectors, drawn with OpenCASCADE."""

import math
from typing import Any

from conoid.cases.model.bodies import RingSector
from conoid.cases.shapes import ring
from conoid.cases.shapes.geometry import bounds, cut_directions
from conoid.cases.shapes.profile import Revolved

from ..frame import refuse_impossible
from ..gmsh_session import OPTIONS, session
from ..model import TetMesh
from .draw import ROUND, Angles, Solids, drawn
from .frame import Frame, scale_of
from .meshing import meshed
from .sizes import set_size

_SECTORS: dict[str, Angles] = {"full": ROUND, "half": (-0.5 * math.pi, 0.5 * math.pi), "quarter": (0.0, 0.5 * math.pi)}


def primitive(body: Revolved | RingSector, key: str) -> TetMesh:
    """Return the mesh of a body. Raises MeshError, whose message contains ``key``, if gmsh cannot make the mesh."""
    refuse_impossible(body, key)
    low, high = bounds(body) or ((0.0,) * 3, (0.0,) * 3)
    frame = Frame(body.base, body.axis, scale_of(max(b - a for a, b in zip(low, high, strict=True))))
    with session(OPTIONS) as gmsh:
        draw(gmsh.model.occ, body, frame)
        gmsh.model.occ.synchronize()
        cuts = [(k, 0.0) for k in range(len(cut_directions(body, body.axis)))]
        set_size(gmsh, body.element_size, body.grading, frame, cuts)
        return meshed(gmsh, frame, body.element_size, cuts)


def draw(occ: Any, body: Revolved | RingSector, frame: Frame) -> Solids:
    """Draw the sector of a body in the ``frame`` of the model."""
    return drawn(occ, body, frame, ring.angles(body) if isinstance(body, RingSector) else [_SECTORS[body.sector]])
