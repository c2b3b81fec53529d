"""The file journal.jsonl, which is the complete record of a run. Every message is numbered, written and flushed before
it is sent to readers.
"""

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
"""Largest size of a journal that is read, bytes. The limit is so large that no journal of a run reaches it."""


class _Head(msgspec.Struct):
    """Fields that every message has."""

    seq: int
    type: str


_head = msgspec.json.Decoder(_Head)


class Listener(Protocol):
    """Interface of receivers of messages. A receiver gets a message after it was written to the journal."""

    def tell(self, message: messages.AnyMessage, blob: bytes = b"") -> None:
        """Receive a message without blocking; ``blob``: the bytes of a snapshot, or no bytes."""


class Journal:
    """Appends messages to the journal of a run folder. The numbers of new messages continue the numbers in the
    journal.
    """

    def __init__(self, folder: Path, run: str, listener: Listener | None = None) -> None:
        self._path = path = folder / layout.JOURNAL
        self._run = run
        self.frames: set[int] = set()
        """Indices of the frames that have a message in the journal."""
        self.snapshots = 0
        """Number of the next snapshot; it continues the numbers of the snapshots in the journal."""
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
        """Write one message and send it to readers, with the ``blob`` of a snapshot.

        Raises OSError if the message cannot be written. Also raises OSError if the file was removed, because the
        message would be lost.
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
        """Report a phase of the start of the run."""
        self.write(messages.Status, state=State.STARTING, message=what)

    def close(self) -> None:
        """Close the file; after this call the journal is complete."""
        self._file.close()


def _number(line: bytes) -> int:
    """Return the number of a message, even if the message has another version; 0 for a line that is not a message."""
    try:
        return _head.decode(line).seq
    except (msgspec.DecodeError, UnicodeDecodeError):
        return 0


def _written(content: bytes) -> Iterator[messages.AnyMessage]:
    """Yield the messages of a journal. Lines that a crash has damaged are skipped."""
    for line in content.splitlines():
        with contextlib.suppress(msgspec.DecodeError, UnicodeDecodeError):
            yield messages.from_json(line)
