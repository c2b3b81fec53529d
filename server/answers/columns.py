"""Columns of history.csv for charts, reduced so that no peak is lost.

The lines of history.csv are divided into groups of equal size. For each group of lines the minimum and the maximum of
each column are stored, in the order in which they occurred. When there are too many groups of lines, pairs of groups
are merged. The merging limits the memory and the size of answers.
"""

import csv
import math
import os
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from conoid.cases.output import history
from conoid.cases.reading import whole

from ..runs.journal import Tail

_GROUPS = 4096
"""Largest number of groups of lines: more than the number of pixels across a screen (chosen value)."""
_NUMBERS = 400_000
"""Largest product of the number of groups and the number of columns: 6 MB of memory (chosen value)."""
_SENT = 200_000
"""Largest number of values in an answer: 4 MB of JSON (chosen value)."""
_BLOCK = 1 << 20
"""Number of bytes that are read from history.csv at once (chosen value)."""
_AT_ONCE = 32
"""Largest number of blocks of history.csv that are read for one answer: some 100,000 lines, half a second (chosen
value)."""
_MOST_COLUMNS = 4000
"""Largest number of columns that are read; further columns are ignored. A case with a thousand probes has slightly more
than a thousand columns (reason of the chosen limit)."""
_TEXT = frozenset({"limiter"})
"""Names of the columns of history.csv whose values are texts."""
csv.field_size_limit(1 << 30)
"""Largest number of characters of a field of history.csv that the csv module accepts. A field that is not a number
becomes NaN.
"""


class Columns:
    """The columns of a history.csv file, up to the line that was read last. The caller must hold the lock of this
    object.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._begin()

    def _begin(self) -> None:
        self._tail = Tail(self._path)
        self._file = self._size = 0
        self.units: dict[str, str] = {}
        """Unit of each numeric column, by the name of the column."""
        self.lines = 0
        self.behind = False
        """True while history.csv has lines that have not been read."""
        self._width, self._every = 0, 1
        self._places: list[int] = []
        """Position of each numeric column in a line."""
        self._kept: list[array[float]] = []
        """Minimum and maximum of each group of ``_every`` lines, for each numeric column."""
        self._open: list[list[float]] = []
        """Values of the last group of lines, which is not complete yet, for each numeric column."""
        self._extremes: list[tuple[float, float]] = []
        self._last: list[float] = []

    def catch_up(self) -> None:
        """Reads at most ``_AT_ONCE`` blocks of new lines. If history.csv was replaced, the new file is read from its
        beginning.
        """
        if self._is_another():
            self._begin()
            self._is_another()
        for _ in range(_AT_ONCE):
            block = self._tail.block(_BLOCK)
            if not block:
                self.behind = False
                return
            self._take(block.decode("utf-8", "replace"))
        self.behind = True

    def _is_another(self) -> bool:
        """Whether history.csv was replaced since the last call: a run that continues from a checkpoint writes a new
        file.
        """
        try:
            with whole.opened(self._path, links=False) as file:
                now = os.fstat(file.fileno())
        except FileNotFoundError:
            return self.lines > 0
        another = bool(self._file) and (now.st_ino != self._file or now.st_size < self._size)
        self._file, self._size = now.st_ino, now.st_size
        return another

    def _take(self, text: str) -> None:
        rows = list(csv.reader(text.splitlines()))
        if not self.units and rows:
            self._head(rows.pop(0))
        rows = [row for row in rows if len(row) == self._width]
        if not rows:
            return
        columns = list(zip(*rows, strict=True))
        for at, place in enumerate(self._places):
            self._add(at, _numbers(columns[place]))
        self.lines += len(rows)
        self._merge()

    def _head(self, names: Sequence[str]) -> None:
        pairs = [history.split(name) for name in names]
        self._width = len(names)
        places = {name: k for k, (name, _) in reversed([*enumerate(pairs)]) if name not in _TEXT}
        self._places = sorted(places.values())[:_MOST_COLUMNS]  # a repeated column name means its first column
        self.units = dict(pairs[k] for k in self._places)
        number = len(self._places)
        self._kept = [array("d") for _ in range(number)]
        self._open = [[] for _ in range(number)]
        self._extremes = [(math.nan, math.nan)] * number
        self._last = [math.nan] * number

    def _add(self, at: int, values: list[float]) -> None:
        self._last[at] = values[-1]
        self._extremes[at] = _sorted(extremes([*self._extremes[at], *extremes(values)]))
        values = [*self._open[at], *values]
        ends = len(values) - len(values) % self._every
        for k in range(0, ends, self._every):
            self._kept[at].extend(extremes(values[k : k + self._every]))
        self._open[at] = values[ends:]

    def _merge(self) -> None:
        """Merges pairs of groups of lines until the number of groups is within the limit."""
        most = 2 * max(2, min(_GROUPS, _NUMBERS // max(1, len(self._kept))))
        while self._kept and len(self._kept[0]) > most:
            self._kept = [
                array("d", (value for k in range(0, len(kept), 4) for value in extremes(kept[k : k + 4])))
                for kept in self._kept
            ]
            self._every *= 2

    def statistics(self) -> dict[str, dict[str, Any]]:
        """Returns unit, last value, minimum and maximum of each numeric column."""
        return {
            name: {"unit": unit, "last": last, "least": low, "most": high}
            for (name, unit), last, (low, high) in zip(self.units.items(), self._last, self._extremes, strict=True)
        }

    def values(self, names: Sequence[str], points: int) -> dict[str, list[float]]:
        """Returns the named columns with at most about ``points`` values each. A file with fewer lines than ``points``
        gives all values. A longer file gives the minimum and the maximum of each group of lines in the order of
        occurrence, and the last value.
        """
        chosen = frozenset(names)
        places = {name: at for at, name in enumerate(self.units) if name in chosen}
        points = max(4, min(points, _SENT // max(1, len(places))))
        groups = len(self._kept[0]) // 2 if self._kept else 0
        if self._every == 1 and groups <= points:
            return {name: self._kept[at][::2].tolist() for name, at in places.items()}
        size = 2 * max(1, math.ceil(groups / max(1, points // 2 - 1)))
        return {name: self._thinned(at, size) for name, at in places.items()}

    def _thinned(self, at: int, size: int) -> list[float]:
        kept = self._kept[at]
        found = [value for k in range(0, len(kept), size) for value in extremes(kept[k : k + size])]
        return [*found, *(extremes(self._open[at]) if self._open[at] else ()), self._last[at]]


def extremes(values: Sequence[float]) -> tuple[float, float]:
    """Returns the minimum and the maximum of the values, in the order of their first occurrence. NaN values are
    ignored.
    """
    total = sum(values)
    if total != total:
        values = [value for value in values if value == value]
        if not values:
            return math.nan, math.nan
    low, high = min(values), max(values)
    return (low, high) if values.index(low) <= values.index(high) else (high, low)


def _sorted(pair: tuple[float, float]) -> tuple[float, float]:
    return (pair[0], pair[1]) if not pair[0] > pair[1] else (pair[1], pair[0])


def _numbers(texts: Sequence[str]) -> list[float]:
    try:
        return list(map(float, texts))
    except ValueError:
        return [_number(text) for text in texts]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
