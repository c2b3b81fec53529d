"""journal.jsonl, the truth of a run: every message numbered, written and flushed before anybody else receives it."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import State

from . import storage

M = TypeVar("M", bound=messages.Message)
_MOST = 1 << 40
"""Bytes of a journal: it has no limit of its own."""


class _Head(msgspec.Struct):
    """What every message has."""

    seq: int
    type: str


_head = msgspec.json.Decoder(_Head)


class Listener(Protocol):
    """Who is told of a message once it is in the journal."""

    def tell(self, message: messages.AnyMessage, blob: bytes = b"") -> None:
        """Takes the message without waiting for anybody; ``blob``: the bytes of a snapshot, where there are any."""


class Journal:
    """Appends to the journal of a run folder, going on from the last number in it."""

    def __init__(self, folder: Path, run: str, listener: Listener | None = None) -> None:
        self._path = path = folder / layout.JOURNAL
        self._run = run
        self.frames: set[int] = set()
        """Indices of the frames that it lists."""
        self.snapshots = 0
        """One more than the largest number of a snapshot that it lists."""
        self._file = whole.appended(path)
        self._seq, content = 0, whole.read(path, _MOST)
        for line in content.splitlines():
            self._seq = max(self._seq, _number(line))
        for message in _written(content):
            if isinstance(message, messages.Frame):
                self.frames.add(message.index)
            elif isinstance(message, messages.Snapshot):
                self.snapshots = max(self.snapshots, message.n + 1)
        if content and not content.endswith(b"\n"):
            self._file.write(b"\n")
        self._listener = listener

    def write(self, kind: type[M], step: int = 0, t: float = 0.0, blob: bytes = b"", **fields: Any) -> M:
        """Writes one message and passes it on, with the ``blob`` of a snapshot. Raises OSError, also when somebody has
        removed the file: what is written to it is nowhere.
        """
        storage.require(self._file, self._path)
        self._seq += 1
        message = kind(run=self._run, seq=self._seq, wall=time.time(), step=step, t=t, **fields)
        line = msgspec.json.encode(message) + b"\n"
        while line:
            line = line[self._file.write(line) :]
        if self._listener is not None:
            self._listener.tell(message, blob)  # type: ignore[arg-type]
        return message

    def starting(self, what: str) -> None:
        """Says what the start is at."""
        self.write(messages.Status, state=State.STARTING, message=what)

    def close(self) -> None:
        """Closes the file; the journal is complete."""
        self._file.close()


def _number(line: bytes) -> int:
    """Of a message, also of one that another version has written; 0 for what is none."""
    try:
        return _head.decode(line).seq
    except (msgspec.DecodeError, UnicodeDecodeError):
        return 0


def _written(content: bytes) -> Iterator[messages.AnyMessage]:
    """The messages of a journal; a line that a crash has torn is passed over."""
    for line in content.splitlines():
        with contextlib.suppress(msgspec.DecodeError, UnicodeDecodeError):
            yield messages.from_json(line)
