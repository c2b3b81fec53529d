"""Several ranks in one process: each rank is a thread with a communicator that implements the protocol of the worker. A
rank that fails wakes all other ranks, so that a test ends with the first error instead of a timeout.
"""

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from conoid.worker.parallel.comm import Sent

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
T = TypeVar("T")
_TRADE_TAG = 91
_PATIENCE = 60.0
"""Time limit, s, of a rank that waits for another rank."""


class World:
    """State that all ranks have in common."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.meeting = threading.Barrier(size, timeout=_PATIENCE)
        self.table: list[Any] = [None] * size
        self._mail: dict[tuple[int, int, int], SimpleQueue[Ints]] = {}
        self._lock = threading.Lock()

    @property
    def unread(self) -> list[tuple[int, int, int]]:
        """Source, target and tag of the messages that were not received."""
        return [name for name, box in self._mail.items() if not box.empty()]

    def box(self, source: int, target: int, tag: int) -> SimpleQueue[Ints]:
        """Returns the queue of messages between two ranks; the same object for both ranks."""
        with self._lock:
            return self._mail.setdefault((source, target, tag), SimpleQueue())


class ThreadComm:
    """Communicator of one rank."""

    def __init__(self, world: World, rank: int) -> None:
        self._world = world
        self.rank, self.size, self.waited = rank, world.size, 0.0
        self.sent = Sent()

    def share(self, item: Any) -> list[Any]:
        self.sent.collective(number=2)
        return self._table(item)

    def _table(self, item: Any) -> list[Any]:
        world = self._world
        world.table[self.rank] = item
        world.meeting.wait()
        everything = list(world.table)
        world.meeting.wait()
        return everything

    def sum(self, words: Ints) -> Ints:
        assert words.dtype == np.int64
        self.sent.collective(words.nbytes)
        return np.asarray(np.sum(self._table(words.copy()), axis=0))

    def maximum(self, values: Floats) -> Floats:
        assert values.dtype == np.float64
        self.sent.collective(values.nbytes)
        return np.asarray(np.max(self._table(values.copy()), axis=0))

    def begin_sum(self, words: Ints, result: Ints) -> "Finished":
        self.sent.collective(words.nbytes)
        result[:] = np.sum(self._table(words.copy()), axis=0)
        return Finished()

    def begin_maximum(self, words: Ints, result: Ints) -> "Finished":
        self.sent.collective(words.nbytes)
        result[:] = np.max(self._table(words.copy()), axis=0)
        return Finished()

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        mine = {rank: np.ascontiguousarray(words).reshape(-1).copy() for rank, words in sends.items()}
        assert all(words.dtype == np.int64 for words in mine.values())
        self.sent.collective(8 * self.size)
        others = [words.nbytes for rank, words in mine.items() if rank != self.rank and len(words)]
        self.sent.message(len(others), sum(others))
        rows = self._table(mine)
        return {rank: row[self.rank].copy() for rank, row in enumerate(rows) if len(row.get(self.rank, ()))}

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        for rank, words in sends.items():
            assert words.dtype == np.int64
            assert rank != self.rank
            self._world.box(self.rank, rank, _TRADE_TAG).put(words.reshape(-1).copy())
        self.sent.message(len(sends), sum(words.nbytes for words in sends.values()))
        return {rank: self._world.box(rank, self.rank, _TRADE_TAG).get(timeout=_PATIENCE) for rank in sources}

    def join(self, words: Ints) -> Ints:
        assert words.dtype == np.int64
        self.sent.collective(8 + words.nbytes, 2)
        return np.concatenate(self._table(words.reshape(-1).copy()))

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: int) -> "Mail":
        return Mail(self._world, self, sends, receives, tag)

    def gather(self, item: Any) -> list[Any] | None:
        everything = self.share(item)
        return everything if self.rank == 0 else None

    def scatter(self, items: list[Any] | None) -> Any:
        whole = self.share(items)[0]
        assert whole is not None
        return whole[self.rank]

    def broadcast(self, item: Any) -> Any:
        return self.share(item)[0]

    def await_all(self) -> None:
        self.barrier()

    def barrier(self) -> None:
        self._world.meeting.wait()


class Finished:
    """Request of a finished communication."""

    def finish(self) -> None:
        pass


class Mail:
    """Persistent messages with fixed partners and buffers; a message of the wrong length is an error."""

    def __init__(
        self, world: World, comm: ThreadComm, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: int
    ) -> None:
        self._sent, rank = comm.sent, comm.rank
        self._sends = [(world.box(rank, target, tag), buffer) for target, buffer in sends]
        self._receives = [(world.box(source, rank, tag), buffer) for source, buffer in receives]

    def begin(self) -> None:
        self._sent.message(len(self._sends), sum(buffer.nbytes for _, buffer in self._sends))
        for box, buffer in self._sends:
            box.put(buffer.copy())

    def finish(self) -> None:
        for box, buffer in self._receives:
            words = box.get(timeout=_PATIENCE)
            assert words.shape == buffer.shape
            buffer[:] = words

    def free(self) -> None:
        pass


def on_ranks(size: int, work: Callable[[ThreadComm], T]) -> list[T]:
    """Returns the result of ``work`` on each of ``size`` ranks; the ranks have to receive all messages that are sent to
    them.
    """
    world = World(size)

    def one(rank: int) -> T:
        try:
            return work(ThreadComm(world, rank))
        except BaseException:
            world.meeting.abort()
            raise

    with ThreadPoolExecutor(size) as pool:
        futures = [pool.submit(one, rank) for rank in range(size)]
    errors = [error for error in (future.exception() for future in futures) if error is not None]
    for error in sorted(errors, key=lambda error: isinstance(error, threading.BrokenBarrierError)):
        raise error
    assert not world.unread, "messages that no rank has received"
    return [future.result() for future in futures]
