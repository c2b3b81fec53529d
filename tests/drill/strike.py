"""A fault of a whole server, tried with runs in every situation."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from . import judge, situations
from .judge import TRUE, Row
from .situations import Life, Situation, Truth
from .stand import PATIENCE, Stand

Deed = Callable[[Stand], None]


@dataclass(frozen=True)
class Strike:
    """The function ``deed`` starts the fault, ``lift`` ends the fault ``hold`` s later."""

    name: str
    family: str
    deed: Deed
    lift: Deed
    stand: str = "plain"
    """Kind of stand that the fault needs."""
    unsaid: frozenset[str] = frozenset()
    """Further correct states of a worker that could not write its end, if the fault also affects files of workers."""
    hold: float = 2.5
    lives: Sequence[Situation] = situations.ALL
    launches: int = 1
    """Largest number of starts of a run."""
    waits: float = PATIENCE
    """Time in s after which requests during the fault give up: the fault must end on time even if the server hangs."""


def rows(stand: Stand, strike: Strike) -> Iterator[Row]:
    """Brings runs into every situation, starts and ends the fault, and yields two results for each run: whether its
    state became true, and whether a newly started server reports the same state.
    """
    lives = [life(stand, strike.unsaid) for life in strike.lives]
    _begin(stand, lives)
    stand.errors.clear()
    strike.deed(stand)
    with stand.giving_up(strike.waits):
        for life in lives:
            next(life)
    time.sleep(strike.hold)
    strike.lift(stand)
    since = time.monotonic()
    truths = [_after(life, strike.launches) for life in lives]
    first = []
    ends = judge.settled(stand, truths, since)
    for situation, truth, (seen, seconds) in zip(strike.lives, truths, ends, strict=True):
        wrong = judge.verdict(stand, truth, seen, seconds)
        first.append((situation.__name__.replace("_", " "), truth, seen, seconds, wrong))
    stand.again()
    stranded = judge.stranded(stand)
    for name, truth, seen, seconds, wrong in first:
        later = judge.settle(stand, truth, time.monotonic())[0] if truth.run != "none" else seen
        if wrong == TRUE and later != seen:
            wrong = f"lie: {later} after the next start, {seen} before"
        errors = [error for error in stand.errors if _concerns(error, truth, name)]
        if wrong == TRUE and (errors or stranded):
            wrong = errors[0] if errors else stranded
        happened = "; ".join(filter(None, (truth.happened, seen)))
        yield Row(f"{strike.name}: {name}", strike.family, happened, seconds, wrong)


def _concerns(error: str, truth: Truth, name: str) -> bool:
    """Decides whether a server error concerns a run: an error of a submission concerns the submitted run, an error with
    the id of a run concerns this run, all other errors concern every run."""
    if error.startswith("POST /v1/runs:"):
        return "submitted" in name
    return truth.run in error or "/v1/runs/" not in error


def _begin(stand: Stand, lives: Sequence[Life]) -> None:
    """Begins the situations one by one: runs that should use cores start before other runs need their slots."""
    for life in lives:
        next(life)
        if stand.slots < 100 or stand.profile:
            _settled(stand)


def _settled(stand: Stand) -> None:
    deadline = time.monotonic() + stand.patience
    while time.monotonic() < deadline:
        open_runs = stand.ask("GET", "/v1/runs?limit=50&state=accepted,starting,queued")[1]["runs"]
        if not [run for run in open_runs if run["ranks"] == 1]:
            return
        time.sleep(0.1)


def _after(life: Life, launches: int) -> Truth:
    try:
        next(life)
    except StopIteration as end:
        found: Truth = end.value
        return replace(found, launches=max(found.launches, launches))
    raise AssertionError("a life has three parts")
