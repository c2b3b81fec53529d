"""Warnings about valid but unusual positions: planes of symmetry inside a body, and boxes of probes that are smaller
than a tet.
"""

import math
from collections.abc import Iterator

from ..estimates.estimate import Estimate
from ..model.bodies import Loose
from ..model.schema import Case, Symmetry
from ..model.solids import Measured
from ..reading.problems import Problem, problem
from ..shapes.geometry import index, volume
from ..shapes.placed import Placed

_TOUCH = 1e-9
"""Largest depth of a plane below the surface of a body at which it counts as on the surface, divided by the size of the
body. The depth is far above rounding errors and far below any tet (chosen value)."""
_FEWEST = 1.0
"""Number of tets that the box of a probe should contain at least, by its volume. A smaller box may contain no tet in
some meshes (reason of the chosen value)."""


def cut_bodies(case: Case) -> Iterator[Problem]:
    """Yields a warning for each plane of symmetry that passes through a body, so that both sides of the plane are
    modelled. Turned bodies give no warning, because only their bounding box is known.
    """
    for number, plane in case.boundaries_of(Symmetry):
        d = index(plane.axis)
        for part in case.parts:
            if isinstance(part.mesh, Measured | Loose) or part.turn is not None:
                continue
            if plane.parts and part.name not in plane.parts:
                continue
            low, high = (corner[d] for corner in Placed(part.mesh).bounds())
            if min(plane.at - low, high - plane.at) > _TOUCH * (high - low):
                message = f"goes through part {part.name!r}, which lies between {low:g} and {high:g} m"
                message = f"{message}: each side is in contact with its own mirror image; model one side"
                yield problem(("boundaries", number, "at"), f"{plane.at:g} m", message)
                break


def scant_probes(case: Case, expected: Estimate) -> Iterator[Problem]:
    """Yields a warning for each probe whose box is smaller than a tet. Mesh files and graded meshes give no warning."""
    sizes = {part.name: (part, size) for part, size in zip(case.parts, expected.parts, strict=True)}
    for i, probe in enumerate(case.probes):
        if not probe.part:
            continue
        part, size = sizes[probe.part]
        if probe.low is None or probe.high is None or isinstance(part.mesh, Measured) or part.mesh.grading is not None:
            continue
        box = zip(probe.low, probe.high, *Placed(part.mesh, part.turn).bounds(), strict=True)
        inside = math.prod(max(0.0, min(b, high) - max(a, low)) for a, b, low, high in box)
        holds = (size.elements or 0) * inside / volume(part.mesh)
        if holds < _FEWEST:
            message = f"the box is as large as {holds:.2g} tets of part {part.name!r}; if no tet has its centre there,"
            yield problem(("probes", i), ..., f"{message} the run does not start")
