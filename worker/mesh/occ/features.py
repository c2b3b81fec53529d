"""Short edges and small radii of a model. Edges and radii that are smaller than the elements lead to tets of the same
small size."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from conoid.cases.figures import si

from .draw import Solids
from .frame import Frame

_SHORT = 0.5
"""Length of an edge, divided by the element size. Shorter edges are reported. Chosen value: a tet at an edge of this
length has half the time step."""


def small_features(gmsh: Any, element_size: float, frame: Frame, solids: Solids) -> Iterator[str]:
    """Yield notes about short edges of ``solids`` and about fillets with a radius that is too small for the
    elements.
    """
    least = _SHORT * frame.length(element_size)
    faces = sorted(set(gmsh.model.getBoundary(solids, combined=False, oriented=False)))
    edges = sorted(set(gmsh.model.getBoundary(faces, combined=False, oriented=False)))
    lengths = [gmsh.model.occ.getMass(*each) for each in edges]
    short = [length for length in lengths if 1e-12 < length < least]
    if short:
        yield (
            f"{len(short)} of {len(lengths)} edges are shorter than half of element_size, the shortest "
            f"{si(min(short) * frame.scale, 'm')}: tets at these edges have the same size and reduce the time step"
        )
    every = [_radius(gmsh, number) for _, number in faces]
    radii = [radius for radius in every if radius < frame.length(element_size)]
    if radii:
        yield (
            f"{len(radii)} of {len(every)} faces are round with a radius below element_size, the smallest "
            f"{si(min(radii) * frame.scale, 'm')}: the mesh of these faces is flat or angular"
        )


def _radius(gmsh: Any, number: int) -> float:
    """Return the smallest radius of curvature at the middle of a face; infinite for a plane."""
    if gmsh.model.getType(2, number) == "Plane":
        return float("inf")
    low, high = gmsh.model.getParametrizationBounds(2, number)
    middle = 0.5 * (np.asarray(low) + np.asarray(high))
    most, least = (float(curvature[0]) for curvature in gmsh.model.getPrincipalCurvatures(number, middle)[:2])
    largest = max(abs(most), abs(least))
    return 1.0 / largest if largest else float("inf")
