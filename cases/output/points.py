"""The table of a sweep (several runs of a case with changed keys). The table has one line per run, and columns for the
changed keys, for properties of the run, and for results.

The values are numbers; the header of each column gives its name and its unit. Server, client and page use this table.
"""

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import msgspec

from ..ledger import Energy
from ..model.schema import Case
from ..outcome import Check, Measured, Outcome
from ..reading.quantities import FIELD_UNITS, unit_of
from ..reference.key_units import unit_of_key
from ..units import parse_unit, written
from .history import header

Cell = int | float | str | None
"""A value in the table of a sweep; None if it is unknown."""
Named = tuple[str, str]
"""Name and unit of a column of the table; the unit is empty if there is none."""
_VERDICTS = "no", "yes"
KEY, RUN, RESULT = "key", "run", "result"

_COUNTS = ("fragments", "broken", "eroded")
_COSTS = {"first_break": "s", "time": "s", "elapsed": "s", "cpu": "s", "steps": "", "elements": "", "nodes": ""}
_FORMULA = re.compile(r"[=@\t\r]|[+-](?!(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?( [^\W\d][\w*/^ -]*)?$)")
"""Pattern of the beginning of a text that a spreadsheet program would evaluate as a formula. A number with a sign, with
or without a unit, does not match."""


@dataclass(frozen=True, kw_only=True)
class Point:
    """One run of a sweep: the changed keys, the run, and its ``results``; the results are empty until the run has
    ended.
    """

    values: Mapping[str, Any]
    run: str = ""
    state: str = ""
    cause: str = ""
    results: Mapping[Named, Cell] = field(default_factory=dict)


class Column(msgspec.Struct, kw_only=True, frozen=True):
    """A column of the table of a sweep. ``kind``: KEY (a changed key), RUN (a property of the run) or RESULT."""

    name: str
    unit: str = ""
    kind: str
    values: list[Cell]

    @property
    def title(self) -> str:
        """The name of the column with the unit in brackets, as in the header."""
        return header({self.name: self.unit})[0]


def table(points: Sequence[Point]) -> list[Column]:
    """Returns the columns of the table in the order: keys, properties of the run, results. A result that no run has
    gets no column.
    """
    keys = dict.fromkeys(key for point in points for key in point.values)
    return [
        *(_key(key, [point.values.get(key) for point in points]) for key in keys),
        *(
            Column(name=name, kind=RUN, values=[getattr(point, name) for point in points])
            for name in ("run", "state", "cause")
        ),
        *_results(points),
    ]


def _results(points: Sequence[Point]) -> list[Column]:
    names = dict.fromkeys(name for point in points for name in point.results)
    return [
        Column(name=name, unit=unit, kind=RESULT, values=[point.results.get((name, unit)) for point in points])
        for name, unit in names
    ]


def results(ended: Outcome | None) -> dict[Named, Cell]:
    """Returns the results of a run by name and unit: its references; the last, smallest and largest value of each
    probe; counts; terms of the energy ledger; cost.
    """
    if ended is None:
        return {}
    energy = {} if ended.energy is None else msgspec.structs.asdict(ended.energy)
    found: dict[Named, Any] = {
        **_references(ended),
        **_probes(ended),
        **{(name, ""): getattr(ended, name) for name in _COUNTS},
        **{(f"energy.{name}", "" if name == "residual" else "J"): value for name, value in energy.items()},
        ("worst_residual", ""): ended.worst_residual,
        **{(name, unit): getattr(ended, name) for name, unit in _COSTS.items()},
        ("warnings", ""): len(ended.warnings),
        ("digest", ""): ended.digest or None,
    }
    return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in found.items()}


def names(case: Case) -> dict[str, str]:
    """Returns the names of the numerical results of a run of the case, with their units."""
    probes = [Measured(name=probe.name, value=0.0, unit=FIELD_UNITS[probe.field]) for probe in case.probes]
    fields = {probe.name: probe.field for probe in case.probes}
    checks = [
        Check(name=each.title, value=0.0, expected=0.0, tolerance=0.0, passed=True,
              unit=unit_of(each.quantity, fields.get(each.probe or "")))
        for each in case.reference
    ]  # fmt: skip
    energy = Energy(**dict.fromkeys(Energy.__struct_fields__, 0.0))
    like = Outcome(state="succeeded", probes=probes, reference=checks, energy=energy)
    return {name: unit for (name, unit), value in results(like).items() if name != "digest" and value not in _VERDICTS}


def _references(ended: Outcome) -> dict[Named, Cell]:
    """Returns the value of each reference and whether it is met. References with equal titles are numbered."""
    found: dict[Named, Cell] = {}
    for n, check in enumerate(ended.reference):
        before = sum(each.name == check.name for each in ended.reference[:n])
        name = f"reference.{check.name}" + (f" ({before + 1})" if before else "")
        found |= {(name, check.unit): check.value, (f"{name}.passed", ""): _VERDICTS[check.passed]}
    return found


def _probes(ended: Outcome) -> dict[Named, Cell]:
    return {
        (f"probe.{probe.name}{which}", probe.unit): value
        for probe in ended.probes
        for which, value in (("", probe.value), (".min", probe.least), (".max", probe.most))
    }


# Keys -----------------------------------------------------------------------------------------------------------------


def _key(key: str, values: Sequence[Any]) -> Column:
    """Returns the column of a key: numbers in the unit in which the values are written if all are quantities of one
    kind; otherwise the texts as they are written.
    """
    unit, numbers = in_one_unit(key, values)
    return Column(name=key, unit=unit, kind=KEY, values=numbers)


def in_one_unit(key: str, values: Sequence[Any]) -> tuple[str, list[Cell]]:
    """Returns the unit of the values of a key, and the values in this unit. The unit is that of the first value with a
    unit; if no value has a unit, it is the unit of a bare number. Values of several kinds, and values that are no
    numbers, stay text.
    """
    texts: list[Cell] = [None if value is None else _text(value) for value in values]
    read = {n: written(value) for n, value in enumerate(values) if value is not None}
    pairs = {n: pair for n, pair in read.items() if pair is not None}
    if len(pairs) < len(read):
        return "", texts
    units = list(dict.fromkeys(unit for _, unit in pairs.values()))
    unit = next(filter(None, units), "")
    try:
        scales = {each: _scale(each, unit) for each in units}
    except ValueError:
        return "", texts
    numbers = {n: _scaled(number, scales[each]) for n, (number, each) in pairs.items()}
    return unit or unit_of_key(key), [numbers.get(n) for n in range(len(values))]


def _scale(unit: str, target: str) -> Fraction:
    """Returns the factor that converts a value in ``unit`` to ``target``; a bare number is in SI units. Raises
    ValueError if the units have different dimensions.
    """
    factor, dimension = parse_unit(unit)
    whole, kind = parse_unit(target)
    if unit and dimension != kind:
        raise ValueError(f"{unit} is no {target}")
    return factor / whole


def _scaled(number: str, scale: Fraction) -> int | float:
    exact = Fraction(number) * scale
    return int(exact) if exact.denominator == 1 and re.fullmatch(r"[+-]?\d+", number) else float(exact)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()


# CSV ------------------------------------------------------------------------------------------------------------------


def to_csv(columns: Sequence[Column]) -> str:
    """Returns the table as CSV text whose first line has the names and units; unknown values are empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(safe(column.title) for column in columns)
    writer.writerows(map(safe, line) for line in rows(columns))
    return out.getvalue()


def rows(columns: Sequence[Column]) -> Iterable[tuple[Cell, ...]]:
    """Yields the lines of the table of a sweep."""
    return zip(*(column.values for column in columns), strict=True)


def safe(value: Cell) -> Cell:
    """Returns a value as it is written into a CSV file. A text that a spreadsheet program would evaluate as a formula
    gets an apostrophe in front, so that it stays a text.
    """
    return f"'{value}" if isinstance(value, str) and _FORMULA.match(value) else value
