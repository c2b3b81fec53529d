"""journal.jsonl: all events of a run, the source of its state. It has one writer at a time: the worker while it
runs, the server before and after."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases.messages import Status, to_json
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State

_CHUNK = 1 << 18
"""Bytes of one read: some hundred lines. Chosen."""
DAMAGED = msgspec.MsgspecError, ValueError, RecursionError
"""Errors of msgspec for damaged JSON: text that is not UTF-8, and lists that are nested too deeply, included."""


class _Head(msgspec.Struct):
    """Fields that the server reads of every line; a newer worker may write others besides."""

    seq: int
    type: str


_head = msgspec.json.Decoder(_Head)
_status = msgspec.json.Decoder(Status)


@dataclass(frozen=True)
class Line:
    """One event as it stands in the journal, without the line feed."""

    seq: int
    type: str
    raw: bytes


class Tail:
    """Reads a journal from its beginning as it grows; returns complete lines only. A journal that does not exist yet
    is empty.
    """

    def __init__(self, path: Path, after: int = 0) -> None:
        """Skips the lines whose ``seq`` is at most ``after``."""
        self._path, self._after = path, after
        self._offset = _line_before(path, after) if after else 0

    def read(self) -> list[Line]:
        """The new events, about 256 kB at most; empty when there are none."""
        while True:
            chunk = self._chunk()
            if not chunk:
                return []
            self._offset += len(chunk)
            lines = [line for raw in chunk.splitlines() if (line := _line(raw)) and line.seq > self._after]
            if lines:
                return lines

    def block(self, size: int) -> bytes:
        """Returns the next complete lines unchanged, about ``size`` bytes; empty without new lines."""
        chunk = self._chunk(size)
        self._offset += len(chunk)
        return chunk

    def _chunk(self, size: int = _CHUNK) -> bytes:
        """The next complete lines. A line longer than the chunk is read whole."""
        try:
            with whole.opened(self._path, links=False) as file:
                while True:
                    data = os.pread(file.fileno(), size, self._offset)
                    end = data.rfind(b"\n") + 1
                    if end or len(data) < size:
                        return data[:end]
                    size *= 4
        except FileNotFoundError:
            return b""


def _line_before(path: Path, after: int) -> int:
    """Offset of a line with ``seq`` at most ``after``, close to the last such line: numbers increase along the file."""
    if not path.exists():
        return 0
    with whole.opened(path) as file:
        low, high = 0, os.fstat(file.fileno()).st_size
        while high - low > _CHUNK:
            middle = (low + high) // 2
            data = os.pread(file.fileno(), _CHUNK, middle)
            begin = data.find(b"\n") + 1
            end = data.find(b"\n", begin)
            line = _line(data[begin:end]) if begin and end > 0 else None
            if line is None:
                break
            low, high = (middle + begin, high) if line.seq <= after else (low, middle)
        return low


def _line(raw: bytes) -> Line | None:
    try:
        head = _head.decode(raw.decode())
    except DAMAGED:
        return None
    return Line(head.seq, head.type, raw)


def seq_of(raw: bytes) -> int:
    """The number of a line; 0 for a damaged one."""
    line = _line(raw)
    return line.seq if line is not None else 0


def lines(path: Path, after: int = 0) -> Iterator[Line]:
    """Every complete line with ``seq`` above ``after``, in order."""
    tail = Tail(path, after)
    while batch := tail.read():
        yield from batch


def statuses(path: Path) -> list[Status]:
    """The Status messages of a journal, in order; damaged lines are skipped."""
    found = (_status_in(line.raw) for line in lines(path) if line.type == "status")
    return [status for status in found if status is not None]


def _status_in(raw: bytes) -> Status | None:
    try:
        status = _status.decode(raw)
        State(status.state)
        Cause(status.cause) if status.cause else None
    except DAMAGED:
        return None
    return status


def last(path: Path) -> bytes:
    """The last whole line, without the line feed; b"" where there is none. Raises OSError."""
    window = _CHUNK
    with whole.opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        while True:
            start = max(0, size - window)
            raws = os.pread(file.fileno(), size - start, start).splitlines()
            found = next((line.raw for raw in reversed(raws[1 if start else 0 :]) if (line := _line(raw))), b"")
            if found or not start:
                return found
            window *= 4


def append(path: Path, status: Status) -> Status:
    """Appends ``status`` with the next number and returns it as written; it is on disk on return. Raises OSError. An
    incomplete last line of a killed worker is cut off first; this line is cut off when it cannot be written whole.
    """
    with whole.appended(path, 0o600) as file:
        numbered = msgspec.structs.replace(status, seq=_mend(file.fileno()) + 1)
        size = os.fstat(file.fileno()).st_size
        try:
            os.write(file.fileno(), to_json(numbered) + b"\n")
            os.fsync(file.fileno())
        except OSError:
            os.ftruncate(file.fileno(), size)
            raise
    return numbered


def _mend(descriptor: int) -> int:
    """Returns the largest number of the last lines, even with damaged lines after it. Text after the last line feed
    is completed or cut off.
    """
    window = _CHUNK
    while True:
        size = os.fstat(descriptor).st_size
        start = max(0, size - window)
        data = os.pread(descriptor, size - start, start)
        end = data.rfind(b"\n") + 1
        torn = _line(data[end:]) if end or not start else None
        known = [line.seq for raw in data[:end].splitlines() if (line := _line(raw))]
        if torn is not None:
            os.write(descriptor, b"\n")
            return max(torn.seq, *known, 0)
        if known or not start:
            os.ftruncate(descriptor, start + end)
            return max(known, default=0)
        window *= 4
