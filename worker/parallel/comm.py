"""Communication between ranks. The module defines the operations, and implements them for a single rank. mpi.py
implements the operations with MPI.

All decisions of ranks are maxima or sums of int64 words, which do not depend on the order of the ranks.
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
    """Counts of the data that a rank has sent since the last report: messages to single ranks, and collectives.

    The bytes of a collective are the bytes that this rank contributes. The transfer of an object needs two collectives,
    because the length of the object is sent first.
    """

    messages: int = 0
    bytes: int = 0
    collectives: int = 0
    collective_bytes: int = 0

    def message(self, number: int, size: int) -> None:
        """Count ``number`` messages with a total of ``size`` bytes."""
        self.messages += number
        self.bytes += size

    def collective(self, size: int = 0, number: int = 1) -> None:
        """Count ``number`` collectives; this rank contributes ``size`` bytes to them."""
        self.collectives += number
        self.collective_bytes += size

    def since_last(self) -> dict[str, int]:
        """Return the counts, then set them to zero."""
        counts = asdict(self)
        self.messages = self.bytes = self.collectives = self.collective_bytes = 0
        return counts


class Pending(Protocol):
    """A communication in progress."""

    def finish(self) -> None:
        """Wait until the data has arrived."""


class Comm(Protocol):
    """The operations of a communicator. All operations except ``exchange`` and ``trade`` are collective."""

    rank: int
    size: int
    waited: float
    """CPU seconds of this thread in calls that may wait for other ranks. The packing of objects is not included."""
    sent: Sent

    def begin_maximum(self, words: Ints, result: Ints) -> Pending:
        """Start the element-wise maximum of ``words`` over all ranks. The maximum is in ``result`` once the
        operation has finished.
        """

    def begin_sum(self, words: Ints, result: Ints) -> Pending:
        """Start the element-wise sum of ``words`` over all ranks. The sum is in ``result`` once the operation has
        finished.
        """

    def sum(self, words: Ints) -> Ints:
        """Return the element-wise sum over all ranks."""

    def maximum(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the element-wise maximum over all ranks."""

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: Tag) -> "Exchange":
        """Return an exchange of fixed buffers with other ranks, which can be repeated. Sends and receives are pairs
        (rank, buffer).
        """

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        """Send words to each rank that is a key of ``sends``. Return the words that all ranks have sent to this rank as
        one flat array, by ascending rank. Words of this rank for itself are included.
        """

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        """Send words of any length to the ranks in ``sends``. Return the words of the ranks ``sources`` as one flat
        array, in the order of ``sources``.

        Only ranks that send or receive call this function. The ``sources`` of a rank must be exactly the ranks that
        send words to it. An empty array is sent as an empty message.
        """

    def join(self, words: Ints) -> Ints:
        """Return the words of all ranks as one flat array, in the order of the ranks. Every rank gets the result."""

    def share(self, item: Any) -> list[Any]:
        """Return the items of all ranks in the order of the ranks. Every rank gets the result."""

    def gather(self, item: Any) -> list[Any] | None:
        """Return the items of all ranks in the order of the ranks, on rank 0; None on other ranks."""

    def scatter(self, items: list[Any] | None) -> Any:
        """Return item number ``rank`` of the list that rank 0 has."""

    def broadcast(self, item: Any) -> Any:
        """Return, on every rank, the item of rank 0."""

    def barrier(self) -> None:
        """Wait until every rank has made this call."""

    def await_all(self) -> None:
        """Wait until every rank has made this call. The function is used for long waits, because it sleeps; ``barrier``
        uses the core while it waits.
        """


class Exchange(Protocol):
    """A set of messages with fixed partners and buffers; the messages can be sent repeatedly."""

    def begin(self) -> None:
        """Start all sends and receives."""

    def finish(self) -> None:
        """Wait until the receive buffers are filled and the send buffers may be written again."""

    def free(self) -> None:
        """Free the MPI requests."""


class _Done:
    def begin(self) -> None:
        pass

    def finish(self) -> None:
        pass

    def free(self) -> None:
        pass


class SerialComm:
    """Communicator of a single rank."""

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
            raise ValueError("a single rank cannot exchange messages")
        return _Done()

    def swap(self, sends: dict[int, Ints]) -> dict[int, Ints]:
        return {rank: words.reshape(-1) for rank, words in sends.items()}

    def trade(self, sends: dict[int, Ints], sources: Iterable[int]) -> dict[int, Ints]:
        if sends or list(sources):
            raise ValueError("a single rank cannot trade")
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
