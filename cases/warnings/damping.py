"""The pressure form ``split`` damps elastic motion: which parts of a case it damps, and the words for it."""

from collections.abc import Iterator

from ..estimates.impact import flows, impact_speeds
from ..model.schema import Case
from ..reading.library import material
from ..reading.problems import Problem, problem

WORDS = "damps elastic motion (a free ball of 6,400 tets loses 15 % of its energy in ten periods)"
"""Measured in tests/verification/test_pressure_modes.py; explanation: docs/theory/elements.md, Pressure forms."""


def damped(case: Case) -> Iterator[Problem]:
    """Yields a warning where a part with the form ``split`` may stay elastic: without strength, or without an impact
    that makes it yield."""
    if case.numerics.pressure != "split":
        return
    parts = zip(case.parts, impact_speeds(case), strict=True)
    elastic = [part.name for part, speed in parts if not flows(material(case, part.material), speed)]
    if elastic:
        yield problem(
            ("numerics", "pressure"), "split", f"{WORDS}, and {elastic[0]!r} may stay elastic: 'nodal' does not damp it"
        )
