"""The only module that imports MPI: the communicator of all ranks, and the end of a process."""

import os
import pickle
import sys
import time
from collections.abc import Iterable
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ..model.state import Ints
from .comm import Comm, Exchange, Pending, Sent, SerialComm
from .tags import Tag

_NAP = 0.01
"""Interval between two checks in a wait that leaves the core to other processes, s. Chosen value: a hundredth of the
start time of a rank."""


class MpiComm:
    """Communicator of all ranks of MPI's world."""

    def __init__(self) -> None:
        from mpi4py import MPI

        self._mpi = MPI
        self._world = MPI.COMM_WORLD
        self.rank: int = self._world.Get_rank()
        self.size: int = self._world.Get_size()
        self.waited = 0.0
        self.sent = Sent()
        MPI.pickle.__init__(self._pickled, self._unpickled)  # type: ignore[misc]

    def waiting(self, sign: int = 1) -> "_Waiting":
        """Return a context that adds the CPU time of its block to ``waited``. If ``sign`` is -1, the context subtracts
        this time.
        """
        return _Waiting(self, sign)

    def _pickled(self, item: Any, protocol: int | None = None) -> bytes:
        """Pickle an item. The time of pickling counts as work, even if the surrounding call counts as waiting."""
        with self.waiting(-1):
            data = pickle.dumps(item, protocol)
        self.sent.collective_bytes += len(data)
        return data

    def _unpickled(self, data: Any) -> Any:
        with self.waiting(-1):
            return pickle.loads(data)

    def begin_maximum(self, words: Ints, result: Ints) -> Pending:
        self.sent.collective(words.nbytes)
        return _MpiPending(self, self._world.Iallreduce(words, result, self._mpi.MAX))

    def begin_sum(self, words: Ints, result: Ints) -> Pending:
        self.sent.collective(words.nbytes)
        return _MpiPending(self, self._world.Iallreduce(words, result, self._mpi.SUM))

    def sum(self, words: Ints) -> Ints:
        result = np.empty_like(words)
        self.sent.collective(words.nbytes)
        with self.waiting():
            self._world.Allreduce(words, result, self._mpi.SUM)
        return result

    def maximum(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        result = np.empty_like(values)
        self.sent.collective(values.nbytes)
        with self.waiting():
            self._world.Allreduce(values, result, self._mpi.MAX)
        return result

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: Tag) -> Exchange:
        requests = [self._world.Recv_init(buffer, source, tag) for source, buffer in receives]
        requests += [self._world.Send_init(buffer, target, tag) for target, buffer in sends]
        size = sum(buffer.nbytes for _, buffer in sends)
        return _MpiExchange(self, self._mpi.Prequest, requests, (len(sends), size))

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        mine = {rank: np.ascontiguousarray(words).reshape(-1) for rank, words in sends.items() if words.size}
        counts = np.zeros(self.size, np.int64)
        for rank, words in mine.items():
            counts[rank] = len(words)
            if rank != self.rank:
                self.sent.message(1, words.nbytes)
        theirs = np.empty_like(counts)
        self.sent.collective(counts.nbytes)
        with self.waiting():
            self._world.Alltoall(counts, theirs)
        received = {rank: np.empty(count, np.int64) for rank, count in enumerate(theirs.tolist()) if count}
        if received or mine:
            requests = [self._world.Irecv(buffer, rank, Tag.SWAP) for rank, buffer in received.items()]
            requests += [self._world.Isend(words, rank, Tag.SWAP) for rank, words in mine.items()]
            with self.waiting():
                self._mpi.Request.Waitall(requests)
        return received

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        mine = {rank: np.ascontiguousarray(words) for rank, words in sends.items()}
        requests = [self._world.Isend(words, rank, Tag.TRADE) for rank, words in mine.items()]
        self.sent.message(len(mine), sum(words.nbytes for words in mine.values()))
        theirs, status = {}, self._mpi.Status()
        with self.waiting():
            for rank in sources:
                while (message := self._world.Improbe(rank, Tag.TRADE, status=status)) is None:
                    os.sched_yield()  # Mprobe would poll on a core that the other rank may need
                theirs[rank] = np.empty(status.Get_count(self._mpi.INT64_T), np.int64)
                message.Recv(theirs[rank])
            self._mpi.Request.Waitall(requests)
        return theirs

    def join(self, words: Ints) -> Ints:
        counts = np.empty(self.size, np.int64)
        self.sent.collective(8 + words.nbytes, 2)
        with self.waiting():
            self._world.Allgather(np.array([words.size]), counts)
            every = np.empty(counts.sum(), np.int64)
            if len(every):
                self._world.Allgatherv(np.ascontiguousarray(words), (every, counts))
        return every

    def share(self, item: Any) -> list[Any]:
        self.sent.collective(number=2)
        with self.waiting():
            return self._world.allgather(item)

    def gather(self, item: Any) -> list[Any] | None:
        self.sent.collective(number=2)
        with self.waiting():
            return self._world.gather(item)

    def scatter(self, items: list[Any] | None) -> Any:
        self.sent.collective()
        with self.waiting():
            if self.rank == 0:
                assert items is not None
                for target in range(1, self.size):
                    self._world.send(items[target], target, Tag.SCATTER)
                return items[0]
            return self._world.recv(source=0, tag=Tag.SCATTER)

    def broadcast(self, item: Any) -> Any:
        self.sent.collective(number=2)
        with self.waiting():
            return self._world.bcast(item)

    def barrier(self) -> None:
        self.sent.collective()
        with self.waiting():
            self._world.Barrier()

    def await_all(self) -> None:
        self.sent.collective()
        arrived = self._world.Ibarrier()
        with self.waiting():
            while not arrived.Test():
                time.sleep(_NAP)


class _Waiting:
    """Context of a block of code that waits. The context is a class, because every step enters dozens of such contexts,
    and a context made from a generator takes longer.
    """

    __slots__ = ("_comm", "_sign", "_start")

    def __init__(self, comm: MpiComm, sign: int) -> None:
        self._comm, self._sign = comm, sign

    def __enter__(self) -> None:
        self._start = time.thread_time()

    def __exit__(self, *_: object) -> None:
        self._comm.waited += self._sign * (time.thread_time() - self._start)


class _MpiPending:
    def __init__(self, comm: MpiComm, request: Any) -> None:
        self._comm = comm
        self._request = request

    def finish(self) -> None:
        with self._comm.waiting():
            self._request.Wait()


class _MpiExchange:
    def __init__(self, comm: MpiComm, kind: Any, requests: list[Any], sends: tuple[int, int]) -> None:
        """``sends``: number of messages, and number of bytes of the messages."""
        self._comm = comm
        self._kind = kind
        self._requests = requests
        self._sends = sends

    def begin(self) -> None:
        self._comm.sent.message(*self._sends)
        self._kind.Startall(self._requests)

    def finish(self) -> None:
        with self._comm.waiting():
            self._kind.Waitall(self._requests)

    def free(self) -> None:
        for request in self._requests:
            request.Free()


def leave(code: int) -> NoReturn:
    """End this rank with an exit code, after all ranks have finished; no rank is aborted.

    The process must end normally (no ``os._exit``). Otherwise MPICH does not deregister from the launcher, and the
    launcher kills the other ranks.
    """
    from mpi4py import MPI

    MPI.Finalize()
    sys.exit(code)


def abort(code: int) -> NoReturn:
    """End all ranks of the run at once, with an exit code."""
    from mpi4py import MPI

    MPI.COMM_WORLD.Abort(code)
    raise SystemExit(code)


def connect() -> Comm:
    """Return the communicator of MPI's world if the world has several ranks, else the serial communicator."""
    world = MpiComm()
    return world if world.size > 1 else SerialComm()
