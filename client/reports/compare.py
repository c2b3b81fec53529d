"""Comparison of two runs: keys of the case that differ, results at the end, fragments."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from conoid.cases.figures import counted
from conoid.cases.outcome import Outcome
from conoid.cases.output import fragments, history
from conoid.cases.output.fragments import Summary
from conoid.cases.reading.problems import shown

from ..columns import Columns
from ..errors import UnfinishedError
from ..result import Result

_NAMED = 3
"""Largest number of changed keys that a message names."""
_OUTCOME = (
    "steps", "time", "ranks", "elapsed", "cpu", "elements", "nodes", "fragments", "broken", "first_break", "eroded",
    "eroded_mass", "inside", "deepest", "overlapping", "overlap", "rebalances", "worst_residual",
    "element_updates_per_second",
)  # fmt: skip
_DRAWN = (
    "kinetic", "elastic", "plastic", "contact", "friction", "eroded", "fracture", "cohesive", "stepping", "averaging",
)  # fmt: skip
AT_THE_END = ", at the end"
"""Text after the name of a history column that stands for the last value of the column."""
_UNITS = {"time": "s", "elapsed": "s", "cpu": "s", "eroded_mass": "kg", "element_updates_per_second": "1/s"}


class Key(msgspec.Struct, frozen=True):
    """A key whose values differ between two cases; the value is None if a case does not have the key."""

    key: str
    a: Any
    b: Any


class Value(msgspec.Struct, frozen=True):
    """A number of two runs; NaN if a run does not have it. ``difference`` is b - a, ``relative`` is (b - a) /
    abs(a).
    """

    name: str
    unit: str
    a: float
    b: float

    @property
    def difference(self) -> float:
        """Difference b - a."""
        return self.b - self.a

    @property
    def relative(self) -> float:
        """Difference b - a divided by the magnitude of a; 0 for equal values, NaN for an unknown value or for a = 0."""
        if self.difference == 0.0:
            return 0.0
        return self.difference / abs(self.a) if self.a else math.nan


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison of two runs."""

    names: tuple[str, str]
    same_answer: bool
    """True if the digests of both runs are equal."""
    keys: list[Key]
    ends: list[Value]
    sizes: list[Value]
    """Totals of the last tables of fragments of both runs."""


def compare(a: Result, b: Result) -> Comparison:
    """Compares two runs that have ended. Raises UnfinishedError."""
    ends = [*_outcomes(a, b), *_energies(a, b), *_references(a, b), *_last(a, b)]
    digests = a.outcome.digest, b.outcome.digest
    return Comparison(
        (a.folder.name, b.folder.name), digests[0] == digests[1] != "", differing(a.case, b.case), ends, _sizes(a, b)
    )


def differing(a: Any, b: Any) -> list[Key]:
    """Returns the keys whose values differ, such as ``parts.glass.mesh.element_size``."""
    first, second = dict(_flat(a)), dict(_flat(b))
    every = [*first, *(key for key in second if key not in first)]
    return [Key(key, first.get(key), second.get(key)) for key in every if first.get(key) != second.get(key)]


def changes(before: Any, now: Any) -> str:
    """Returns a text with the first keys that differ, each with both values; empty if all values are equal."""
    found = differing(before, now)
    keys = ", ".join(f"{one.key} was {shown(one.a)} and is {shown(one.b)}" for one in found[:_NAMED])
    return keys + (f", and {counted(len(found) - _NAMED, 'more key')}" if len(found) > _NAMED else "")


def _flat(data: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yields the keys and values of nested data. An entry of a list is identified by its name, or by its index if it
    has no name.
    """
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _flat(value, f"{path}.{key}" if path else str(key))
    elif isinstance(data, list) and any(isinstance(each, dict) for each in data):
        for place, each in enumerate(data):
            name = each.get("name", place) if isinstance(each, dict) else place
            yield from _flat(each, f"{path}.{name}")
    else:
        yield path, data


def _outcomes(a: Result, b: Result) -> list[Value]:
    """Returns the numbers of both outcomes; NaN for a number that one run lacks. A number that both runs lack is
    left out.
    """
    pairs = ((name, _known(a.outcome, name), _known(b.outcome, name)) for name in _OUTCOME)
    return [Value(n, _UNITS.get(n, ""), *both) for n, *both in pairs if not all(map(math.isnan, both))]


def _known(ended: Outcome, name: str) -> float:
    value = getattr(ended, name)
    return math.nan if value is None else float(value)


def _energies(a: Result, b: Result) -> list[Value]:
    first, second = a.outcome.energy, b.outcome.energy
    if first is None or second is None:
        return []
    pairs = [(name, getattr(first, name), getattr(second, name)) for name in first.__struct_fields__]
    return [Value(f"energy.{n}", "" if n == "residual" else "J", one, two) for n, one, two in pairs if one or two]


def _references(a: Result, b: Result) -> list[Value]:
    second = {check.name: check.value for check in b.outcome.reference}
    return [Value(c.name, c.unit, c.value, second[c.name]) for c in a.outcome.reference if c.name in second]


def _last(a: Result, b: Result) -> list[Value]:
    """Returns the last values of history columns that are not in the outcomes: momentum, probes."""
    try:
        first, second = a.history, b.history
    except UnfinishedError:
        return []
    shared = [name for name in common(first, second) if name not in (*history.CLOCK, *history.LEDGER)]
    if not (first.rows and second.rows):
        return []
    return [Value(f"{n}{AT_THE_END}", first.units[n], first.numbers(n)[-1], second.numbers(n)[-1]) for n in shared]


def common(a: Columns, b: Columns) -> list[str]:
    """Returns the numeric columns that both histories have."""
    return [name for name, values in a.items() if name in b and not isinstance(values, list)]


@dataclass(frozen=True)
class Material:
    """Data for a figure of two runs; the keys are the names of the runs."""

    histories: dict[str, Columns]
    fragments: dict[str, Columns]
    columns: list[str]


def material(a: Result, b: Result, names: Sequence[str] = ()) -> Material:
    """Returns the histories and the last fragment tables of two runs. ``names``: columns of the history; by default
    the energies that are not always 0 and the probes that both runs have.
    """
    runs = {a.folder.name: a, b.folder.name: b} if a.folder.name != b.folder.name else {"A": a, "B": b}
    histories = {name: run.history for name, run in runs.items()}
    both = common(a.history, b.history)
    chosen = [n for n in both if n in _DRAWN and any(any(each.numbers(n)) for each in histories.values())]
    chosen += [n for n in both if n not in history.COLUMNS and history.part_of(n) is None]
    tables = {name: run.fragments_of() for name, run in runs.items() if run.fragment_tables}
    return Material(histories, tables, list(names or chosen))


def _sizes(a: Result, b: Result) -> list[Value]:
    first, second = summary(a), summary(b)
    if first is None or second is None:
        return []
    whole = f"fragments of {fragments.DUST} tets or more"
    values = [
        Value(whole, "", first.fragments, second.fragments), Value("dust", "", first.dust, second.dust),
        Value("dust, of the mass", "", first.dust_share, second.dust_share),
        Value("largest fragment, of the mass", "", first.largest_share, second.largest_share),
    ]  # fmt: skip
    laws = {fit.law: fit.parameter for fit in second.masses}
    for fit in first.masses:
        unit = "" if fit.law == "power" else "kg"
        values.append(Value(f"masses, {fit.law} law", unit, fit.parameter, laws.get(fit.law, math.nan)))
    return values


def summary(result: Result) -> Summary | None:
    """Returns the totals of the last table of fragments; None for a run without such tables."""
    if not result.fragment_tables:
        return None
    table = result.fragments_of()
    return fragments.summary([int(n) for n in table.numbers("tets")], table.numbers("mass"), table.numbers("extent"))
