"""Result of an adaptive sweep, and the file that stores the result. A later command with the same file continues the
sweep.
"""

from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.figures import counted, duration, number
from conoid.cases.output import history, points
from conoid.cases.reading import whole

from ..errors import ClientError, UsageError
from ..local.atomic import save_text
from ..reports.compare import changes
from .ballistic import Fit
from .goal import Goal


class Tried(msgspec.Struct, kw_only=True, frozen=True):
    """A point of an adaptive sweep. ``x`` is the value of the first key, ``values`` are the changed keys, ``f`` is
    ``value`` minus the threshold, ``cpu`` is in s. If the point has no result, ``problem`` is the reason.
    """

    x: float
    values: dict[str, Any]
    run: str
    state: str
    value: float | None = None
    f: float | None = None
    cpu: float = 0.0
    problem: str = ""
    results: dict[str, int | float | str | None] = {}
    """Results of the run; the keys are the columns of the table of a sweep."""

    def but(self, **changes: Any) -> "Tried":
        """Returns a copy of the point with some fields changed."""
        return msgspec.structs.replace(self, **changes)


class Found(msgspec.Struct, kw_only=True, frozen=True):
    """Result of the search: the result of the runs crosses the threshold at the value ``limit`` +- ``uncertainty``
    of the key; the uncertainty is half of the width of the bracket. ``ends`` are key and result at the ends of the
    bracket, or at the ends of the range if ``limit`` is None.
    """

    key: str
    unit: str
    goal: Goal
    tolerance: float
    ends: Sequence[tuple[float, float | None]] = ()
    limit: float | None = None
    uncertainty: float | None = None
    fit: Fit | None = None
    changes: int = 0
    """Number of times that the result crosses the threshold."""
    mixed: tuple[float, float] | None = None
    """Interval of the key in which the result crosses the threshold several times."""
    why: str = ""
    """Reason why the search ended before it reached the tolerance."""
    points: int
    """Number of runs, including the runs of earlier commands; ``failed`` is the number of runs without a result."""
    fresh: int
    """Number of runs that this command has made."""
    failed: int
    cpu: float
    """CPU time of all runs, s."""

    def but(self, **changes: Any) -> "Found":
        """Returns a copy of the result with some fields changed."""
        return msgspec.structs.replace(self, **changes)

    @property
    def reached(self) -> bool:
        """True if the bracket is as narrow as the tolerance."""
        return self.limit is not None and not self.why

    @property
    def unsettled(self) -> str:
        """Reason why the bracket is wider than the tolerance; empty if the tolerance is reached."""
        return self.why or ("" if self.limit is not None else "the result does not cross the threshold in the range")

    def lines(self) -> list[str]:
        """Returns the result of the search as text lines for the terminal."""
        text = [self._first(), *self._passes()]
        if self.fit is not None:
            text.append(_curve(self.fit, self.unit))
            if not self._within(self.fit.limit):
                text.append(
                    "the limit of the fitted curve lies outside of the bracket, because the results near the "
                    "bracket do not follow the law"
                )
        if self.why:
            text.append(f"bracket wider than requested ({self._x(self.tolerance)}): {self.why}")
        failed = f", {self.failed} without a result" if self.failed else ""
        text.append(
            f"{counted(self.points, 'run')}{failed}, {self.fresh} in this command; {duration(self.cpu)} of CPU time"
        )
        return text

    def _first(self) -> str:
        passes = f"{self.goal.result} = {number(self.goal.threshold)} {self.goal.unit}".strip()
        ends = " and ".join(f"{self._y(value)} at {self._x(x)}" for x, value in self.ends)
        if self.limit is None or self.uncertainty is None:
            return f"{self.key}: no {passes} in the range: {self.goal.result} is {ends}"
        return f"{self.key} = {number(self.limit)} +- {self._x(self.uncertainty)} where {passes}: {ends}"

    def _passes(self) -> list[str]:
        if self.mixed is None:
            return []
        a, b = self.mixed
        again = f"crossed {self.changes} times between {number(min(a, b))} and {self._x(max(a, b))}"
        return [f"the result is not monotonic, or it scatters: the threshold is {again}; the first crossing is given"]

    def _within(self, limit: float) -> bool:
        """True if the limit of the fitted curve lies in the bracket. The limit of a law of velocities is a
        magnitude.
        """
        low, high = sorted(abs(x) for x, _ in self.ends)
        return low <= abs(limit) <= high

    def _x(self, x: float) -> str:
        return f"{number(x)} {self.unit}".strip()

    def _y(self, value: float | None) -> str:
        return "not known" if value is None else f"{number(value)} {self.goal.unit}".strip()


def _curve(fit: Fit, unit: str) -> str:
    error = "" if fit.error is None else f" +- {number(fit.error)}"
    power = "" if fit.exponent is None else f", p = {number(fit.exponent)}"
    constants = f"a = {number(fit.factor)}{power}, " if fit.law != "line" else ""
    return f"{fit.law}: {number(fit.limit)}{error} {unit} ({constants}{counted(fit.points, 'point')})"


class Kept(msgspec.Struct, kw_only=True):
    """Content of the file of an adaptive sweep: version, case, goal, keys, all points and the result."""

    version: str
    case: dict[str, Any]
    goal: Goal
    keys: list[str]
    points: list[Tried] = []
    found: Found | None = None


class Book:
    """Points of an adaptive sweep, stored in a file that is written after each point. Without a path the points are
    kept only in memory.
    """

    def __init__(self, path: Path | None, case: Mapping[str, Any], goal: Goal, keys: Sequence[str]) -> None:
        """Reads the file if it exists. Raises UsageError if the file is of another kind or has another goal or
        version, ClientError if the case has changed.
        """
        self.path = path
        fresh = Kept(version=metadata.version("conoid"), case=_plain(case), goal=goal, keys=list(keys))
        self.kept = fresh
        if path is not None and path.exists():
            self.kept = read(path)
            _require_same(path, self.kept, fresh)

    def good(self) -> list[Tried]:
        """Returns the points that have a result."""
        return [each for each in self.kept.points if each.f is not None]

    def add(self, tried: Tried) -> None:
        """Adds a point, which replaces an earlier point with the same x."""
        self.kept.points = [*(each for each in self.kept.points if each.x != tried.x), tried]
        self._write()

    def close(self, found: Found) -> Found:
        """Stores the result of the search."""
        self.kept.found = found
        self._write()
        return found

    def _write(self) -> None:
        if self.path is not None:
            save_text(self.path, msgspec.json.format(msgspec.json.encode(self.kept), indent=1) + b"\n")


def read(path: Path) -> Kept:
    """Reads the file of an adaptive sweep. Raises UsageError if the file is of another kind."""
    try:
        return msgspec.json.decode(whole.read(path), type=Kept)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    except msgspec.MsgspecError:
        raise UsageError(f"{path}: this is not a file of an adaptive sweep; choose another file with --out") from None


def _require_same(path: Path, kept: Kept, fresh: Kept) -> None:
    other = "choose another file with --out, or remove this file"
    if (kept.goal, kept.keys) != (fresh.goal, fresh.keys):
        question = f"{kept.goal.result} = {number(kept.goal.threshold)} over {', '.join(kept.keys)}"
        raise UsageError(f"{path}: contains another sweep, {question}; {other}")
    if kept.version != fresh.version:
        raise UsageError(
            f"{path}: the runs in the file are of Conoid {kept.version}, this is Conoid {fresh.version}; {other}"
        )
    if changed := changes(kept.case, fresh.case):
        raise ClientError(f"{path}: the case has changed since the first run: {changed}; {other}")


def _plain(case: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the case in the form that it has after writing and reading JSON."""
    data: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(case))
    return data


def table(kept: Kept) -> list[points.Column]:
    """Returns the table of the points, sorted by x."""
    return points.table([
        points.Point(
            values=each.values, run=each.run, state=each.state, cause=each.problem,
            results={history.split(title): value for title, value in each.results.items()},
        )
        for each in sorted(kept.points, key=lambda each: each.x)
    ])  # fmt: skip
