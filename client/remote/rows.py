"""The table of runs: values of the cases and results of many runs, in one answer of the server."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec

from conoid.cases.reference.flat import Scalar

from .run_info import RunInfo

_NEVER = frozenset({"run.ranks", "run.threads", "run.profile"})
"""Keys of a case that ``differing`` leaves out, because a list of runs has columns of their own for them."""


class Result(msgspec.Struct, kw_only=True, frozen=True):
    """Name and unit of a result."""

    name: str
    unit: str = ""


class Alike(msgspec.Struct, kw_only=True, frozen=True):
    """Data of a group of similar cases: common values and units by key, and the results of the runs."""

    values: dict[str, Scalar]
    units: dict[str, str]
    results: list[Result]


class TableRow(RunInfo, kw_only=True, frozen=True):
    """A run in the table; ``case``: index of the group of similar cases to which the run belongs."""

    case: int | None
    values: dict[str, Scalar | None]
    results: list[float | None] | None
    references: int
    missed: list[str]


class TablePage(msgspec.Struct, kw_only=True, frozen=True):
    """A page of the table of runs; ``pending``: number of runs on the page whose results the server has not read
    yet.
    """

    runs: list[TableRow]
    cases: list[Alike]
    pending: int = 0
    next: str | None = None


@dataclass(frozen=True)
class RunRow:
    """A run with the values of its case and its results."""

    info: RunInfo
    values: dict[str, Scalar]
    """Values of the case in SI units; the keys are such as ``parts[0].velocity[2]``."""
    results: dict[str, float | None]
    """Results of the run in SI units by name, such as ``probe.speed``; empty before the end of the run."""
    units: dict[str, str]
    """Units of those values and results that have a unit."""
    references: int
    """Number of reference values with which the run was compared."""
    missed: list[str]
    """Names of the reference values that the run does not reproduce."""
    alike: Alike | None
    """Common data of the group of similar cases to which the run belongs."""


def rows_of(page: TablePage) -> Iterator[RunRow]:
    """Yields the rows of a page of the table."""
    for run in page.runs:
        alike = page.cases[run.case] if run.case is not None else None
        values = {**(alike.values if alike is not None else {}), **run.values}
        names = alike.results if alike is not None else []
        measured = {each.name: each.unit for each in names if each.unit}
        yield RunRow(
            info=run,
            values={key: value for key, value in values.items() if value is not None},
            results={each.name: value for each, value in zip(names, run.results or (), strict=False)},
            units={**(alike.units if alike is not None else {}), **measured},
            references=run.references, missed=run.missed, alike=alike,
        )  # fmt: skip


def differing(rows: Sequence[RunRow], most: int) -> list[str]:
    """Returns at most ``most`` keys whose values differ between runs of similar cases; keys that differ in most runs
    are first.
    """
    found = Counter[str]()
    for alike in {id(row.alike): row.alike for row in rows if row.alike is not None}.values():
        own = [row for row in rows if row.alike is alike]
        keys = dict.fromkeys(key for row in own for key in (*alike.values, *row.values))
        for key in keys:
            if len({row.values.get(key) for row in own}) > 1 and key not in _NEVER:
                found[key] += len(own)
    return [key for key, _ in found.most_common(most)]
