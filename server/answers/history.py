"""History of a run from its journal: a limited number of samples, so that a chart of a run with a million messages is
shown at once.

The journal is read once; later calls read only the new lines of the journal. For most lines only the message type is
decoded. If the number of samples reaches the limit, only every second sample is kept, and from then on only every n-th
new sample, where n doubles each time. Messages about load balance, snapshots and states are rare; all of them are kept.
"""

import re
import threading
from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from conoid.cases.messages import Snapshot, Status
from conoid.cases.output import layout
from conoid.cases.run import State

from ..runs.journal import DAMAGED, Tail, seq_of
from .columns import Columns
from .log_messages import KINDS, Notes

_SAMPLES = 4096
"""Largest number of samples that are kept of a run: a few times the number of pixels across a chart (chosen value)."""
_BYTES = 16 << 20
"""Largest size of the samples of a run, bytes (chosen value); a run of some hundred ranks stays below it."""
_CUTS = 10_000
"""Number of messages about load balance that are kept, the newest ones (chosen value)."""
_RUNS = 16
"""Number of runs whose history is cached: those that were requested last (chosen value)."""
_BLOCK = 4 << 20
"""Number of bytes that are read from the journal at once (chosen value)."""
_TYPE = slice(9, 13)
"""Position in a journal line of four characters that identify the type of its message."""

_SHA256 = re.compile("[0-9a-f]{64}")
_snapshot = msgspec.json.Decoder(Snapshot)
_status = msgspec.json.Decoder(Status)


@dataclass(frozen=True)
class Sample:
    """A sample: for one simulated time, the newest journal line of each message type; b"" if there is no such line
    yet.
    """

    progress: bytes
    load: bytes
    counts: bytes
    snapshot: bytes

    @property
    def size(self) -> int:
        """Size of the sample in bytes, without journal lines that it shares with other samples."""
        return len(self.progress) + len(self.load)


@dataclass
class History:
    """History of a run, from the part of the journal that has been read."""

    path: Path
    last: int = 0
    """``seq`` of the last event of the journal."""
    wall: float = 0.0
    """Unix time of the last status message, s."""
    began: float | None = None
    """Unix time of the start of the worker process, s."""
    state: State = State.ACCEPTED
    samples: list[Sample] = field(default_factory=list)
    newest: Sample | None = None
    cuts: list[bytes] = field(default_factory=list)
    snapshots: dict[int, bytes] = field(default_factory=dict)
    """Lines of the journal about snapshots, by snapshot number."""
    notes: Notes = field(default_factory=Notes)
    answers: dict[int, tuple[int, bytes]] = field(default_factory=dict)
    """Cached HTTP bodies of a run that has ended, by the requested number of points: ``seq`` of the last message, and
    the body."""

    def __post_init__(self) -> None:
        self.lock = threading.Lock()
        self.columns = Columns(self.path.with_name(layout.HISTORY))
        """Reader of the columns of history.csv. The reader of the columns is used under the lock of the history."""
        self._tail = Tail(self.path)
        self._progress = self._counts = self._snapshot = b""
        self._every, self._reports, self._size = 1, 0, 0

    def catch_up(self) -> None:
        """Reads the new lines of the journal. The caller must hold the lock of the history."""
        while block := self._tail.block(_BLOCK):
            lines = block.split(b"\n")
            for line in lines:
                kind = line[_TYPE]
                if kind in KINDS:
                    self.notes.take(line)
                if kind == b"prog":
                    self._progress = line
                elif kind == b"load":
                    self._load(line)
                elif kind == b"coun":
                    self._counts = line
                elif kind in _RARE:
                    self._rare(kind, line)
            self.last = next((seq for line in reversed(lines) if (seq := seq_of(line))), self.last)

    def _load(self, line: bytes) -> None:
        self._reports += 1
        self.newest = Sample(self._progress, line, self._counts, self._snapshot)
        if self._reports % self._every:
            return
        self.samples.append(self.newest)
        self._size += self.newest.size
        if len(self.samples) > _SAMPLES or self._size > _BYTES:
            self.samples = self.samples[1::2]
            self._every *= 2
            self._size = sum(sample.size for sample in self.samples)

    def _rare(self, kind: bytes, line: bytes) -> None:
        try:
            if kind == b"stat":
                self._state(_status.decode(line))
            elif kind == b"snap":
                message = _snapshot.decode(line.decode())
                if Path(message.path).name and _SHA256.fullmatch(message.sha256):
                    self.snapshots[message.n] = self._snapshot = line
            elif msgspec.json.decode(line.decode(), type=msgspec.Raw):
                self.cuts.append(line)
                del self.cuts[:-_CUTS]
        except DAMAGED:
            return

    def _state(self, status: Status) -> None:
        self.state, self.wall = State(status.state), status.wall
        if self.state is State.RUNNING and self.began is None:
            self.began = status.wall


_RARE = frozenset({b"stat", b"snap", b"bala"})


class Histories:
    """Cache of the most recently requested histories. The cache may be used from any thread."""

    def __init__(self) -> None:
        """Creates an empty cache."""
        self._lock = threading.Lock()
        self._known: OrderedDict[Path, History] = OrderedDict()

    def of(self, path: Path) -> History:
        """Returns the history of the journal at ``path``. The caller must hold the lock of the history while it calls
        ``catch_up`` and reads the history.
        """
        with self._lock:
            found = self._known.setdefault(path, History(path))
            self._known.move_to_end(path)
            if len(self._known) > _RUNS:
                self._known.popitem(last=False)
            return found
