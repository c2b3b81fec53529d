"""Adaptive sweep: runs of a case at points that narrow the bracket in which a result crosses a threshold."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol

from conoid.cases.figures import counted, number
from conoid.cases.load import apply_overrides, parse_case
from conoid.cases.outcome import Outcome
from conoid.cases.output import history, points
from conoid.cases.run import State

from ..errors import ClientError, MissingError, UsageError
from ..remote.http import Me
from ..remote.outbox import Outbox
from ..remote.run_info import RunInfo
from ..run import Run
from .adaptive_result import Book, Found, Tried
from .bracket import Sample, between, bracket, widest
from .fitting import fitted, unfitted
from .goal import Goal, Span, changes, goal_of, tolerance_of
from .reporting import Reported, Reporter

MOST = 40
"""Largest number of runs if the user gives no number (chosen value: 20 bisections narrow a bracket to a millionth)."""
_AT_ONCE = 8
"""Largest number of points that are computed at the same time if the user gives no number (chosen value: n points
divide the bracket by n + 1, so that more points gain little)."""
_ATTEMPTS = 100
"""Largest number of attempts to compute a point."""
Say = Callable[[str], None]


class Server(Protocol):
    """Session that computes the points, with the methods of ``Session`` that an adaptive sweep calls."""

    outbox: Outbox

    def submit(
        self, case: Any, overrides: Any = (), key: str | None = None, labels: Mapping[str, str] | None = None,
        profile: str = "", priority: int = 0, folder: Path | str | None = None,
    ) -> Run:  # fmt: skip
        """See ``Session.submit``."""

    def me(self) -> Me:
        """See ``Session.me``."""

    def runs(self, states: Sequence[str] = (), limit: int = 50) -> Sequence[RunInfo]:
        """See ``Session.runs``."""

    def put(self, kind: type[Reported], path: str, body: bytes, headers: Mapping[str, str]) -> Reported:
        """See ``Session.put``."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Input of an adaptive sweep: case, goal, spans, tolerance and limits."""

    case: Mapping[str, Any]
    """The case as plain data, with the overrides that are equal for all points and the hashes of the files of the
    case."""
    folder: Path
    goal: Goal
    spans: Sequence[Span]
    """Spans of the keys that vary together; x is the value of the first key."""
    tolerance: float
    """Required width of the bracket, in the unit of the first span."""
    at_once: int | None = None
    most: int = MOST
    since: str = ""
    """Id of the newest run before this search. Ids increase with time, so that a run with a greater id belongs to
    this search."""

    @property
    def ends(self) -> tuple[float, float]:
        """Returns the smaller and the larger end of the first span."""
        span = self.spans[0]
        return min(span.low, span.high), max(span.low, span.high)


def found_by(
    session: Server, data: Mapping[str, Any], folder: Path, goal: str, spans: Sequence[Span], tolerance: Any,
    at_once: int | None, most: int, out: Path | None, say: Say, at: Say = lambda text: None,
) -> Found:  # fmt: skip
    """Runs an adaptive sweep for a case as plain data, like ``Session.adaptive_sweep``. ``folder``: folder to which
    the paths of the case's files are relative."""
    if not spans:
        raise UsageError("spans: name at least one key that varies, with both ends of its range")
    first = apply_overrides(data, changes(spans, spans[0].low))
    wish = goal_of(goal, parse_case(first))
    ready = session.outbox.ready(data, folder)
    wanted = Search(
        case=ready, folder=folder, goal=wish, spans=spans, tolerance=tolerance_of(tolerance, spans[0]),
        at_once=at_once, most=most, since=max((run.id for run in session.runs(limit=1)), default=""),
    )  # fmt: skip
    book = Book(out, ready, wish, [span.key for span in spans])
    return book.close(search(session, wanted, book, _reporter(session, wanted), say, at))


def _reporter(session: Server, wanted: Search) -> Reporter:
    keys = [span.key for span in wanted.spans]
    name = _hash(metadata.version("conoid"), wanted.goal.result, wanted.goal.threshold, keys, wanted.case)
    case = str(wanted.case.get("name", ""))
    return Reporter(session.put, name, case, wanted.goal, wanted.spans, wanted.tolerance)


def search(session: Server, wanted: Search, book: Book, reporter: Reporter, say: Say, at: Say) -> Found:
    """Computes points until the bracket is as narrow as the tolerance, or until no further point can narrow the
    bracket. ``say`` is called with a text line for each finished run, ``at`` with a line about the present round.
    ``reporter`` sends reports to the server.

    Points of the ``book`` that have succeeded are not computed again. Each new point is written to the book at once.
    Raises CaseError if the case is not valid at an end of the range, ClientError.
    """
    for x in wanted.ends:
        parse_case(apply_overrides(wanted.case, changes(wanted.spans, x)))
    fresh: list[Tried] = []
    _report(wanted, reporter, _counted(wanted, book, fresh))
    many = wanted.at_once or _free(session, wanted.case)
    while True:
        tried = _counted(wanted, book, fresh)
        following, why = ([], _CANCELLED) if reporter.stop else _next(wanted, tried, len(fresh), many)
        if not following:
            found = _found(wanted, tried, why, len(fresh))
            _report(wanted, reporter, tried, over=True, why=found.unsettled)
            _explain(wanted, tried, found, say)
            return found
        at(f"{counted(len(following), 'run')} at {', '.join(map(number, following))} {wanted.spans[0].unit}".strip())
        for each, open_ones in _round(session, wanted, reporter, tried, following):
            fresh.append(each)
            book.add(each)
            _report(wanted, reporter, [*_counted(wanted, book, fresh), *open_ones])
            say(f"{_at(wanted, each.x)}: {_result_text(wanted, each)}; {_state(wanted, [*tried, *fresh])}")


def _explain(wanted: Search, tried: Sequence[Tried], found: Found, say: Say) -> None:
    """Calls ``say`` with the reason why the result has no fitted curve."""
    made = bracket(_samples(tried))
    if made is not None and found.fit is None:
        say(f"no fitted curve: {unfitted(wanted.goal, wanted.spans[0], _samples(tried), made)}")


def _counted(wanted: Search, book: Book, fresh: Sequence[Tried]) -> list[Tried]:
    """Returns the points of earlier commands and of this command that lie within the range, each once."""
    every = {each.x: each for each in (*book.good(), *fresh)}
    return [each for x, each in every.items() if wanted.ends[0] <= x <= wanted.ends[1]]


def _report(wanted: Search, reporter: Reporter, tried: Sequence[Tried], *, over: bool = False, why: str = "") -> None:
    ended = [each for each in tried if each.value is not None]
    made = bracket(_samples(ended))
    fit = None if made is None else fitted(wanted.goal, wanted.spans[0], _samples(ended), made)
    reporter.tell(tried, made, fit, over=over, why=why)


def _next(wanted: Search, tried: Sequence[Tried], spent: int, many: int) -> tuple[list[float], str]:
    """Returns the values of x of the next round of runs. At the end of the search the function returns no values and
    the reason of the end.
    """
    low, high = wanted.ends
    left = wanted.most - spent
    taken = [each.x for each in tried]
    missing = [x for x in (low, high) if x not in taken]
    if missing:
        inner = between(low, high, taken, min(many, left) - len(missing)) if not taken and many > len(missing) else []
        return [*missing, *inner][: max(left, 0)], _USED_UP
    failed = [each for each in tried if each.f is None]
    if ends := [each for each in failed if each.x in (low, high)]:
        return [], f"the run at {_at(wanted, ends[0].x)} has no result: {ends[0].problem}"
    found = bracket(_samples(tried))
    if found is None:
        return [], ""
    if found.width <= wanted.tolerance:
        return [], ""
    if failed and widest(found.low.x, found.high.x, taken) <= wanted.tolerance:
        return [], f"{counted(len(failed), 'run')} within the bracket failed; {failed[0].run}: {failed[0].problem}"
    wide = widest(found.low.x, found.high.x, taken)
    enough = min(many, left, max(1, -int(-wide // wanted.tolerance) - 1) if not failed else many)
    return between(found.low.x, found.high.x, taken, max(enough, 0)), _USED_UP


_USED_UP = "the largest number of runs (--most) has been reached"
_CANCELLED = "the sweep was cancelled on the server; repeat the command to continue"


def _samples(tried: Sequence[Tried]) -> list[Sample]:
    return [Sample(each.x, each.f) for each in tried]


def _round(
    session: Server, wanted: Search, reporter: Reporter, tried: Sequence[Tried], at: Sequence[float]
) -> Iterator[tuple[Tried, list[Tried]]]:
    """Computes points at the same time. Yields each point, in order, when its run has ended, together with the
    points whose runs have not ended.
    """
    runs = [(x, _submitted(session, wanted, reporter, x)) for x in at]
    started = [Tried(x=x, values=changes(wanted.spans, x), run=run.id, state="") for x, run in runs]
    _report(wanted, reporter, [*tried, *started])
    for n, (x, run) in enumerate(runs):
        yield _ended(wanted, x, run), started[n + 1 :]


def _submitted(session: Server, wanted: Search, reporter: Reporter, x: float) -> Run:
    """Returns the run of a point. A run of an earlier search is used if it has succeeded or has not ended; otherwise
    a new run is submitted.
    """
    case = apply_overrides(wanted.case, changes(wanted.spans, x))
    name = f"adaptive-{_hash(wanted.goal.result, [span.key for span in wanted.spans], case, reporter.id)[:12]}"
    labels = {"sweep": reporter.id or f"adaptive {wanted.goal.result}"[:200], "point": _at(wanted, x)[:200]}
    for attempt in range(_ATTEMPTS):
        key = f"{name}-{_hash(metadata.version('conoid'), case)}-{attempt}"
        try:
            run = session.submit(case, key=key, labels=labels, folder=wanted.folder)
            info = run.status()
        except MissingError:  # The folder of the run was removed.
            continue
        if run.id > wanted.since or info.state is State.SUCCEEDED or not info.state.final:
            return run
    raise ClientError(f"the run at {_at(wanted, x)} has failed {_ATTEMPTS} times")


def _hash(*parts: Any) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()[:40]


def _ended(wanted: Search, x: float, run: Run) -> Tried:
    info = run.wait()
    ended = info.outcome
    values = changes(wanted.spans, x)
    tried = Tried(x=x, values=values, run=run.id, state=info.state.value)
    if info.state is not State.SUCCEEDED or ended is None:
        return tried.but(problem=f"{info.state.value}: {info.message or info.cause}", cpu=_cpu(ended))
    found = points.results(ended)
    value = found.get((wanted.goal.result, wanted.goal.unit))
    columns = {history.header({name: unit})[0]: cell for (name, unit), cell in found.items()}
    if not isinstance(value, int | float):
        return tried.but(
            results=columns, cpu=_cpu(ended), problem=f"{wanted.goal.result} is not a number at this point"
        )
    return tried.but(results=columns, cpu=_cpu(ended), value=float(value), f=float(value) - wanted.goal.threshold)


def _cpu(ended: Outcome | None) -> float:
    return ended.cpu if ended is not None and ended.cpu == ended.cpu else 0.0


def _free(session: Server, case: Mapping[str, Any]) -> int:
    """Returns the number of runs of the case for which the server has free slots, from 1 to ``_AT_ONCE``."""
    slots = session.me().slots
    cores = parse_case(case).run.cores
    free = (slots.get("total", cores) - slots.get("used", 0)) // cores
    return max(1, min(free, _AT_ONCE))


def _found(wanted: Search, tried: Sequence[Tried], why: str, fresh: int) -> Found:
    span = wanted.spans[0]
    made = bracket(_samples(tried))
    base = Found(
        key=span.key, unit=span.unit, goal=wanted.goal, tolerance=wanted.tolerance, why=why, points=len(tried),
        fresh=fresh, failed=sum(each.f is None for each in tried), cpu=sum(each.cpu for each in tried),
    )  # fmt: skip
    values = {each.x: each.value for each in tried}
    if made is None:
        ends = [(x, values[x]) for x in wanted.ends if x in values]
        return base.but(ends=ends)
    ends = [(sample.x, values[sample.x]) for sample in (made.low, made.high)]
    fit = fitted(wanted.goal, span, _samples(tried), made)
    return base.but(ends=ends, limit=0.5 * (made.low.x + made.high.x), uncertainty=0.5 * made.width, fit=fit,
                    changes=made.changes, mixed=made.mixed)  # fmt: skip


# Words ----------------------------------------------------------------------------------------------------------------


def _at(wanted: Search, x: float) -> str:
    span = wanted.spans[0]
    return f"{span.key} = {number(x)} {span.unit}".strip()


def _result_text(wanted: Search, each: Tried) -> str:
    if each.value is None:
        return each.problem
    return f"{wanted.goal.result} = {number(each.value)} {wanted.goal.unit}".strip()


def _state(wanted: Search, tried: Sequence[Tried]) -> str:
    made, unit = bracket(_samples(tried)), wanted.spans[0].unit
    if made is None:
        return "no bracket yet"
    return f"between {number(made.low.x)} and {number(made.high.x)} {unit}".strip()
