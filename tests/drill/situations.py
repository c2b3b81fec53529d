"""Situations of a run at the time of a fault. A situation is a generator of three parts: before, during and after the
fault."""

import os
import signal
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass

from .stand import Stand


@dataclass(frozen=True)
class Truth:
    """Expected result of a run; ``states`` are the correct states, in the form of ``Stand.state``."""

    run: str
    states: frozenset[str]
    happened: str = ""
    """Answers of the server during the fault."""
    launches: int = 1
    """Largest number of starts of the run."""
    whole: bool = True
    """True if the files in the folder must agree with the answer of the server."""


Life = Generator[None, None, Truth]
Situation = Callable[[Stand, frozenset[str]], Life]
SUCCEEDED, CANCELLED = frozenset({"succeeded"}), frozenset({"cancelled/cancelled"})
STORAGE = frozenset({"failed/storage", "lost/storage"})
UNWRITTEN = frozenset({"failed/storage"})
"""State of a cancelled run whose worker could not write its files, if the fault affects these files."""


def is_running(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The run continues after the fault."""
    run = stand.running()
    yield
    yield
    stand.go(run)
    return Truth(run, SUCCEEDED)


def ends_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The worker of the run ends during the fault. The argument ``unsaid`` has further correct states for a worker that
    could not write its end.
    """
    run = stand.running()
    yield
    stand.go(run)
    yield
    return Truth(run, SUCCEEDED | unsaid)


def is_cancelled_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The owner cancels the run during the fault, and tries again after the fault if the cancellation could not be
    stored.
    """
    run = stand.running()
    yield
    answer = stand.cancel(run)
    yield
    again = cancel_until(stand, run)
    return Truth(run, CANCELLED | (unsaid & UNWRITTEN), f"cancel {answer}, then {again}")


def is_killed_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """All processes of rank 0 are killed during the fault."""
    run = stand.running()
    yield
    for pid in stand.ranks(run):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    yield
    return Truth(run, frozenset({"lost/node"}) | unsaid)


def waits(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The run waits in the queue and starts when other runs have ended. A start that could not be stored is tried
    again."""
    run = stand.submit(ranks=stand.large)
    yield
    yield
    return Truth(run, SUCCEEDED, launches=8)


def waits_and_is_cancelled(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The run is cancelled in the queue or just after its start; without the cancellation the run would not end."""
    run = stand.submit(ranks=stand.large, steps=100_000, pace=0.02)
    yield
    answer = stand.cancel(run)
    yield
    again = cancel_until(stand, run)
    return Truth(run, CANCELLED | (unsaid & UNWRITTEN), f"cancel {answer}, then {again}", launches=8)


def is_submitted_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The run is submitted during the fault with an idempotency key, and again after the fault, as a client would: the
    result must be one run."""
    key = f"k{time.monotonic_ns()}"
    yield
    answer, body = stand.hand_in(key)
    yield
    deadline = time.monotonic() + stand.patience
    while (later := stand.hand_in(key))[0] != 202 and time.monotonic() < deadline:
        time.sleep(0.2)
    happened = f"answered {answer}, then {later[0]}"
    if answer == 202 and later[0] == 202 and body["id"] != later[1]["id"]:
        happened += ": two runs"
    run = later[1]["id"] if later[0] == 202 else "none"
    return Truth(run, SUCCEEDED, happened, launches=8)


def has_ended(stand: Stand, unsaid: frozenset[str]) -> Life:
    """The run succeeded before the fault, and its state does not change."""
    run = stand.submit()
    stand.reached(run)
    yield
    yield
    return Truth(run, SUCCEEDED)


def cancel_until(stand: Stand, run: str) -> int:
    """Cancels a run repeatedly, as a person would, until the request is accepted; returns the last status."""
    deadline = time.monotonic() + stand.patience
    while (answer := stand.cancel(run)) != 202 and time.monotonic() < deadline:
        time.sleep(0.2)
    return answer


ALL: tuple[Situation, ...] = (
    has_ended, is_running, ends_meanwhile, is_cancelled_meanwhile, is_killed_meanwhile, waits, waits_and_is_cancelled,
    is_submitted_meanwhile,
)  # fmt: skip
"""Order in which the situations begin: runs that use cores come before runs that must wait for slots."""
