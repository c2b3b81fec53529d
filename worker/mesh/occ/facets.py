"""Closed surfaces of triangles as solids of OpenCASCADE, for combinations of bodies. Each triangle is a plane face of
the solid.
"""

from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases.model.operands import StlForm

from ...errors import MeshError
from .draw import Solids
from .frame import Frame
from .shells import Surface, nested
from .stl import read_stl

_MOST = 1500
"""Largest number of facets. Chosen value: OpenCASCADE takes 10 s to intersect a ball of 1,500 facets with a box, and
the time is proportional to the square of the number of facets."""


def faceted(gmsh: Any, form: StlForm, path: Path, frame: Frame, head: str) -> Solids:
    """Return the solids inside of the closed surface in a file, in the frame of the model. Raises MeshError with a
    message that begins with ``head``.
    """
    surface = read_stl(path, head)
    if len(surface.faces) > _MOST:
        raise MeshError(
            f"{head}: {len(surface.faces):,} facets are too many for a combination; allowed: up to {_MOST:,}; save the "
            "body as a STEP file, or with fewer facets"
        )
    occ = gmsh.model.occ
    points = [occ.addPoint(*frame.place(tuple(point))) for point in (surface.points * form.unit).tolist()]
    shells = _shells(occ, surface, points)
    made = [(3, occ.addVolume([shells[shell] for shell in within])) for within in nested(surface)]
    occ.synchronize()
    return made


def extent_of(form: StlForm, path: Path, head: str) -> float:
    """Return the largest extent of the surface in a file, m."""
    return float(np.ptp(read_stl(path, head).points, axis=0).max()) * form.unit


def _shells(occ: Any, surface: Surface, points: list[int]) -> dict[int, int]:
    """Return the surface loop of each closed surface."""
    lines, faces = dict[tuple[int, int], int](), dict[int, list[int]]()
    for corners in surface.faces.tolist():
        loop = []
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            ends = min(a, b), max(a, b)
            if ends not in lines:
                lines[ends] = occ.addLine(points[ends[0]], points[ends[1]])
            loop.append(lines[ends] if a < b else -lines[ends])
        face = occ.addPlaneSurface([occ.addCurveLoop(loop)])
        faces.setdefault(int(surface.shell[corners[0]]), []).append(face)
    return {shell: occ.addSurfaceLoop(some) for shell, some in faces.items()}
