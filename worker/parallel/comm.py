"""What ranks say to each other, and its meaning on one rank; mpi.py says it by MPI.

Everything that decides is a maximum over int64 words, or a sum of integers: no order of ranks can change a bit of it.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..model.state import Ints
from .tags import Tag


@dataclass
class Sent:
    """What a rank has sent since the last report: messages to single ranks, and collectives.

    The bytes of a collective are those that the rank puts in. An object takes two of them: its length goes ahead.
    """

    messages: int = 0
    bytes: int = 0
    collectives: int = 0
    collective_bytes: int = 0

    def message(self, number: int, size: int) -> None:
        """Counts a number of messages of ``size`` bytes in all."""
        self.messages += number
        self.bytes += size

    def collective(self, size: int = 0, number: int = 1) -> None:
        """Counts a collective to which this rank gives ``size`` bytes."""
        self.collectives += number
        self.collective_bytes += size

    def since_last(self) -> dict[str, int]:
        """The counts, which begin anew."""
        counts = asdict(self)
        self.messages = self.bytes = self.collectives = self.collective_bytes = 0
        return counts


class Pending(Protocol):
    """A communication under way."""

    def finish(self) -> None:
        """Returns when the data has arrived."""


class Comm(Protocol):
    """What the worker asks of a communicator."""

    rank: int
    size: int
    waited: float
    """CPU seconds of this thread in calls that may wait for other ranks, but for the packing of objects."""
    sent: Sent

    def begin_maximum(self, words: Ints, result: Ints) -> Pending:
        """Element-wise maximum of ``words`` over all ranks, in ``result`` once finished."""

    def begin_sum(self, words: Ints, result: Ints) -> Pending:
        """Element-wise sum of ``words`` over all ranks, in ``result`` once finished."""

    def sum(self, words: Ints) -> Ints:
        """Element-wise sum over all ranks."""

    def maximum(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Element-wise maximum over all ranks."""

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: Tag) -> "Exchange":
        """A repeatable exchange of fixed buffers with other ranks."""

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        """What each rank has for this one, flat, by ascending rank, its own included; nothing is sent for no key."""

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        """What each of the ``sources`` has for this rank, flat, in their order. They, and only they, send to it in a
        call of their own, as it is a source of those that it ``sends`` to. Of any length; what is nothing is sent
        empty.
        """

    def join(self, words: Ints) -> Ints:
        """The words of all ranks, flat, one rank's after the other's, on every rank."""

    def share(self, item: Any) -> list[Any]:
        """The items of all ranks, in order, on every rank."""

    def gather(self, item: Any) -> list[Any] | None:
        """The items of all ranks, in order, on rank 0; None elsewhere."""

    def scatter(self, items: list[Any] | None) -> Any:
        """Item ``rank`` of rank 0's list."""

    def broadcast(self, item: Any) -> Any:
        """Rank 0's item."""

    def barrier(self) -> None:
        """Returns when every rank has come here."""

    def await_all(self) -> None:
        """As ``barrier``; the wait may be long, and leaves the core to others."""


class Exchange(Protocol):
    """A set of messages with fixed partners and buffers, sent again and again."""

    def begin(self) -> None:
        """Starts all sends and receives."""

    def finish(self) -> None:
        """Returns when the receive buffers are filled and the send buffers may be written again."""

    def free(self) -> None:
        """Gives the messages back to MPI."""


class _Done:
    def begin(self) -> None:
        pass

    def finish(self) -> None:
        pass

    def free(self) -> None:
        pass


class SerialComm:
    """One rank: every verb keeps its meaning."""

    rank = 0
    size = 1
    waited = 0.0

    def __init__(self) -> None:
        self.sent = Sent()

    def begin_maximum(self, words: Ints, result: Ints) -> Pending:
        result[:] = words
        return _Done()

    def begin_sum(self, words: Ints, result: Ints) -> Pending:
        result[:] = words
        return _Done()

    def sum(self, words: Ints) -> Ints:
        return words.copy()

    def maximum(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return values.copy()

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: Tag) -> Exchange:
        if sends or receives:
            raise ValueError("one rank has nobody to exchange with")
        return _Done()

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        return {rank: words.reshape(-1) for rank, words in sends.items()}

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        if sends or list(sources):
            raise ValueError("one rank has nobody to trade with")
        return {}

    def join(self, words: Ints) -> Ints:
        return words.reshape(-1)

    def share(self, item: Any) -> list[Any]:
        return [item]

    def gather(self, item: Any) -> list[Any] | None:
        return [item]

    def scatter(self, items: list[Any] | None) -> Any:
        assert items is not None
        return items[0]

    def broadcast(self, item: Any) -> Any:
        return item

    def barrier(self) -> None:
        pass

    def await_all(self) -> None:
        pass
