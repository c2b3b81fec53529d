"""JSON schemas of sweeps: the request, lists, and one sweep."""

from typing import Annotated, Any

import msgspec

from conoid.cases.output.search import Search

from .runs import ListedRun

MOST_POINTS = 1000
"""Largest number of points of a sweep; the cases of so many points are made in one second (reason of the chosen
limit)."""


class Wish(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Request for a sweep: a case as JSON, the changed values of each point by key, and the largest number of
    concurrent runs.
    """

    case: dict[str, Any]
    points: Annotated[list[dict[str, Any]], msgspec.Meta(min_length=1, max_length=MOST_POINTS)]
    at_once: Annotated[int, msgspec.Meta(ge=1)] | None = None


class SweepLine(msgspec.Struct, kw_only=True):
    """A sweep in a list: number of runs in each state, and number of removed runs."""

    id: str
    owner: str
    name: str
    submitted: float
    at_once: int | None
    total: int
    states: dict[str, int]
    removed: int
    url: str
    search: Search | None
    """Last report of an adaptive sweep, as its client sent it."""
    reported: float | None
    """Unix time of the last report of an adaptive sweep, s."""


class Reported(msgspec.Struct, kw_only=True):
    """Answer to a report of an adaptive sweep: the sweep, and whether the client must stop submitting points."""

    id: str
    url: str
    stop: bool


class SweepPage(msgspec.Struct, kw_only=True):
    """Sweeps of the user, newest first, and the value of the parameter ``before`` for the next page; null on the last
    page.
    """

    sweeps: list[SweepLine]
    next: str | None


class SweepPoint(msgspec.Struct, kw_only=True):
    """Changed values of a point, and the run of the point."""

    values: dict[str, Any]
    run: ListedRun


class Sweep(SweepLine, kw_only=True):
    """A sweep with its points."""

    points: list[SweepPoint]
