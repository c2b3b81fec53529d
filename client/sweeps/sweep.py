"""Sweeps: one case at many points on a server. The module reads points from text, controls a sweep, and reads its
table.
"""

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
"""Pause between two checks for finished runs, s (chosen value)."""
_COLUMNS = {"run", "state"}
"""Columns that the table of every sweep has."""
Point = dict[str, Any]
"""Values of the changed keys at a point, such as ``{"parts[0].velocity[2]": "-200 m/s"}``."""


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
        """True if every run of the sweep has ended or was removed after its end."""
        return sum(n for state, n in self.states.items() if State(state).final) + self.removed == self.total


class SweepPage(msgspec.Struct, kw_only=True, frozen=True):
    """A page of the list of sweeps, newest first. ``next`` is the cursor of the page with older sweeps; None on the
    last page.
    """

    sweeps: list[SweepInfo]
    next: str | None = None


@dataclass
class Sweep:
    """A sweep on a server. Only the methods send requests."""

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
        """Returns the runs of the sweep in the order of the points."""
        return [Run(self.session, point.run.id) for point in self.status().points]

    def wait(
        self,
        timeout: float | None = None,
        say: Callable[[SweepInfo, SweepPoint], None] = lambda info, point: None,
        at: Callable[[SweepInfo], None] = lambda info: None,
    ) -> SweepInfo:
        """Waits until all runs of the sweep have ended. Raises TimeoutError after ``timeout`` s. ``say`` is called
        with the state of the sweep for each point whose run has ended, ``at`` with every state that was read.
        """
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        announced = set[str]()
        while True:
            info = self.status()
            at(info)
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
        """Cancels all runs of the sweep. A second call of ``cancel`` has no further effect."""
        return self.session.post(SweepInfo, f"{self.path}:cancel")

    def csv(self) -> str:
        """Returns the table of the sweep as CSV, one line for each point: changed keys, state of the run, results.
        Raises AnswerError if the server answers with another text.
        """
        text = self.session.fetch(f"{self.path}/table").decode(errors="replace")
        if not set(next(csv.reader(io.StringIO(text)), [])) >= _COLUMNS:
            raise AnswerError(
                f"the answer of {self.session.url} is not the table of a sweep; the answer begins with "
                f"{shown(text[:40])}"
            )
        return text

    def keys(self) -> list[str]:
        """Returns the keys that the sweep changes."""
        return list(dict.fromkeys(key for point in self.status().points for key in point.values))

    def table(self) -> list[dict[str, str]]:
        """Returns the rows of the table; a row maps column titles to texts."""
        return text_rows(self.csv())

    def frame(self) -> Any:
        """Returns the table as a pandas.DataFrame. Raises ClientError if pandas is not installed."""
        try:
            import pandas
        except ImportError:
            raise ClientError("data frames need pandas: pip install 'conoid[tables]'") from None
        return pandas.read_csv(io.StringIO(self.csv()))

    def plot(self, out: Path | str, columns: Sequence[str] = (), x: str | None = None) -> Path:
        """Draws results over the changed keys. ``columns`` are the results to draw; the default is the most informative
        columns whose values differ.

        ``x`` is the key on the horizontal axis; the default is the first key that varies. Each combination of the
        other keys has a curve. Raises ClientError.
        """
        from ..reports import curves
        from . import sweep_plot

        return curves.save(sweep_plot.figure(self.table(), self.keys(), x, columns), Path(out))


def text_rows(text: str) -> list[dict[str, str]]:
    """Returns the rows of a CSV table; a row maps column titles to texts."""
    return list(csv.DictReader(io.StringIO(text)))


def points_of(words: Iterable[str], *, grid: bool = False) -> list[Point]:
    """Returns the points of texts such as ``key=a,b,c``. All keys change together from point to point; with
    ``grid``, all values of all keys are combined. A key with one value has this value at every point. Raises
    CaseError.
    """
    return points_along(axes_of(words), grid=grid, named="--set")


def axes_of(words: Iterable[str]) -> dict[str, list[Any]]:
    """Returns the values of each key from texts such as ``key=a,b,c``. Raises CaseError."""
    axes = [_axis(word) for word in words]
    if not axes:
        raise CaseError([Problem("--set", "", "write at least one key with its values, such as run.ranks=1,2")])
    _once("--set", (key for key, _ in axes), "write all values of a key at once, such as run.ranks=1,2")
    return dict(axes)


def points_along(axes: Mapping[str, Iterable[Any]], *, grid: bool = False, named: str = "points") -> list[Point]:
    """Returns the points for lists of values by key. All keys change together from point to point; with ``grid``,
    all values of all keys are combined. A list with one value applies to every point. ``named``: name of the input
    in error messages. Raises CaseError.
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
            raise CaseError([Problem(named, "", f"all keys need the same number of values, or use a grid: {lengths}")])
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
    """Returns points in the form in which they are sent; each point maps keys to values. Raises CaseError."""
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
            raise CaseError(
                [Problem("--list", named, f"the columns are separated by {name}; separate columns by commas")]
            )
    if not lines or not all(keys) or any(len(line) != len(keys) for line in lines):
        raise CaseError([Problem("--list", named, "expected: a line with keys, then lines with a value for each key")])
    _once("--list", keys, f"each column of {named} must have a different key")
    return [dict(zip(keys, map(value_of, line), strict=True)) for line in lines]


def _once(named: str, keys: Iterable[str], allowed: str) -> None:
    """Raises CaseError for a key that occurs twice, because the intended value is unknown."""
    twice = [key for key, times in Counter(keys).items() if times > 1]
    if twice:
        raise CaseError(Problem(named, repr(key), f"is given more than once; {allowed}") for key in twice)


def value_of(text: str) -> Any:
    """Returns the TOML value of a text, or the text itself if it is not TOML."""
    return apply_overrides({}, [f"value={text.strip()}"])["value"]


def _axis(word: str) -> tuple[str, list[Any]]:
    key, _, text = word.partition("=")
    parts = _parts(text)
    if not all(part.strip() for part in (key, *parts)):
        raise CaseError([Problem("--set", repr(word), "write a key with its values, such as run.ranks=1,2")])
    return key.strip(), [value_of(part) for part in parts]


def _parts(text: str) -> list[str]:
    """Returns the texts between commas. Commas inside of lists and quotes do not separate."""
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
