"""What a run may be doing when a fault strikes: each is a life in three parts, before, meanwhile and after."""

import os
import signal
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass

from .stand import Stand


@dataclass(frozen=True)
class Truth:
    """What must come out of a run; ``states`` as ``Stand.state`` tells them."""

    run: str
    states: frozenset[str]
    happened: str = ""
    """What was answered meanwhile."""
    launches: int = 1
    """How often it may have been started at most."""
    whole: bool = True
    """Whether its folder must tell the same."""


Life = Generator[None, None, Truth]
Situation = Callable[[Stand, frozenset[str]], Life]
SUCCEEDED, CANCELLED = frozenset({"succeeded"}), frozenset({"cancelled/cancelled"})
STORAGE = frozenset({"failed/storage", "lost/storage"})


def is_running(stand: Stand, unsaid: frozenset[str]) -> Life:
    """It goes on after the fault."""
    run = stand.running()
    yield
    yield
    stand.go(run)
    return Truth(run, SUCCEEDED)


def ends_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """Its worker has done its work. ``unsaid``: what is true when it could not write so."""
    run = stand.running()
    yield
    stand.go(run)
    yield
    return Truth(run, SUCCEEDED | unsaid)


def is_cancelled_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """By its owner, who asks again when that could not be recorded."""
    run = stand.running()
    yield
    answer = stand.cancel(run)
    yield
    again = cancel_until(stand, run)
    return Truth(run, CANCELLED, f"cancel {answer}, then {again}")


def is_killed_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """A rank, from outside."""
    run = stand.running()
    yield
    for pid in stand.ranks(run):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    yield
    return Truth(run, frozenset({"lost/node"}) | unsaid)


def waits(stand: Stand, unsaid: frozenset[str]) -> Life:
    """In the queue, and gets its turn when others have ended. A launch that cannot be recorded is made again."""
    run = stand.submit(ranks=stand.large)
    yield
    yield
    return Truth(run, SUCCEEDED, launches=8)


def waits_and_is_cancelled(stand: Stand, unsaid: frozenset[str]) -> Life:
    """In the queue. Who was told "not now" may find that it has run."""
    run = stand.submit(ranks=stand.large)
    yield
    answer = stand.cancel(run)
    yield
    again = cancel_until(stand, run)
    states = CANCELLED if answer == 202 else CANCELLED | SUCCEEDED
    return Truth(run, states, f"cancel {answer}, then {again}", launches=8)


def is_submitted_meanwhile(stand: Stand, unsaid: frozenset[str]) -> Life:
    """With a key, and again afterwards as a client does: one run, whatever was answered."""
    key = f"k{time.monotonic_ns()}"
    yield
    answer, told = stand.hand_in(key)
    yield
    deadline = time.monotonic() + stand.patience
    while (later := stand.hand_in(key))[0] != 202 and time.monotonic() < deadline:
        time.sleep(0.2)
    happened = f"answered {answer}, then {later[0]}"
    if answer == 202 and later[0] == 202 and told["id"] != later[1]["id"]:
        happened += ": two runs"
    run = later[1]["id"] if later[0] == 202 else "none"
    return Truth(run, SUCCEEDED, happened, launches=8)


def has_ended(stand: Stand, unsaid: frozenset[str]) -> Life:
    """It had succeeded before and stays so."""
    run = stand.submit()
    stand.reached(run)
    yield
    yield
    return Truth(run, SUCCEEDED)


def cancel_until(stand: Stand, run: str) -> int:
    """The answer to the last of the requests: as a person does who is told to try again."""
    deadline = time.monotonic() + stand.patience
    while (answer := stand.cancel(run)) != 202 and time.monotonic() < deadline:
        time.sleep(0.2)
    return answer


ALL: tuple[Situation, ...] = (
    has_ended, is_running, ends_meanwhile, is_cancelled_meanwhile, is_killed_meanwhile, waits, waits_and_is_cancelled,
    is_submitted_meanwhile,
)  # fmt: skip
"""In the order in which they begin: those that run before those that find no room."""
