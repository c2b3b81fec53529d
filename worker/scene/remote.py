"""Warning about bodies that are very far from the origin. The round-off of their coordinates has the effect of a strain
that is not negligible.
"""

import numpy as np

from conoid.cases.figures import rough, si
from conoid.cases.model.schema import Case

from ..materials.elementary import power
from ..model.state import Floats, Indices

_STRAIN = 1e-6
"""Smallest strain by round-off that gives a warning. Chosen value: it corresponds to 0.2 MPa in steel."""


def remote(case: Case, x: Floats, tets: Indices, part: Indices, volumes: Floats) -> list[str]:
    """Return a warning for each part whose coordinates ``x`` (n, 3), m, have a round-off above _STRAIN times the length
    of an edge of its tets.

    The round-off of a coordinate X is up to 2^-53 X. The edges of a tet of volume V are about (6 V)^(1/3) long.
    """
    warnings = []
    for index in np.unique(part).tolist():
        some = (part == index) & (volumes > 0.0)  # inverted and flat tets have messages of their own
        if not some.any():
            continue
        far = float(np.abs(x[tets[some]]).max())
        edge = power(6.0 * float(volumes[some].min()), 1.0 / 3.0)
        strain = 2.0**-53 * far / edge
        if strain > _STRAIN:
            warnings.append(
                f"parts[{index}].mesh: {case.parts[index].name!r} is {si(far, 'm')} from the origin, with tets of "
                f"{si(edge, 'm')}: coordinates are rounded by strains of about {rough(strain)}; move all bodies "
                "to the origin"
            )
    return warnings
