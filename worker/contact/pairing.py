"""Which parts meet, and with what friction."""

import numpy as np

from conoid.cases.schema import Case

from ..state import Floats


def friction(case: Case) -> Floats:
    """(parts, parts) Coulomb's coefficient, NaN where two parts do not meet."""
    assert case.contact is not None
    spec, names = case.contact, [part.name for part in case.parts]
    meets = np.array([name in spec.parts or not spec.parts for name in names])
    mu = np.where(meets[:, None] & meets[None, :], spec.friction, np.nan)
    for i, part in enumerate(case.parts):
        if part.name not in spec.self_contact and part.fracture is None:
            mu[i, i] = np.nan
    for pair in spec.pairs:
        i, j = (names.index(name) for name in pair.parts)
        mu[i, j] = mu[j, i] = pair.friction
    return mu
