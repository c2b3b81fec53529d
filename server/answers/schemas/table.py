"""JSON schemas of the table of runs: values of the cases and results."""

import msgspec

from conoid.cases.messages import Progress

from .runs import ListedRun


class TableRow(ListedRun, kw_only=True):
    """A run in the table: the index of its group of similar cases, the values in which its case differs from the group,
    and its results.
    """

    progress: Progress | None
    case: int | None
    values: dict[str, bool | int | float | str | None]
    results: list[float | None] | None
    references: int
    """Number of reference values with which the results of the run were compared."""
    missed: list[str]
    """Names of the reference values from which the results of the run differ by more than the tolerance."""


class Result(msgspec.Struct, kw_only=True):
    """Name and unit of a result."""

    name: str
    unit: str


class AlikeCases(msgspec.Struct, kw_only=True):
    """A group of similar cases: common values by key in SI units, units by key, and results of the runs of the
    group.
    """

    values: dict[str, bool | int | float | str]
    units: dict[str, str]
    results: list[Result]


class Table(msgspec.Struct, kw_only=True):
    """Runs, newest first, and the cursor of the next page; the cursor is null on the last page. ``pending``: number of
    runs of this page whose values and results have not been read yet.
    """

    runs: list[TableRow]
    cases: list[AlikeCases]
    pending: int
    next: str | None
