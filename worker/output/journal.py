"""journal.jsonl, the truth of a run: every message numbered, written and flushed before anybody else hears of it."""

import contextlib
import time
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec

from conoid.cases import layout, messages

M = TypeVar("M", bound=messages.Message)


class Listener(Protocol):
    """Who is told of a message once it is in the journal."""

    def tell(self, message: messages.AnyMessage) -> None:
        """Takes the message without waiting for anybody."""


class Journal:
    """Appends to the journal of a run folder, going on from the last number that stands there."""

    def __init__(self, folder: Path, run: str, listener: Listener | None = None) -> None:
        path = folder / layout.JOURNAL
        self._run = run
        self._seq = _last_seq(path)
        self.frames = _frames(path)
        """Indices of the frames that it tells of."""
        self._file = path.open("ab", buffering=0)
        if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
            self._file.write(b"\n")
        self._listener = listener

    def write(self, kind: type[M], step: int = 0, t: float = 0.0, **fields: Any) -> M:
        """Writes one message and passes it on."""
        self._seq += 1
        message = kind(run=self._run, seq=self._seq, wall=time.time(), step=step, t=t, **fields)
        self._file.write(msgspec.json.encode(message) + b"\n")
        if self._listener is not None:
            self._listener.tell(message)  # type: ignore[arg-type]
        return message

    def close(self) -> None:
        """Closes the file; the journal is complete."""
        self._file.close()


def _frames(path: Path) -> set[int]:
    if not path.exists():
        return set()
    found = set()
    for line in path.read_bytes().splitlines():
        with contextlib.suppress(msgspec.DecodeError):
            message = messages.from_json(line)
            if isinstance(message, messages.Frame):
                found.add(message.index)
    return found


def _last_seq(path: Path) -> int:
    """The number of the last line that is whole; one that a crash has torn is passed over."""
    if not path.exists():
        return 0
    for line in reversed(path.read_bytes().splitlines()):
        with contextlib.suppress(msgspec.DecodeError):
            return messages.from_json(line).seq
    return 0
