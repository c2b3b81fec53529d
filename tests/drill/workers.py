"""Faults of one worker, detected by the server that started the worker or by the next server."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

from conoid.server.launch import processes

from . import judge
from .judge import TRUE, Row
from .situations import CANCELLED, SUCCEEDED, Truth
from .stand import Stand

NODE, PREEMPTED = frozenset({"lost/node"}), frozenset({"failed/preempted"})
FAILED = frozenset({"failed/service", "failed/launch"})
Upload = tuple[str, signal.Signals]
"""Receiver of a signal, and the signal."""


@dataclass(frozen=True)
class Blow:
    """A fault of a worker; ``states`` are the correct states after the fault; ``plan`` has the arguments of the fake
    worker.
    """

    name: str
    states: frozenset[str]
    sends: Upload | None = None
    plan: tuple[tuple[str, object], ...] = ()
    cancels: bool = False
    goes: bool = False
    """True if the worker gets its start signal after the fault, so that the remaining processes can end."""


def blows() -> Iterator[Blow]:
    """Yields the faults of workers: signals to ranks, launcher and proxy, and workers with unusual ends."""
    for number in (signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT, signal.SIGTERM):
        states = {signal.SIGKILL: NODE, signal.SIGTERM: PREEMPTED}.get(number, FAILED)
        yield Blow(f"{number.name} to rank 0", states, ("rank", number))
    yield Blow("SIGKILL to the launcher", NODE, ("launcher", signal.SIGKILL))
    yield Blow("SIGTERM to the launcher", PREEMPTED, ("launcher", signal.SIGTERM))
    yield Blow("SIGKILL to the launcher's proxy", NODE | FAILED | SUCCEEDED, ("proxy", signal.SIGKILL), goes=True)
    yield Blow("SIGKILL to all processes of the run", NODE, ("all", signal.SIGKILL))
    yield Blow("SIGSTOP to all, then a cancel", CANCELLED, ("all", signal.SIGSTOP), cancels=True)
    yield Blow("SIGSTOP to rank 0, then a cancel", CANCELLED, ("rank", signal.SIGSTOP), cancels=True)
    yield Blow("a worker deaf to the cancel", CANCELLED, plan=(("end", "deaf"),), cancels=True)
    yield Blow("a worker that crashes", FAILED, plan=(("end", "crash"),))
    yield Blow("a worker that vanishes with code 0", FAILED, plan=(("end", "vanish"),))
    yield Blow("a worker that tears its last line", FAILED, plan=(("end", "torn"),))
    yield Blow("a worker that garbles its outcome", FAILED, plan=(("end", "garbled"),))
    yield Blow("a worker that hangs after its end", SUCCEEDED, plan=(("end", "hang"),))
    yield Blow("a worker whose disk is full", frozenset({"failed/storage"}), plan=(("end", "full"),))
    yield Blow("a worker that kills itself", NODE, plan=(("end", "killed"),))


def rows(stand: Stand, adopted: bool) -> Iterator[Row]:
    """Applies all faults at once, each to another run; ``adopted`` is True if an earlier server has started the
    workers."""
    all_ = list(blows())
    runs = [stand.running(ranks=1, **dict(blow.plan)) for blow in all_]
    for run in runs:
        stand.reached(run, "running")
    if adopted:
        stand.again()
    since = time.monotonic()
    for blow, run in zip(all_, runs, strict=True):
        _deal(stand, blow, run)
    found = []
    truths = [Truth(run, _states(blow, adopted)) for blow, run in zip(all_, runs, strict=True)]
    for truth, (seen, seconds) in zip(truths, judge.settled(stand, truths, since), strict=True):
        found.append((truth, seen, seconds, judge.verdict(stand, truth, seen, seconds)))
    stand.again()
    whose = "adopted" if adopted else "own"
    for blow, (truth, seen, seconds, wrong) in zip(all_, found, strict=True):
        later = stand.state(truth.run)
        wrong = f"lie: {later} after the next start" if wrong == TRUE and later != seen else wrong
        yield Row(f"{blow.name} ({whose})", "kill", seen, seconds, wrong)


def _states(blow: Blow, adopted: bool) -> frozenset[str]:
    """Returns the correct states of the run after the fault. A server does not get the exit code of an adopted worker
    if the launcher of the worker has also ended."""
    silent = blow.states is FAILED or (blow.sends is not None and blow.sends[0] in {"launcher", "all"})
    return blow.states | {"lost/service"} if adopted and silent else blow.states


def _deal(stand: Stand, blow: Blow, run: str) -> None:
    if blow.sends is not None:
        whom, number = blow.sends
        for pid in _processes(stand, run, whom):
            with suppress(ProcessLookupError):
                os.kill(pid, number)
    if blow.cancels:
        stand.cancel(run)
    elif blow.sends is None or blow.goes:
        stand.go(run)


def _processes(stand: Stand, run: str, whom: str) -> list[int]:
    ranks, everybody = stand.ranks(run), processes.of_run(run)
    leader = processes.leader_of(everybody)
    chosen: dict[str, Callable[[], list[int]]] = {
        "rank": lambda: ranks,
        "launcher": lambda: [leader] if leader else [],
        "proxy": lambda: [pid for pid in everybody if pid != leader and pid not in ranks],
        "all": lambda: everybody,
    }
    return chosen[whom]()
