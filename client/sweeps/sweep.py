"""Sweeps: one case at many points, on a server. Points parsed from text, the handle of a sweep, and its table."""

import csv
import io
import itertools
import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec

from conoid.cases.load import CaseError, Problem, apply_overrides
from conoid.cases.reading import whole
from conoid.cases.reading.problems import shown
from conoid.cases.run import State

from ..errors import AnswerError, ClientError
from ..local.safe_paths import quoted
from ..remote.http import Http
from ..remote.run_info import ID, RunInfo
from ..run import Run

_LOOK = 2.0
"""Time between two checks for ended runs, s. Chosen value."""
_COLUMNS = {"run", "state"}
"""Columns that the table of each sweep has."""
Point = dict[str, Any]
"""Changed keys of a point with their values: ``{"parts[0].velocity[2]": "-200 m/s"}``."""


class SweepPoint(msgspec.Struct, kw_only=True, frozen=True):
    """Changed keys of a point, and the run of the point."""

    values: Point
    run: RunInfo


class SweepInfo(msgspec.Struct, kw_only=True, frozen=True):
    """State of a sweep on the server. ``submitted`` is in Unix s, ``states`` has the number of runs in each state,
    ``removed`` is the number of runs whose folder was removed.
    """

    id: Annotated[str, msgspec.Meta(pattern=ID)]
    name: str
    submitted: float
    total: int
    states: dict[str, int]
    at_once: int | None = None
    removed: int = 0
    points: list[SweepPoint] = []

    @property
    def failed(self) -> int:
        """Number of runs that have ended without success or were removed."""
        bad = (n for state, n in self.states.items() if State(state).final and state != State.SUCCEEDED)
        return sum(bad) + self.removed

    @property
    def over(self) -> bool:
        """True if every run has ended or was removed after its end."""
        return sum(n for state, n in self.states.items() if State(state).final) + self.removed == self.total


class SweepPage(msgspec.Struct, kw_only=True, frozen=True):
    """Sweeps, newest first; ``next`` requests the page of older sweeps, None on the last page."""

    sweeps: list[SweepInfo]
    next: str | None = None


@dataclass
class Sweep:
    """Handle of a sweep on a server. A request is sent only when a method is called."""

    session: Http
    id: str

    @property
    def path(self) -> str:
        """Path of the sweep in the REST interface."""
        return f"/v1/sweeps/{quoted(self.id)}"

    def status(self) -> SweepInfo:
        """Returns the present state of the sweep on the server."""
        return self.session.get(SweepInfo, self.path)

    def runs(self) -> list[Run]:
        """Returns a handle of each run of the sweep, in the order of the points."""
        return [Run(self.session, point.run.id) for point in self.status().points]

    def wait(
        self, timeout: float | None = None, say: Callable[[SweepInfo, SweepPoint], None] = lambda info, point: None
    ) -> SweepInfo:
        """Returns when all runs have ended. Raises TimeoutError after ``timeout`` s. ``say`` receives the state of
        the sweep and each point whose run has ended.
        """
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        announced = set[str]()
        while True:
            info = self.status()
            for point in info.points:
                if point.run.state.final and point.run.id not in announced:
                    announced.add(point.run.id)
                    say(info, point)
            left = [point for point in info.points if not point.run.state.final]
            if not left:
                return info
            first = Run(self.session, left[0].run.id)
            with suppress(TimeoutError):
                first.wait(min(_LOOK, max(0.0, deadline - time.monotonic())))
            if time.monotonic() >= deadline:
                raise TimeoutError(f"sweep {self.id}: {len(left)} of {info.total} runs have not ended")

    def cancel(self) -> SweepInfo:
        """Cancels all runs. A second call has no further effect."""
        return self.session.post(SweepInfo, f"{self.path}:cancel")

    def csv(self) -> str:
        """Returns the table as CSV with a line for each point: changed keys, state of the run, results. Raises
        AnswerError for another text.
        """
        text = self.session.fetch(f"{self.path}/table").decode(errors="replace")
        if not set(next(csv.reader(io.StringIO(text)), [])) >= _COLUMNS:
            raise AnswerError(
                f"the answer of {self.session.url} is no table of a sweep: it begins with {shown(text[:40])}"
            )
        return text

    def keys(self) -> list[str]:
        """Returns the keys that the sweep changes."""
        return list(dict.fromkeys(key for point in self.status().points for key in point.values))

    def table(self) -> list[dict[str, str]]:
        """Returns the lines of the table by column, as text."""
        return text_rows(self.csv())

    def frame(self) -> Any:
        """Returns the table as a pandas.DataFrame. Raises ClientError without pandas."""
        try:
            import pandas
        except ImportError:
            raise ClientError("data frames need pandas: pip install 'conoid[tables]'") from None
        return pandas.read_csv(io.StringIO(self.csv()))

    def plot(self, out: Path | str, columns: Sequence[str] = (), x: str | None = None) -> Path:
        """Draws results over the changed keys. ``columns`` are the drawn results; the default is the most informative
        columns whose values differ.

        ``x`` is the key on the axis; the default is the first key that varies. Each combination of the other keys
        has a curve. Raises ClientError.
        """
        from ..reports import curves
        from . import sweep_plot

        return curves.save(sweep_plot.figure(self.table(), self.keys(), x, columns), Path(out))


def text_rows(text: str) -> list[dict[str, str]]:
    """Returns the lines of a table in CSV by column."""
    return list(csv.DictReader(io.StringIO(text)))


def points_of(words: Iterable[str], *, grid: bool = False) -> list[Point]:
    """Returns the points of ``key=a,b,c``. All keys change together from point to point; with ``grid``, all values
    of all keys are combined. A key with one value has this value at every point. Raises CaseError.
    """
    return points_along(axes_of(words), grid=grid, named="--set")


def axes_of(words: Iterable[str]) -> dict[str, list[Any]]:
    """Returns the values of each key of ``key=a,b,c``. Raises CaseError."""
    axes = [_axis(word) for word in words]
    if not axes:
        raise CaseError([Problem("--set", "", "write at least one key with its values, such as run.ranks=1,2")])
    _once("--set", (key for key, _ in axes), "write all values of a key at once, such as run.ranks=1,2")
    return dict(axes)


def points_along(axes: Mapping[str, Iterable[Any]], *, grid: bool = False, named: str = "points") -> list[Point]:
    """Returns the points for lists of values by key. All keys change together from point to point; with ``grid``,
    each value is combined with each. A list of one value applies to every point. ``named``: name of the input in
    error messages. Raises CaseError.
    """
    lists = {key: _values(key, values, named) for key, values in axes.items()}
    if grid:
        rows: Iterable[tuple[Any, ...]] = itertools.product(*lists.values())
    else:
        most = max((len(values) for values in lists.values()), default=0)
        lists = {key: values * most if len(values) == 1 else values for key, values in lists.items()}
        counts = {key: len(values) for key, values in lists.items()}
        if len(set(counts.values())) > 1:
            lengths = ", ".join(f"{key} has {n}" for key, n in counts.items())
            raise CaseError([Problem(named, "", f"as many values for each key, or a grid: {lengths}")])
        rows = zip(*lists.values(), strict=True)
    return [dict(zip(lists, row, strict=True)) for row in rows]


def _values(key: str, values: Any, named: str) -> list[Any]:
    """Returns the values of a key as a list; arrays count as sequences. Raises CaseError for a single value or a
    text.
    """
    if isinstance(values, Iterable) and not isinstance(values, str | bytes | Mapping):
        return list(values.tolist() if hasattr(values, "tolist") else values)
    message = f"{key} has one value; write a list of values, such as [{values!r}]"
    raise CaseError([Problem(named, shown(values), message)])


def listed(points: Any) -> list[Point]:
    """Returns the points in the form in which they are sent, each a mapping of keys to values. Raises CaseError."""
    found: list[Any] = [points] if isinstance(points, str) or not isinstance(points, Iterable) else list(points)
    hint = "a point is a mapping of keys to values, such as {'run.ranks': 2}"
    wrong = [
        Problem(f"points[{n}]", shown(point), hint) for n, point in enumerate(found) if not isinstance(point, Mapping)
    ]
    if wrong:
        raise CaseError(wrong)
    return [dict(point) for point in found]


def points_in(path: Path) -> list[Point]:
    """Returns the points in a CSV file whose first line has the keys. Raises CaseError."""
    named = repr(str(path))
    try:
        text = whole.read_text(path).removeprefix("\ufeff")
        head, *lines = [line for line in csv.reader(io.StringIO(text)) if line] or [[]]
    except OSError as error:
        raise CaseError([Problem("--list", named, str(error.strerror))]) from None
    except UnicodeDecodeError:
        raise CaseError([Problem("--list", named, "not UTF-8 text")]) from None
    except csv.Error as error:
        raise CaseError([Problem("--list", named, f"not a table: {error}")]) from None
    keys = [key.strip() for key in head]
    for sign, name in ((";", "semicolons"), ("\t", "tabs")):
        if any(sign in key for key in keys):
            raise CaseError([Problem("--list", named, f"its columns are parted by {name}; write commas between them")])
    if not lines or not all(keys) or any(len(line) != len(keys) for line in lines):
        raise CaseError([Problem("--list", named, "a line of keys, then lines with a value for each")])
    _once("--list", keys, f"each column of {named} has a key of its own")
    return [dict(zip(keys, map(value_of, line), strict=True)) for line in lines]


def _once(named: str, keys: Iterable[str], allowed: str) -> None:
    """Raises CaseError for a key that is given twice: the intended value is not known."""
    twice = [key for key, times in Counter(keys).items() if times > 1]
    if twice:
        raise CaseError(Problem(named, repr(key), f"is given more than once; {allowed}") for key in twice)


def value_of(text: str) -> Any:
    """Returns a TOML value, or the text itself if it is not TOML."""
    return apply_overrides({}, [f"value={text.strip()}"])["value"]


def _axis(word: str) -> tuple[str, list[Any]]:
    key, _, text = word.partition("=")
    parts = _parts(text)
    if not all(part.strip() for part in (key, *parts)):
        raise CaseError([Problem("--set", repr(word), "write a key and its values, such as run.ranks=1,2")])
    return key.strip(), [value_of(part) for part in parts]


def _parts(text: str) -> list[str]:
    """Returns the texts between commas. Commas in lists and in quotes do not separate."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote or letter in "\"'":
            quote = "" if letter == quote else quote or letter
        depth += (letter in "[{") - (letter in "]}") if not quote else 0
        if letter == "," and not depth and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return parts
