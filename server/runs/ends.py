"""Data for the outcome of a run that has written none, from its files: time of the end, last step, energies."""

import math
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from conoid.cases.messages import Counts, Message, Progress, Started
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout

from . import folder, journal
from .events import Run

M = TypeVar("M", bound=Message)

_BLOCK = 4 << 20
"""Number of bytes that are read from a journal at once (chosen value)."""
_TYPE = slice(9, 13)
"""Position in a journal line of four characters that identify the type of its message."""


class _LastLine(msgspec.Struct):
    """The field with the time of a journal message."""

    wall: float


_decoder = msgspec.json.Decoder(_LastLine)


def when(path: Path) -> float:
    """Returns the Unix time at which the run in the folder ``path`` has last written something, s. The time is that of
    the last message of the journal; without a journal, that of the outcome; 0 if neither can be read.
    """
    try:
        return _decoder.decode(journal.last(path / layout.JOURNAL)).wall or _written(path)
    except (*folder.DAMAGED, msgspec.MsgspecError):
        return _written(path)


def _written(path: Path) -> float:
    try:
        return (path / layout.OUTCOME).stat().st_mtime
    except OSError:
        return 0.0


def so_far(outcome: Outcome, run: Run, path: Path) -> Outcome:
    """Returns ``outcome`` with the last step, time and energies that the journal contains, if it contains a step."""
    started, progress, counts = _newest(path / layout.JOURNAL)
    if started is None:
        return outcome
    known: dict[str, Any] = {
        "elements": started.elements, "nodes_initial": started.nodes, "setup": started.setup,
        "elapsed": max(0.0, run.finished - run.started) if run.started else math.nan,
    }  # fmt: skip
    if progress is not None:
        known |= {"steps": progress.step, "time": progress.t, "energy": progress.energy}
        known |= {"worst_residual": progress.worst_residual} if progress.worst_residual is not None else {}
    if counts is not None:
        gone = started.elements - counts.elements
        known |= {"nodes": counts.nodes, "eroded": gone, "fragments": counts.fragments, "broken": counts.facets}
    return msgspec.structs.replace(outcome, **known)


def _newest(path: Path) -> tuple[Started | None, Progress | None, Counts | None]:
    """Returns the newest journal message of each type; lines that cannot be read are skipped."""
    lines = {b"star": b"", b"prog": b"", b"coun": b""}
    try:
        tail = journal.Tail(path)
        while block := tail.block(_BLOCK):
            for line in block.split(b"\n"):
                if line[_TYPE] in lines:
                    lines[line[_TYPE]] = line
    except folder.DAMAGED:
        pass
    return _message(Started, lines[b"star"]), _message(Progress, lines[b"prog"]), _message(Counts, lines[b"coun"])


def _message(kind: type[M], line: bytes) -> M | None:
    try:
        return msgspec.json.decode(line, type=kind)
    except msgspec.MsgspecError:
        return None
