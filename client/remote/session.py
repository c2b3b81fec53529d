"""A session with a server: the operations of its API."""

import re
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice, takewhile
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlencode

import httpx2
import msgspec

from conoid.cases.load import CaseError, Overrides, Problem
from conoid.cases.reading.problems import shown

from ..errors import MissingError, NotFoundError, ServiceError, UsageError
from ..local.safe_paths import quoted
from ..run import Run
from ..sweeps.adaptive import MOST, found_by
from ..sweeps.adaptive_result import Found
from ..sweeps.goal import span_of
from ..sweeps.sweep import Point, Sweep, SweepInfo, SweepPage, listed, points_along
from .config import target
from .http import NOT_FOUND, Http
from .outbox import SURVEY, Outbox, place_of
from .rows import RunRow, TablePage, rows_of
from .run_info import ID, RunInfo
from .run_query import Moment, query_of, words_of
from .submission import CaseSource, data_of, to_json

_CANDIDATES = 8
"""Largest number of ids that are listed for an ambiguous prefix (chosen value: as many as fit into one text line)."""
_LAST = "z" * 22
"""Text that, appended to a prefix of an id, sorts after every id with this prefix."""
_MOST_PAGES = 10_000
"""Largest number of pages of a list (chosen value: a list of a million runs; a longer list is an error of the
server)."""
_POINT = 0.5
"""Time, s, for each point of a sweep. The server reads, checks and writes all points to disk before it answers (chosen
value: ten times the time on two cores at a load of 4).
"""
_PAGE = 500
"""Number of rows of a page of the table of runs: the largest number that a server sends."""
_READING, _REST = 60.0, 0.2
"""Time limit for results that the server has not read yet, and pause between two requests, s (chosen values)."""


class _Known(Protocol):
    """The id of a run or a sweep in a list of the server."""

    @property
    def id(self) -> str:
        """Id of the run or the sweep."""


class Verdict(msgspec.Struct, kw_only=True, frozen=True):
    """Answer of the server to the check of a case."""

    valid: bool
    problems: list[dict[str, str]] = []
    estimate: dict[str, Any] = {}


class Page(msgspec.Struct, kw_only=True, frozen=True):
    """A page of the list of runs; ``next``: cursor of the next page."""

    runs: list[RunInfo]
    next: str | None = None


class Session(Http):
    """A session with a server. A ``Session`` is a context manager; without a ``with`` statement, call ``close``."""

    def __init__(self, url: str, token: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        """Accepts the arguments of ``Http``."""
        super().__init__(url, token, transport)
        self.outbox = Outbox(self)
        """Uploader of the files that cases name."""

    def validate(self, case: CaseSource, overrides: Overrides = (), folder: Path | str | None = None) -> dict[str, Any]:
        """Checks a case on the server, and returns the estimate of its needs. ``folder``: folder to which paths in
        the case are relative. Raises CaseError with every problem.
        """
        kind, body, more = self.outbox.body(case, overrides, folder)
        answer = self.post(Verdict, "/v1/cases:validate", body, kind, more=more)
        if not answer.valid:
            raise CaseError(Problem(one["key"], one["value"], one["message"]) for one in answer.problems)
        return answer.estimate

    def submit(
        self,
        case: CaseSource,
        overrides: Overrides = (),
        key: str | None = None,
        labels: Mapping[str, str] | None = None,
        profile: str = "",
        priority: int = 0,
        folder: Path | str | None = None,
    ) -> Run:
        """Submits a case: a file, the name of a shipped case, or plain data.

        Files that the case names are sent first if the server lacks them. Relative paths are relative to ``folder``;
        its default is the folder of the case file, or the working folder for plain data. ``overrides`` change keys:
        ``["run.ranks=2"]``, ``{"run.ranks": 2}``. ``key`` is the idempotency key. The default is a random key, so
        that a retry never makes a second run. ``labels`` are names and values with which runs can be found,
        ``profile`` is a profile of the site's batch system. Among the runs of a user, runs with a higher
        ``priority`` start first. Raises CaseError, ServiceError, UnreachableError.
        """
        kind, body, more = self.outbox.body(case, overrides, folder)
        words = [("label", word) for word in words_of(labels)]
        words += [("profile", profile)] if profile else []
        words += [("priority", str(priority))] if priority else []
        path = f"/v1/runs?{urlencode(words)}" if words else "/v1/runs"
        return Run(self, self.post(RunInfo, path, body, kind, key or str(uuid.uuid4()), more).id)

    def restart(
        self, run: str, ranks: int | None = None, key: str | None = None, profile: str = "", priority: int = 0,
        threads: int | None = None, max_steps: int | None = None,
    ) -> Run:  # fmt: skip
        """Submits a new run of the same case that continues from the newest checkpoint of ``run``.

        ``ranks``, ``threads`` and ``max_steps`` (``run.max_steps``) replace values of the case. The final answer is
        the same as that of a run without interruption. Raises ServiceError if ``run`` has no checkpoint. Raises
        ServiceError if ``run`` has used all its steps and ``max_steps`` is not larger.
        """
        numbers = {"ranks": ranks, "threads": threads, "max_steps": max_steps}
        words = {name: str(number) for name, number in numbers.items() if number is not None}
        words |= {name: str(value) for name, value in (("profile", profile), ("priority", priority)) if value}
        path = f"/v1/runs/{quoted(run)}:restart?{urlencode(words)}"
        return Run(self, self.post(RunInfo, path, key=key or str(uuid.uuid4()), more=SURVEY).id)

    def sweep(
        self, case: CaseSource, points: Sequence[Point] | Mapping[str, Iterable[Any]], at_once: int | None = None,
        key: str | None = None, *, grid: bool = False, folder: Path | str | None = None, again: bool = False,
    ) -> Sweep:  # fmt: skip
        """Submits a case at many points; each point maps keys to values. Either all points become runs or none.

        A mapping of keys to lists of equal lengths gives one point for each position. With ``grid`` it gives all
        combinations. At most ``at_once`` runs are computed at the same time. ``key`` is the idempotency key: the
        same key is the same sweep. With ``again``, points of this sweep without success run again. ``folder``:
        folder to which paths are relative. Raises CaseError, ServiceError.
        """
        chosen = listed(points_along(points, grid=grid) if isinstance(points, Mapping) else points)
        data, sent, more = self.outbox.sweep(case, chosen, folder)
        body = to_json({"case": data, "points": sent, "at_once": at_once})
        kind, more = "application/json", more + _POINT * len(chosen)
        made = self.post(SweepInfo, "/v1/sweeps", body, kind, key or str(uuid.uuid4()), more)
        if again and made.failed:
            made = self.post(SweepInfo, f"/v1/sweeps/{quoted(made.id)}:again", body, kind, more=more)
        return Sweep(self, made.id)

    def adaptive_sweep(
        self, case: CaseSource, spans: Mapping[str, Sequence[Any]], goal: str, tolerance: Any = None, *,
        overrides: Overrides = (), at_once: int | None = None, most: int = MOST, out: Path | str | None = None,
        folder: Path | str | None = None, say: Callable[[str], None] = lambda text: None,
    ) -> Found:  # fmt: skip
        """Runs an adaptive sweep: it finds where a result crosses a threshold.

        ``goal``: result and threshold, such as ``"probe.core_speed = 0"``; the result is a column of the table of a
        sweep. ``spans`` has the keys that vary together, with both ends of each key: ``{"parts[0].velocity[2]": ("-200
        m/s", "-800 m/s")}``.

        At most ``most`` runs are made, ``at_once`` at the same time (None: as many as slots are free), until the
        bracket of the threshold has the width ``tolerance``. The tolerance is a quantity of the first key; the
        default is a hundredth of the larger end of the bracket. ``out`` is a JSON file from which a later call
        continues without repeating successful points. ``say`` is called with a text line for each run. Raises
        CaseError, UsageError if ``out`` belongs to another sweep, ClientError.
        """
        data = data_of(case, overrides)
        return found_by(
            self, data, place_of(case, folder), goal, [span_of(key, ends) for key, ends in spans.items()], tolerance,
            at_once, most, None if out is None else Path(out), say,
        )  # fmt: skip

    def sweeps(self) -> list[SweepInfo]:
        """Returns the sweeps of the user, newest first, without their points."""
        return list(self._sweeps())

    def _sweeps(self, beginning: str = "") -> Iterator[SweepInfo]:
        """Yields the sweeps whose ids begin with a prefix, newest first."""
        query = {"before": beginning + _LAST} if beginning else {}
        for _ in range(_MOST_PAGES):
            page = self.get(SweepPage, "/v1/sweeps", limit=500, **query)
            yield from page.sweeps
            if page.next is None:
                return
            query = {"before": page.next}
        raise self.endless("sweeps")

    def find_sweep(self, sweep_id: str) -> Sweep:
        """Returns a sweep by its id or by a unique prefix of the id; ``last`` means the newest sweep. Raises
        NotFoundError if the sweep is unknown, UsageError if the prefix is ambiguous.
        """
        if sweep_id == "last":
            newest = next(self._sweeps(), None)
            if newest is None:
                raise NotFoundError("there is no sweep yet")
            return Sweep(self, newest.id)
        return Sweep(self, self._named("sweep", "/v1/sweeps", sweep_id, self._sweeps))

    def run(self, run_id: str) -> Run:
        """Returns a run by its id or by a unique prefix of the id; ``last`` means the newest run. Raises
        NotFoundError if the run is unknown, UsageError if the prefix is ambiguous.
        """
        if run_id == "last":
            newest = self.runs(limit=1)
            if not newest:
                raise NotFoundError("there is no run yet")
            return Run(self, newest[0].id)
        return Run(self, self._named("run", "/v1/runs", run_id, self._beginning))

    def _beginning(self, beginning: str) -> Iterable[RunInfo]:
        return self.get(Page, "/v1/runs", limit=_CANDIDATES + 1, prefix=beginning).runs

    def _named(self, what: str, path: str, name: str, after: Callable[[str], Iterable[_Known]]) -> str:
        """Returns the id that begins with the prefix ``name``. ``after``: function that returns runs or sweeps,
        sorted by id, from a prefix on.
        """
        if not re.fullmatch(ID, name):
            raise NotFoundError(f"{what} {shown(name)}: not found; an id has letters and digits")
        try:
            self.get(dict[str, Any], f"{path}/{quoted(name)}")
        except MissingError as error:
            if error.status != NOT_FOUND:
                raise
            found = self._candidates(name, after)
            if not found:
                raise
        else:
            return name
        if len(found) > 1:
            more = " and more" if len(found) > _CANDIDATES else ""
            raise UsageError(
                f"{what} = {name!r}: several ids have this beginning: {', '.join(found[:_CANDIDATES])}{more}"
            )
        return found[0]

    def _candidates(self, name: str, after: Callable[[str], Iterable[_Known]]) -> list[str]:
        """Returns some ids with the prefix ``name``; an empty list if the server is too old for this request."""
        try:
            named = takewhile(lambda one: one.id.startswith(name), after(name))
            return [one.id for one in islice(named, _CANDIDATES + 1)]
        except ServiceError:
            return []

    def runs(
        self, states: Sequence[str] = (), limit: int = 50, labels: Mapping[str, str] | None = None, *, case: str = "",
        text: str = "", since: Moment = None, until: Moment = None,
    ) -> list[RunInfo]:  # fmt: skip
        """Returns at most ``limit`` runs of the user, newest first.

        ``labels``: a run must have all these labels. ``case``: name of the case, with ``*`` for any characters.
        ``text``: words that must all occur in name, title, labels, state or message of a run, or begin its id.
        ``since`` and ``until``: limits of the time of submission, Unix s or a datetime.
        """
        found: list[RunInfo] = []
        query = query_of(states, labels, case, text, since, until)
        for _ in range(_MOST_PAGES):
            page = self.get(Page, "/v1/runs", limit=min(100, limit - len(found)), **query)
            found += page.runs
            if page.next is None or len(found) >= limit:
                return found[:limit]
            query["cursor"] = page.next
        raise self.endless("runs")

    def table(
        self, states: Sequence[str] = (), limit: int = 50, labels: Mapping[str, str] | None = None, *, case: str = "",
        text: str = "", since: Moment = None, until: Moment = None,
    ) -> list[RunRow]:  # fmt: skip
        """Returns runs with the values of their cases and their results, in SI units. The arguments are those of
        ``runs``."""
        found: list[RunRow] = []
        query = query_of(states, labels, case, text, since, until)
        for _ in range(_MOST_PAGES):
            page = self._table(min(_PAGE, limit - len(found)), query)
            found += rows_of(page)
            if page.next is None or len(found) >= limit:
                return found[:limit]
            query["cursor"] = page.next
        raise self.endless("runs")

    def _table(self, limit: int, query: Mapping[str, Any]) -> TablePage:
        """Returns a page of the table of runs. Repeats the request for a limited time while the server is still
        reading results.
        """
        until = time.monotonic() + _READING
        while (page := self.get(TablePage, "/v1/table", limit=limit, **query)).pending and time.monotonic() < until:
            time.sleep(_REST)
        return page


def connect(url: str | None = None, token: str | None = None) -> Session:
    """Opens a session with a server. Address and token are the arguments, else CONOID_URL and CONOID_TOKEN, else
    those of the configuration file.
    """
    chosen = target(url, token)
    return Session(chosen.url, chosen.token)
