"""Sweeps: one case at many points, on a server. The points from words, the handle, the table."""

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
"""s after which is looked which runs have ended. Chosen."""
_COLUMNS = {"run", "state"}
"""That the table of every sweep has."""
Point = dict[str, Any]
"""What is changed at a point, by key: ``{"parts[0].velocity[2]": "-200 m/s"}``."""


class SweepPoint(msgspec.Struct, kw_only=True, frozen=True):
    """What was changed at a point, and its run."""

    values: Point
    run: RunInfo


class SweepInfo(msgspec.Struct, kw_only=True, frozen=True):
    """What the server tells of a sweep; ``submitted`` in Unix s, ``states`` counts its runs, ``removed`` those whose
    folder is gone.
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
        """Runs that have ended without success, or were removed."""
        bad = (n for state, n in self.states.items() if State(state).final and state != State.SUCCEEDED)
        return sum(bad) + self.removed

    @property
    def over(self) -> bool:
        """True when every run has ended, or has been removed after that."""
        return sum(n for state, n in self.states.items() if State(state).final) + self.removed == self.total


class SweepPage(msgspec.Struct, kw_only=True, frozen=True):
    """Sweeps, newest first; ``next`` asks for those that are older, None where there are none."""

    sweeps: list[SweepInfo]
    next: str | None = None


@dataclass
class Sweep:
    """A sweep on a server. Nothing is asked before a method is called."""

    session: Http
    id: str

    @property
    def path(self) -> str:
        """Its place in the REST interface."""
        return f"/v1/sweeps/{quoted(self.id)}"

    def status(self) -> SweepInfo:
        """What the server knows of it now."""
        return self.session.get(SweepInfo, self.path)

    def runs(self) -> list[Run]:
        """A handle of each of its runs, in the order of the points."""
        return [Run(self.session, point.run.id) for point in self.status().points]

    def wait(
        self, timeout: float | None = None, say: Callable[[SweepInfo, SweepPoint], None] = lambda info, point: None
    ) -> SweepInfo:
        """Returns when all runs have ended. Raises TimeoutError after ``timeout`` s. ``say`` hears of each point whose
        run has ended, with what is known of all then.
        """
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        told = set[str]()
        while True:
            info = self.status()
            for point in info.points:
                if point.run.state.final and point.run.id not in told:
                    told.add(point.run.id)
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
        """Asks every run to stop; to ask twice does no harm."""
        return self.session.post(SweepInfo, f"{self.path}:cancel")

    def csv(self) -> str:
        """A line a point: what was changed, the state of the run, its results. Raises AnswerError for another text."""
        text = self.session.fetch(f"{self.path}/table").decode(errors="replace")
        if not set(next(csv.reader(io.StringIO(text)), [])) >= _COLUMNS:
            raise AnswerError(
                f"the answer of {self.session.url} is no table of a sweep: it begins with {shown(text[:40])}"
            )
        return text

    def keys(self) -> list[str]:
        """The keys that it changes."""
        return list(dict.fromkeys(key for point in self.status().points for key in point.values))

    def table(self) -> list[dict[str, str]]:
        """The lines of the table by column, as text."""
        return text_rows(self.csv())

    def frame(self) -> Any:
        """The table as a pandas.DataFrame. Raises ClientError without pandas."""
        try:
            import pandas
        except ImportError:
            raise ClientError("data frames need pandas: pip install 'conoid[tables]'") from None
        return pandas.read_csv(io.StringIO(self.csv()))

    def plot(self, out: Path | str, columns: Sequence[str] = (), x: str | None = None) -> Path:
        """Results over what was changed, as a picture: those ``columns``, or the telling ones of those that differ.

        ``x`` is the key on the axis, the first that varies when it is None; the other keys make a curve each. Raises
        ClientError.
        """
        from ..reports import curves
        from . import sweep_plot

        return curves.save(sweep_plot.figure(self.table(), self.keys(), x, columns), Path(out))


def text_rows(text: str) -> list[dict[str, str]]:
    """The lines of a table in CSV by column."""
    return list(csv.DictReader(io.StringIO(text)))


def points_of(words: Iterable[str], *, grid: bool = False) -> list[Point]:
    """The points of ``key=a,b,c``: one after the other with all keys at once, or each with each for a ``grid``.

    A key with one value has it at every point. Raises CaseError.
    """
    return points_along(axes_of(words), grid=grid, named="--set")


def axes_of(words: Iterable[str]) -> dict[str, list[Any]]:
    """The values of each key of ``key=a,b,c``. Raises CaseError."""
    axes = [_axis(word) for word in words]
    if not axes:
        raise CaseError([Problem("--set", "", "write at least one key with its values, such as run.ranks=1,2")])
    _once("--set", (key for key, _ in axes), "write all values of a key at once, such as run.ranks=1,2")
    return dict(axes)


def points_along(axes: Mapping[str, Iterable[Any]], *, grid: bool = False, named: str = "points") -> list[Point]:
    """The points of the values of each key: one after the other with all keys at once, or each with each for a
    ``grid``; a list of one value holds at every point. ``named``: what errors call them. Raises CaseError.
    """
    lists = {key: _values(key, values, named) for key, values in axes.items()}
    if grid:
        rows: Iterable[tuple[Any, ...]] = itertools.product(*lists.values())
    else:
        most = max((len(values) for values in lists.values()), default=0)
        lists = {key: values * most if len(values) == 1 else values for key, values in lists.items()}
        counts = {key: len(values) for key, values in lists.items()}
        if len(set(counts.values())) > 1:
            told = ", ".join(f"{key} has {n}" for key, n in counts.items())
            raise CaseError([Problem(named, "", f"as many values for each key, or a grid: {told}")])
        rows = zip(*lists.values(), strict=True)
    return [dict(zip(lists, row, strict=True)) for row in rows]


def _values(key: str, values: Any, named: str) -> list[Any]:
    """The values of a key as a list; arrays are sequences, too. Raises CaseError for one value, a text among them."""
    if isinstance(values, Iterable) and not isinstance(values, str | bytes | Mapping):
        return list(values.tolist() if hasattr(values, "tolist") else values)
    message = f"{key} has one value; write a list of values, such as [{values!r}]"
    raise CaseError([Problem(named, shown(values), message)])


def listed(points: Any) -> list[Point]:
    """The points as they are sent, each a mapping of keys to values. Raises CaseError."""
    found: list[Any] = [points] if isinstance(points, str) or not isinstance(points, Iterable) else list(points)
    told = "a point is a mapping of keys to values, such as {'run.ranks': 2}"
    wrong = [
        Problem(f"points[{n}]", shown(point), told) for n, point in enumerate(found) if not isinstance(point, Mapping)
    ]
    if wrong:
        raise CaseError(wrong)
    return [dict(point) for point in found]


def points_in(path: Path) -> list[Point]:
    """The points in a CSV file: its first line has the keys. Raises CaseError."""
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
    """Raises CaseError for a key that is given twice: which of its values was meant, nobody knows."""
    twice = [key for key, times in Counter(keys).items() if times > 1]
    if twice:
        raise CaseError(Problem(named, repr(key), f"is given more than once; {allowed}") for key in twice)


def value_of(text: str) -> Any:
    """A value as TOML has it, or as text."""
    return apply_overrides({}, [f"value={text.strip()}"])["value"]


def _axis(word: str) -> tuple[str, list[Any]]:
    key, equals, text = word.partition("=")
    values = [value_of(part) for part in _parts(text)]
    if not equals or not values:
        raise CaseError([Problem("--set", repr(word), "write a key and its values, such as run.ranks=1,2")])
    return key.strip(), values


def _parts(text: str) -> list[str]:
    """What stands between the commas that are in no list and no quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote or letter in "\"'":
            quote = "" if letter == quote else quote or letter
        depth += (letter in "[{") - (letter in "]}") if not quote else 0
        if letter == "," and not depth and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return [part for part in parts if part.strip()]
