"""The report of an adaptive sweep: the threshold that is searched, the runs, and the result. The client makes it and
the server shows it.

All numbers are in SI units. Each report contains all data, so that the loss of a report does no harm.
"""

from typing import Annotated

import msgspec

MOST_RUNS = 500
"""Largest number of points of a report; an adaptive sweep makes 40 runs by default (reason of the chosen value)."""
_Word = Annotated[str, msgspec.Meta(max_length=200)]
_Value = Annotated[str, msgspec.Meta(max_length=200)] | float | bool


class SearchPoint(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """One run of an adaptive sweep: the value ``x`` of the first key, the changed keys, the run, and the ``value`` of
    the result. If ``value`` is absent, either the run has not ended, or ``problem`` gives the reason.
    """

    x: float
    changed: Annotated[dict[_Word, _Value], msgspec.Meta(max_length=20)] = {}
    run: _Word = ""
    value: float | None = None
    problem: _Word = ""


class Curve(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The curve that is fitted to the points: its value at the threshold, the standard error of this value, and points
    of the curve.
    """

    law: _Word
    limit: float
    error: float | None = None
    factor: float
    """Constant a of the fitted law, or slope of the fitted line."""
    exponent: float | None = None
    """Exponent p of the fitted law."""
    course: Annotated[list[tuple[float, float, float | None]], msgspec.Meta(max_length=100)] = []
    """Points of the fitted curve: x, value, and standard error of the value."""


class Search(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The report of an adaptive sweep. The start time ``began`` (Unix time, s) identifies the command that makes the
    sweep: a later command may continue the same sweep.
    """

    name: _Word
    """Name of the case."""
    began: float
    result: _Word
    threshold: float
    result_unit: _Word = ""
    key: _Word
    """First key that the sweep changes; x is its value. The other keys of the sweep are in ``more``."""
    more: Annotated[list[_Word], msgspec.Meta(max_length=20)] = []
    unit: _Word = ""
    low: float
    high: float
    tolerance: float
    points: Annotated[list[SearchPoint], msgspec.Meta(max_length=MOST_RUNS)] = []
    bracket: tuple[float, float] | None = None
    """Two values of x; the result crosses the threshold once between them."""
    mixed: tuple[float, float] | None = None
    """Smallest and largest x of an interval in which the result crosses the threshold several times."""
    curve: Curve | None = None
    over: bool = False
    """Whether the adaptive sweep has ended: no further runs follow."""
    why: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    """Reason why the sweep ended before the bracket was as narrow as the tolerance."""
