"""Replay of one rank alone: a tape stores the data that a rank receives in a run, and the rank runs again from its
tape.

The command ``mpiexec -n P python -m mpi4py -m tests.bench.tape record FOLDER <arguments of the
worker>`` records the tapes. The command ``python -m tests.bench.tape replay FOLDER RANK <arguments of the worker>``
runs one rank from its tape, and writes the calls of the rank (timeline.Call) into FOLDER. During a replay the rank has
a core and its caches to itself. The replay has the same result as the recorded run, because all data of other ranks and
of the clock is on the tape.
"""

import pickle
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from conoid.client.studies.scaling import CORES
from conoid.worker.model.state import Ints
from conoid.worker.parallel.comm import Comm, Exchange, Pending, Sent
from conoid.worker.parallel.mpi import connect, leave
from conoid.worker.parallel.tags import Tag
from conoid.worker.run import main as worker

from .timeline import Call

_TWICE = ("join", "share", "gather", "scatter", "broadcast")
"""Methods with two collectives each: the first collective sends the length."""


def tape(folder: Path, rank: int) -> Path:
    """Returns the file of the tape of a rank."""
    return folder / f"tape-{rank}"


def calls(folder: Path, rank: int) -> Path:
    """Returns the file of the calls of a rank in its replay."""
    return folder / f"calls-{rank}"


class Recorder:
    """A communicator that records all received data."""

    def __init__(self, comm: Comm, folder: Path) -> None:
        self._comm, self.rank, self.size, self.sent = comm, comm.rank, comm.size, comm.sent
        self._file = tape(folder, comm.rank).open("wb")
        self._crowd = max(comm.size / CORES, 1.0)

    @property
    def waited(self) -> float:
        """Seconds of waiting, as in ``Comm``."""
        return self._comm.waited

    def note(self, data: Any) -> Any:
        """Records received data, and returns this data."""
        pickle.dump(data, self._file)
        return data

    def begin_maximum(self, words: Ints, result: Ints) -> Pending:
        """Method of ``Comm``. If ranks share cores, reports are further apart in time, so that the number of steps
        between them is that of ranks with a core each."""
        from conoid.worker.run import loop  # imported here because it imports numba, see Player.begin

        if self._crowd > 1.0:
            vars(loop)["_REPORT_EVERY"] *= self._crowd
            self._crowd = 1.0
        return _Noted(self, self._comm.begin_maximum(words, result), [result])

    def begin_sum(self, words: Ints, result: Ints) -> Pending:
        """Method of ``Comm``."""
        return _Noted(self, self._comm.begin_sum(words, result), [result])

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: Tag) -> Exchange:
        """Method of ``Comm``."""
        return _Noted(self, self._comm.exchange(sends, receives, tag), [words for _, words in receives])

    def __getattr__(self, name: str) -> Any:
        """Any other method of the communicator; the result of the method is recorded."""
        verb = getattr(self._comm, name)
        return lambda *items: self.note(verb(*items))


class _Noted:
    """An exchange or a pending collective whose results are recorded."""

    def __init__(self, comm: Recorder, inner: Any, results: list[Ints]) -> None:
        self._comm, self._inner, self._results = comm, inner, results

    def begin(self) -> None:
        """Method of ``Exchange``."""
        self._inner.begin()

    def free(self) -> None:
        """Method of ``Exchange``."""
        self._inner.free()

    def finish(self) -> None:
        """Method of ``Comm``."""
        self._inner.finish()
        self._comm.note([words.copy() for words in self._results])


class Player:
    """A communicator that returns the data of a tape, and stores the work of the rank between two calls."""

    waited = 0.0

    def __init__(self, folder: Path, rank: int, size: int) -> None:
        self.rank, self.size = rank, size
        self.sent = _Sent(self)
        self.calls: list[Call] = []
        self._file = tape(folder, rank).open("rb")
        self._clock: Callable[[], float] | None = None
        self._last = 0.0

    def begin(self) -> None:
        """Starts the storage of calls, at the first step."""
        from conoid.worker.kernels.jit import (
            cpu_time,  # imports numba, which must not be imported before the worker has set the cache folder
        )

        self._clock, self._last = cpu_time, cpu_time()

    def note(self, **parts: Any) -> None:
        """Stores the start of a call of the communicator."""
        if self._clock is not None:
            self.calls.append(Call(self._clock() - self._last, **parts))

    def next_data(self) -> Any:
        """Returns the next data of the tape, at the end of a call of the communicator."""
        item = pickle.load(self._file)
        if self._clock is not None:
            self._last = self._clock()
        return item

    def close(self) -> None:
        """Closes the tape at the end of the run."""
        self._file.close()

    def posted(self) -> None:
        """Ends a call of the communicator that waits for no other rank."""
        if self._clock is not None:
            self._last = self._clock()

    def begin_maximum(self, words: Ints, result: Ints) -> Pending:
        """Method of ``Comm``."""
        self.note(enters=True)
        self.posted()
        return _Played(self, {"leaves": 1, "size": words.nbytes * self.size}, [], [result])

    begin_sum = begin_maximum

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: Tag) -> Exchange:
        """Method of ``Comm``."""
        out = [(rank, int(tag), words.nbytes) for rank, words in sends]
        awaited = {"receives": [(rank, int(tag)) for rank, _ in receives]}
        return _Played(self, awaited, out, [words for _, words in receives])

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        """Method of ``Comm``."""
        began = len(self.calls)
        self.note(enters=True, leaves=1, size=8 * self.size)
        received: dict[int, Ints] = self.next_data()
        for call in self.calls[began:]:
            call.sends = [(rank, int(Tag.SWAP), words.nbytes) for rank, words in sends.items() if words.size]
            call.receives = [(rank, int(Tag.SWAP)) for rank in received]
        return received

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        """Method of ``Comm``."""
        out = [(rank, int(Tag.TRADE), words.nbytes) for rank, words in sends.items()]
        self.note(sends=out, receives=[(rank, int(Tag.TRADE)) for rank in sources])
        received: dict[int, Ints] = self.next_data()
        return received

    def __getattr__(self, name: str) -> Any:
        """Any other method of the communicator, which is one collective or two collectives."""
        return lambda *_: self._collective(2 if name in _TWICE else 1)

    def _collective(self, many: int) -> Any:
        began = len(self.calls)
        self.note(enters=True, leaves=many)
        received = self.next_data()
        for call in self.calls[began:]:
            call.size = received.nbytes if isinstance(received, np.ndarray) else 0
        return received


class _Played:
    """An exchange or a pending collective that gets its results from the tape."""

    def __init__(
        self, comm: Player, awaited: dict[str, Any], sends: list[tuple[int, int, int]], results: list[Ints]
    ) -> None:
        self._comm, self._awaited, self._sends, self._results = comm, awaited, sends, results

    def begin(self) -> None:
        """Method of ``Exchange``."""
        self._comm.note(sends=self._sends)
        self._comm.posted()

    def finish(self) -> None:
        """Method of ``Exchange``."""
        self._comm.note(**self._awaited)
        for words, received in zip(self._results, self._comm.next_data(), strict=True):
            words[...] = received
        self._comm.posted()

    def free(self) -> None:
        """Method of ``Exchange``."""


class _Sent(Sent):
    """Counter of sent data. The first use of the counter is at the first step (Loop.run), and starts the storage of
    calls.
    """

    def __init__(self, comm: Player) -> None:
        super().__init__()
        self._comm: Player | None = comm

    def since_last(self) -> dict[str, int]:
        """Method of ``Sent``."""
        if self._comm is not None:
            self._comm.begin()
            self._comm = None
        return {"messages": 0, "bytes": 0, "collectives": 0, "collective_bytes": 0}


def main(mode: str, folder: Path, *words: str) -> int:
    """Runs the worker on all ranks, or one rank alone; returns the exit code."""
    if mode == "record":
        vars(worker)["connect"] = lambda: Recorder(connect(), folder)
        return worker.main(list(words))
    rank, ranks = int(words[0]), len(list(folder.glob(tape(folder, 0).name[:-1] + "*")))
    player = Player(folder, rank, ranks)
    vars(worker)["connect"] = lambda: player
    code = worker.main(list(words[1:]))
    player.close()
    calls(folder, rank).write_bytes(pickle.dumps(player.calls))
    return code


if __name__ == "__main__":
    leave(main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:]))
