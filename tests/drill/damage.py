"""Faults of the files of one run: deleted, emptied, truncated, overwritten with garbage, replaced, without
permission."""

import os
import shutil
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

from conoid.cases.output import layout

from . import judge
from .judge import TRUE, Row
from .situations import STORAGE, SUCCEEDED, Truth
from .stand import Stand

CASE = "case.toml"
GONE = frozenset({"410"})
IN_A_ROW = 4
"""Number of runs that wait at the same time. The runs of a group start one after the other, and the time limit of a run
should not count the time of the run in the queue."""
LOST = frozenset({"lost/service", "lost/storage", "failed/storage", "failed/service"})
ANY_FAILURE = STORAGE | {"failed/input"}


def deleted(path: Path) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink()


def emptied(path: Path) -> None:
    """Empties a file, or removes the content of a folder."""
    if path.is_dir():
        for inner in path.iterdir():
            deleted(inner)
    else:
        os.truncate(path, 0)


def halved(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def garbled(path: Path) -> None:
    path.write_bytes(b"\xff{\x00\n" * 20)


def folder_in_place(path: Path) -> None:
    path.unlink()
    path.mkdir()


def file_in_place(path: Path) -> None:
    shutil.rmtree(path)
    path.write_text("x")


def locked_away(path: Path) -> None:
    path.chmod(0o000)


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def listening(path: Path) -> None:
    """Replaces a file with a socket at which no process listens. The path is longer than the limit for sockets, so the
    socket is bound through the folder's descriptor."""
    path.unlink()
    folder = os.open(path.parent, os.O_RDONLY)
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(f"/proc/self/fd/{folder}/{path.name}")
    os.close(folder)


WAYS: dict[str, Callable[[Path], None]] = {
    "deleted": deleted, "emptied": emptied, "cut to half": halved, "garbled": garbled,
    "a folder in its place": folder_in_place, "a file in its place": file_in_place, "not permitted": locked_away,
}  # fmt: skip
IRREGULAR: dict[str, Callable[[Path], None]] = {
    "a pipe in its place": pipe, "a link to an endless device": endless, "a socket in its place": listening,
}  # fmt: skip
"""Replacements of a file that are no regular files; a program that reads such a path would block."""
OF_FILES = ("deleted", "emptied", "cut to half", "garbled", "a folder in its place", "not permitted")
OF_FOLDERS = ("deleted", "emptied", "a file in its place", "not permitted")


@dataclass(frozen=True)
class Damage:
    """Damage of the file ``name`` in the folder of a run; ``doing`` is the state of the run; ``down`` is True if the
    server is stopped during the damage."""

    name: str
    way: str
    doing: str
    down: bool

    @property
    def title(self) -> str:
        """Name of the fault in the table."""
        when = "while no server was there" if self.down else "beneath the server"
        return f"{self.name or 'the folder of the run'}: {self.way}, {when}: {self.doing}"

    @property
    def beyond_use(self) -> bool:
        """True if the path can no longer be written."""
        return self.way in {"a folder in its place", "a file in its place", "not permitted", *IRREGULAR}

    def states(self) -> frozenset[str]:
        """Returns the states of the run that are correct after the damage."""
        return {"runs": self._runs, "waits": self._waits, "has ended": self._ended}[self.doing]()

    def _runs(self) -> frozenset[str]:
        """Returns the correct states of a run in progress. A worker that can write continues, because the worker has
        its input in memory."""
        if not self.name:
            return {"not permitted": STORAGE, "emptied": STORAGE | SUCCEEDED}.get(self.way, GONE | STORAGE)
        return STORAGE if self.name == layout.JOURNAL and self.beyond_use else SUCCEEDED

    def _waits(self) -> frozenset[str]:
        """Returns the correct states of a waiting run. The server does not start a run whose case or submission has
        changed.
        """
        if not self.name:
            return STORAGE if self.way == "not permitted" else GONE | STORAGE
        if self.name in {CASE, layout.SUBMISSION}:
            return STORAGE
        return STORAGE if self.beyond_use and self.name in {layout.JOURNAL, layout.LOGS} else SUCCEEDED

    def _ended(self) -> frozenset[str]:
        """Returns the correct states of a finished run: its state does not change."""
        return GONE | SUCCEEDED if not self.name and self.way != "not permitted" else SUCCEEDED

    @property
    def whole(self) -> bool:
        """True if journal and outcome can still agree."""
        return bool(self.name) and self.name not in {layout.JOURNAL, layout.OUTCOME} and not self.beyond_use


def damages() -> Iterator[Damage]:
    """Yields all damages: each file, in each way, for each state of the run, while the server is running or stopped."""
    files = {
        "runs": (layout.SUBMISSION, layout.JOURNAL, layout.WORKER, CASE),
        "waits": (layout.SUBMISSION, layout.JOURNAL, CASE),
        "has ended": (layout.SUBMISSION, layout.JOURNAL, layout.OUTCOME),
    }
    for doing, names in files.items():
        for name, way, down in product(names, OF_FILES, (False, True)):
            yield Damage(name, way, doing, down)
        for name, way, down in product(("", layout.LOGS), OF_FOLDERS, (False, True)):
            if name or way != "a file in its place":
                yield Damage(name, way, doing, down)


def rows(stand: Stand, some: Sequence[Damage]) -> Iterator[Row]:
    """Damages several runs at the same time; the server is either running or stopped for all these damages."""
    blockers = [stand.running(ranks=stand.slots - 1)] if some[0].doing == "waits" else []
    made = [_made(stand, one) for one in some]
    lives = blockers + [run for one, run in zip(some, made, strict=True) if one.doing == "runs"]
    for run in lives:
        stand.reached(run, "running")
    stand.errors.clear()
    if some[0].down:
        stand.kill()
    for one, run in zip(some, made, strict=True):
        (WAYS | IRREGULAR)[one.way](stand.runs / run / one.name)
    if some[0].down:
        assert stand.start(), stand.last_line()
    for run in made:
        judge.reads(stand, run)
    time.sleep(0.3)
    for run in lives:
        stand.go(run)
    truths = [Truth(run, one.states(), launches=2, whole=one.whole) for one, run in zip(some, made, strict=True)]
    yield from _judged(stand, some, truths)
    for truth in truths:
        if (stand.runs / truth.run).exists():
            (stand.runs / truth.run).chmod(0o700)


def _made(stand: Stand, one: Damage) -> str:
    if one.doing == "runs":
        return stand.running()
    if one.doing == "waits":
        return stand.submit(ranks=stand.large)
    run = stand.submit()
    stand.reached(run)
    return run


def _judged(stand: Stand, some: Sequence[Damage], truths: Sequence[Truth]) -> Iterator[Row]:
    since, found = time.monotonic(), []
    for truth, (seen, seconds) in zip(truths, judge.settled(stand, truths, since), strict=True):
        found.append((seen, seconds, judge.verdict(stand, truth, seen, seconds)))
        judge.reads(stand, truth.run)
    stand.again()
    for one, truth, (seen, seconds, wrong) in zip(some, truths, found, strict=True):
        later = judge.settle(stand, truth, time.monotonic())[0]
        judge.reads(stand, truth.run)
        errors = [error for error in stand.errors if truth.run in error]
        if wrong == TRUE and later != seen:
            wrong = f"lie: {later} after the next start, {seen} before"
        yield Row(one.title, "damage", seen, seconds, errors[0] if wrong == TRUE and errors else wrong)


def batches(some: Iterable[Damage], size: int) -> Iterator[list[Damage]]:
    """Yields batches of damages; in a batch the state of the runs is the same, and the server is either running or
    stopped."""
    kinds: dict[tuple[str, bool], list[Damage]] = {}
    for one in some:
        kinds.setdefault((one.doing, one.down), []).append(one)
    for (doing, _), same in kinds.items():
        step = min(size, IN_A_ROW) if doing == "waits" else size
        yield from (same[n : n + step] for n in range(0, len(same), step))


def groups(size: int = 12) -> dict[str, tuple[str, Callable[[Stand], Iterator[Row]]]]:
    """Returns the groups of damages by name, each with its kind of stand."""
    made: dict[str, tuple[str, Callable[[Stand], Iterator[Row]]]] = {}
    for n, batch in enumerate(batches(damages(), size)):
        kind = "narrow" if batch[0].doing == "waits" else "wide"
        when = "no server" if batch[0].down else "a server"
        made[f"damage {n + 1}: {batch[0].doing}, {when}"] = (kind, partial(rows, some=batch))
    return made
