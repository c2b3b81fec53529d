"""An adaptive sweep as its client reports it and a server shows it: what is looked for, the runs, what was found.

The numbers are in SI units. A report has everything, so that one which was lost is made up for by the next one.
"""

from typing import Annotated

import msgspec

MOST_RUNS = 500
"""Points of a report. Chosen: an adaptive sweep makes 40 runs where nothing else is said."""
_Word = Annotated[str, msgspec.Meta(max_length=200)]
_Value = Annotated[str, msgspec.Meta(max_length=200)] | float | bool


class SearchPoint(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A point that was decided: the value ``x`` of the first key, what was changed, the run, and the ``value`` of the
    result. Without a value the run goes on, or ``problem`` says why it has none.
    """

    x: float
    changed: Annotated[dict[_Word, _Value], msgspec.Meta(max_length=20)] = {}
    run: _Word = ""
    value: float | None = None
    problem: _Word = ""


class Curve(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The curve through the points: where it has its limit, with the standard error, and how it runs."""

    law: _Word
    limit: float
    error: float | None = None
    factor: float
    """a of the law, or the slope of the line."""
    exponent: float | None = None
    """p of the law."""
    course: Annotated[list[tuple[float, float, float | None]], msgspec.Meta(max_length=100)] = []
    """x, value and standard error of the value."""


class Search(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The report. ``began`` (Unix s) tells one command from the next one that goes on with the same sweep."""

    name: _Word
    """Of the case."""
    began: float
    result: _Word
    threshold: float
    result_unit: _Word = ""
    key: _Word
    """The key of x; ``more`` are those that vary with it."""
    more: Annotated[list[_Word], msgspec.Meta(max_length=20)] = []
    unit: _Word = ""
    low: float
    high: float
    tolerance: float
    points: Annotated[list[SearchPoint], msgspec.Meta(max_length=MOST_RUNS)] = []
    bracket: tuple[float, float] | None = None
    """The points between which the threshold is passed."""
    mixed: tuple[float, float] | None = None
    """Between which values it is passed again and again."""
    curve: Curve | None = None
    over: bool = False
    """No further point follows."""
    why: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    """Why it ended before the bracket was as narrow as the tolerance."""
