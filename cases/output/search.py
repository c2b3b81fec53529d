"""Data of an adaptive sweep, which the client reports and the server shows: the searched threshold, the runs, and the
result.

All numbers are in SI units. A report contains all data, so that the next report replaces a report that was lost.
"""

from typing import Annotated

import msgspec

MOST_RUNS = 500
"""Largest number of points of a report; an adaptive sweep makes 40 runs by default (reason of the chosen limit)."""
_Word = Annotated[str, msgspec.Meta(max_length=200)]
_Value = Annotated[str, msgspec.Meta(max_length=200)] | float | bool


class SearchPoint(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A point of an adaptive sweep: value ``x`` of the first key, changed keys, run, and ``value`` of the result.
    Without a ``value`` the run has not ended, or ``problem`` gives the reason why it has no value.
    """

    x: float
    changed: Annotated[dict[_Word, _Value], msgspec.Meta(max_length=20)] = {}
    run: _Word = ""
    value: float | None = None
    problem: _Word = ""


class Curve(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The curve through the points: the value at the limit, the standard error of this value, and points of the
    curve.
    """

    law: _Word
    limit: float
    error: float | None = None
    factor: float
    """Constant a of the fitted law, or slope of the fitted line."""
    exponent: float | None = None
    """Exponent p of the fitted law."""
    course: Annotated[list[tuple[float, float, float | None]], msgspec.Meta(max_length=100)] = []
    """Points of the curve: x, value, and standard error of the value."""


class Search(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The report of an adaptive sweep. The start time ``began`` (Unix time, s) distinguishes a command from a later
    command that continues the same sweep.
    """

    name: _Word
    """Name of the case."""
    began: float
    result: _Word
    threshold: float
    result_unit: _Word = ""
    key: _Word
    """The key whose value is x. The field ``more`` has the keys that vary together with the first key."""
    more: Annotated[list[_Word], msgspec.Meta(max_length=20)] = []
    unit: _Word = ""
    low: float
    high: float
    tolerance: float
    points: Annotated[list[SearchPoint], msgspec.Meta(max_length=MOST_RUNS)] = []
    bracket: tuple[float, float] | None = None
    """The two values of x between which the result crosses the threshold once."""
    mixed: tuple[float, float] | None = None
    """The smallest and the largest x of an interval in which the result crosses the threshold several times."""
    curve: Curve | None = None
    over: bool = False
    """Whether the adaptive sweep has ended, so that no further point follows."""
    why: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    """Reason why the sweep ended before the bracket was as narrow as the tolerance."""
