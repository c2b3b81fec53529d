"""Warning about the pressure form ``split``, which damps elastic motion."""

from collections.abc import Iterator

from ..estimates.impact import flows, impact_speeds
from ..model.schema import Case
from ..reading.library import material
from ..reading.problems import Problem, problem

WORDS = "damps elastic motion (a free ball of 6,400 tets loses 15 % of its energy in ten periods)"
"""Text of the warning. The loss was measured in tests/verification/test_pressure_modes.py and is explained in
docs/theory/elements.md, section "Pressure forms"."""


def damped(case: Case) -> Iterator[Problem]:
    """Yields a warning if a part with the pressure form ``split`` may stay elastic: it has no strength, or no impact
    makes it yield.
    """
    if case.numerics.pressure != "split":
        return
    parts = zip(case.parts, impact_speeds(case), strict=True)
    elastic = [part.name for part, speed in parts if not flows(material(case, part.material), speed)]
    if elastic:
        yield problem(
            ("numerics", "pressure"), "split", f"{WORDS}, and {elastic[0]!r} may stay elastic: 'nodal' does not damp it"
        )
