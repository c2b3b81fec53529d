"""The file journal.jsonl: all messages of a run. The state of a run is read from the journal. Only one process at a
time writes the journal: the worker while it runs, the server before and after the worker.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases.messages import Status, to_json
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State

_CHUNK = 1 << 18
"""Number of bytes that are read from a journal at once: some hundred lines (chosen value)."""
_LONGEST = 16 << 20
"""Largest size in bytes of a journal line that is read; a longer line is skipped. A report of 10,000 ranks has 2 MB
(reason of the chosen limit)."""
_PASSED = 256 << 20
"""Number of bytes of a too long line that are skipped at once: 0.1 s from memory (chosen value)."""
DAMAGED = msgspec.MsgspecError, ValueError, RecursionError
"""Errors that damaged JSON can cause, including text that is not UTF-8 and lists that are nested too deeply."""


class _Head(msgspec.Struct):
    """The fields of a journal line that the server needs; lines of a newer worker may have further fields."""

    seq: int
    type: str


_head = msgspec.json.Decoder(_Head)
_status = msgspec.json.Decoder(Status)


@dataclass(frozen=True)
class Line:
    """A message as its journal line, without the line feed."""

    seq: int
    type: str
    raw: bytes


class Tail:
    """Reads a journal from its beginning and continues while the file grows. The reader returns only complete lines. A
    journal that does not exist yet counts as empty.
    """

    def __init__(self, path: Path, after: int = 0) -> None:
        """Creates the reader of a journal. Lines whose ``seq`` is at most ``after`` are skipped."""
        self._path, self._after, self._passing = path, after, False
        self._offset = _line_before(path, after) if after else 0

    def read(self) -> list[Line]:
        """Returns the new messages, at most about 256 kB; empty if there are none."""
        while True:
            chunk = self._chunk()
            if not chunk:
                return []
            self._offset += len(chunk)
            lines = [line for raw in chunk.splitlines() if (line := _line(raw)) and line.seq > self._after]
            if lines:
                return lines

    def block(self, size: int) -> bytes:
        """Returns the next complete lines as they are, about ``size`` bytes; empty if there are none."""
        chunk = self._chunk(size)
        self._offset += len(chunk)
        return chunk

    def _chunk(self, size: int = _CHUNK) -> bytes:
        """Returns the next complete lines. A line longer than ``size`` is read completely; a line longer than
        ``_LONGEST`` is skipped.
        """
        try:
            with whole.opened(self._path, links=False) as file:
                while not self._passing or self._pass_over(file.fileno()):
                    data = os.pread(file.fileno(), size, self._offset)
                    end = data.rfind(b"\n") + 1
                    if end or len(data) < size:
                        return data[:end]
                    self._passing = size >= _LONGEST
                    size = min(4 * size, _LONGEST)
        except FileNotFoundError:
            pass
        return b""

    def _pass_over(self, descriptor: int) -> bool:
        """Skips a part of a line that is too long. Returns False if the end of the line is not reached; the next call
        continues.
        """
        for _ in range(_PASSED // _LONGEST):
            data = os.pread(descriptor, _LONGEST, self._offset)
            end = data.find(b"\n") + 1
            self._offset += end or len(data)
            if end:
                self._passing = False
                return True
            if len(data) < _LONGEST:
                return False
        return False


def _line_before(path: Path, after: int) -> int:
    """Returns the position of a line with ``seq`` at most ``after``, near the last such line. The numbers ``seq``
    increase along the journal.
    """
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
    """Returns ``seq`` of a journal line; 0 for a damaged line."""
    line = _line(raw)
    return line.seq if line is not None else 0


def lines(path: Path, after: int = 0) -> Iterator[Line]:
    """Yields every complete journal line with ``seq`` above ``after``, in order."""
    tail = Tail(path, after)
    while batch := tail.read():
        yield from batch


def statuses(path: Path) -> list[Status]:
    """Returns the Status messages of a journal, in order; damaged lines are skipped."""
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
    """Returns the last complete line of the journal, without the line feed; b"" if the journal has no line. Raises
    OSError if the journal cannot be read.
    """
    with whole.opened(path, links=False) as file:
        known = _last_lines(file.fileno(), os.fstat(file.fileno()).st_size)
        return known[-1].raw if known else b""


def _last_lines(descriptor: int, end: int) -> list[Line]:
    """Returns complete journal lines before the position ``end``, including the last one. The result is empty if there
    is no complete line. At most ``_LONGEST`` bytes are read.
    """
    window = _CHUNK
    while True:
        start = max(0, end - window)
        raws = os.pread(descriptor, end - start, start).splitlines()
        known = [line for raw in raws[1 if start else 0 :] if (line := _line(raw))]
        if known or not start:
            return known
        end -= window // 2 if window == _LONGEST else 0
        window = min(4 * window, _LONGEST)


def append(path: Path, status: Status) -> Status:
    """Appends ``status`` with the next number ``seq``, flushes the line to disk, and returns the message with its
    number. Raises OSError if the line cannot be written. Before, an incomplete last line that a killed worker has left
    is completed or removed. If the line cannot be written completely, it is removed again.
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
    """Completes or removes an incomplete last line, and returns the largest ``seq`` of the last lines. Damaged lines
    have no ``seq`` and do not count.
    """
    size = os.fstat(descriptor).st_size
    end = _after_last_feed(descriptor, size)
    torn = _line(os.pread(descriptor, size - end, end)) if size - end <= _LONGEST else None
    known = max((line.seq for line in _last_lines(descriptor, end)), default=0)
    if torn is not None:
        os.write(descriptor, b"\n")
        return max(torn.seq, known)
    os.ftruncate(descriptor, end)
    return known


def _after_last_feed(descriptor: int, size: int) -> int:
    """Returns the position after the last line feed."""
    while size:
        start = max(0, size - _CHUNK)
        end = os.pread(descriptor, size - start, start).rfind(b"\n") + 1
        if end:
            return start + end
        size = start
    return 0
