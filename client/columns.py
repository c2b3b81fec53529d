"""Tables stored by columns. No package is needed; with pandas installed, a table can become a pandas.DataFrame."""

import csv
import io
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any, TypeAlias

from conoid.cases.figures import number
from conoid.cases.output import fragments, history

from .errors import ClientError, UsageError

Column: TypeAlias = "array[float] | list[str]"
"""A column: numbers as an array of doubles, or text, such as the limiter of dt, as a list."""
_SHOWN = 5
"""Number of rows at the beginning, and number of rows at the end, of a table that notebooks show (chosen value)."""


class Columns(dict[str, Column]):
    """Columns of a table by name, in the order of the file; all columns have the same length. ``units`` has the unit
    of each column, '' for no unit.
    """

    def __init__(self, columns: Mapping[str, Column], units: Mapping[str, str]) -> None:
        """Stores the columns unchanged."""
        super().__init__(columns)
        self.units = dict(units)

    @property
    def rows(self) -> int:
        """Number of rows of the table."""
        return len(next(iter(self.values()), ()))

    def numbers(self, name: str) -> Sequence[float]:
        """Returns a column of numbers. Raises ClientError if the column is unknown or contains text."""
        column = self.get(name)
        if not isinstance(column, array):
            known = ", ".join(each for each, values in self.items() if isinstance(values, array))
            raise UsageError(f"column = {name!r}: columns of numbers are: {known}")
        return column

    def frame(self) -> Any:
        """Returns a pandas.DataFrame; its ``attrs["units"]`` has the units. Raises ClientError if pandas is not
        installed.
        """
        try:
            import pandas
        except ModuleNotFoundError:
            raise ClientError("data frames need pandas: pip install 'conoid[tables]'") from None
        made = pandas.DataFrame({name: list(column) for name, column in self.items()})
        made.attrs["units"] = dict(self.units)
        return made

    def _repr_html_(self) -> str:
        """The beginning and the end of the table as HTML, for notebooks."""
        head = "".join(f"<th>{escape(title)}</th>" for title in history.header({n: self.units[n] for n in self}))
        rows = list(range(self.rows))
        chosen = rows if len(rows) <= 2 * _SHOWN else [*rows[:_SHOWN], *rows[-_SHOWN:]]
        lines = "".join(
            f"<tr>{''.join(f'<td>{escape(_text(c[row]))}</td>' for c in self.values())}</tr>" for row in chosen
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table><p>{len(rows)} lines</p>"


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else number(value)


def read_columns(text: str) -> Columns:
    """Reads CSV text with a header line; returns the columns by name, without the units of the header. A column that
    contains any text is a list of texts.
    """
    rows = csv.reader(io.StringIO(text))
    named = [history.split(name) for name in next(rows, [])]
    columns: list[list[str]] = [list(column) for column in zip(*_whole(rows, len(named)), strict=True)]
    values = [_column(column) for column in columns or [[] for _ in named]]
    return Columns({name: column for (name, _), column in zip(named, values, strict=True)}, dict(named))


def _whole(rows: Iterator[list[str]], length: int) -> Iterator[list[str]]:
    """Yields the rows that have all columns, because the last line of a growing file may be incomplete."""
    return (row for row in rows if len(row) == length)


def _column(column: list[str]) -> Column:
    try:
        return array("d", map(float, column))
    except ValueError:
        return column


def by_part(columns: Columns) -> dict[str, dict[str, Sequence[float]]]:
    """Returns the energies of the parts in a history, first by energy, then by part; empty for a case with one part."""
    found: dict[str, dict[str, Sequence[float]]] = {}
    for column in columns:
        if (named := history.part_of(column)) is not None:
            found.setdefault(named[0], {})[named[1]] = columns.numbers(column)
    return found


def joined(tables: Iterable[tuple[int, Columns]]) -> Columns:
    """Joins tables of fragments; the column ``frame`` has the number of the frame of each row."""
    names = list(fragments.COLUMNS)
    found: dict[str, list[Any]] = {name: [] for name in ("frame", *names)}
    for index, table in tables:
        found["frame"] += [float(index)] * table.rows
        for name in names:
            found[name] += table[name]
    columns: dict[str, Column] = {n: v if n == "part" else array("d", v) for n, v in found.items()}
    return Columns(columns, {"frame": "", **fragments.COLUMNS})
