"""journal.jsonl: the truth about a run. One writer at a time: the server before and after the worker, not beside it."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases import whole
from conoid.cases.messages import Status, to_json
from conoid.cases.run import Cause, State

_CHUNK = 1 << 18
"""Bytes of a journal that are read at once: some hundred lines. Chosen."""


class _Head(msgspec.Struct):
    """The part of a message that the server reads of every line, whatever else a newer worker puts in it."""

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
    """Follows a journal from its beginning; gives complete lines only, so a line that is being written is never torn.

    A journal that does not exist yet is empty.
    """

    def __init__(self, path: Path, after: int = 0) -> None:
        """Skips the lines whose ``seq`` is at most ``after``."""
        self._path, self._after = path, after
        self._offset = _line_before(path, after) if after else 0

    def read(self) -> list[Line]:
        """The new lines, at most about 256 kB of them; an empty list when there are none now."""
        while True:
            chunk = self._chunk()
            if not chunk:
                return []
            self._offset += len(chunk)
            lines = [line for raw in chunk.splitlines() if (line := _line(raw)) and line.seq > self._after]
            if lines:
                return lines

    def block(self, size: int) -> bytes:
        """The next complete lines as they stand, about ``size`` bytes of them; empty when there are none now."""
        chunk = self._chunk(size)
        self._offset += len(chunk)
        return chunk

    def _chunk(self, size: int = _CHUNK) -> bytes:
        """The next complete lines. A line longer than the chunk size is read whole."""
        try:
            with whole.opened(self._path) as file:
                while True:
                    data = os.pread(file.fileno(), size, self._offset)
                    end = data.rfind(b"\n") + 1
                    if end or len(data) < size:
                        return data[:end]
                    size *= 4
        except FileNotFoundError:
            return b""


def _line_before(path: Path, after: int) -> int:
    """Where some line with ``seq`` at most ``after`` begins, close to the last of them: numbers rise along the file."""
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
        head = _head.decode(raw)
    except msgspec.MsgspecError:
        return None
    return Line(head.seq, head.type, raw)


def seq_of(raw: bytes) -> int:
    """The number of a line; 0 for what is none."""
    line = _line(raw)
    return line.seq if line is not None else 0


def lines(path: Path, after: int = 0) -> Iterator[Line]:
    """Every complete line with ``seq`` above ``after``, in order."""
    tail = Tail(path, after)
    while batch := tail.read():
        yield from batch


def statuses(path: Path) -> list[Status]:
    """The Status messages of a journal, in order; what is damaged is passed over."""
    found = (_status_in(line.raw) for line in lines(path) if line.type == "status")
    return [status for status in found if status is not None]


def _status_in(raw: bytes) -> Status | None:
    try:
        status = _status.decode(raw)
        State(status.state)
        Cause(status.cause) if status.cause else None
    except ValueError:
        return None
    return status


def last(path: Path) -> bytes:
    """The last line that is one, without the line feed; b"" where there is none. Raises OSError."""
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
    """Appends ``status`` under the next number and returns it as written; on disk when this returns. Raises OSError.

    A line that a killed worker left half written is no event: it is cut off first; so is this one when it cannot be
    written whole.
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
    """The largest number of the last lines, however much damage follows them; what stands after the last line feed is
    completed or cut off.
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
