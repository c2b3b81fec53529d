"""The ``standard`` pressure form as the time step sees it: advances the elements by a step and starts completing shared
nodes; averaging.py has the forms that extend it.

Border chunks come first: they hold every tet of a shared node, so the exchange runs while the interior is computed.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..jit import cpu_time
from ..migration.parcel import Parcel
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from ..state import Block, Copies, Floats, Ints, Model
from ..timers import Timers
from . import records, sweep
from .records import Body, Marks, Means, Motion, Scratch


class Bridges(Protocol):
    """Forces between nodes besides those of tets."""

    def open(self, x: Floats) -> None:
        """Takes the positions of the end of the step."""

    def scatter(self, force: Ints, scale: float) -> int:
        """Adds the forces in quanta of 1 / ``scale`` N; returns the bits of the largest."""


class Herald(Protocol):
    """Has a word for each neighbour that goes with the forces of shared nodes."""

    def words(self, hot: bool) -> Ints:
        """(neighbours,) to send, once the tets of shared nodes are done; ``hot``: some face of theirs is
        overstressed.
        """

    def hear(self, words: Ints) -> None:
        """Takes those of the neighbours."""


class Elements:
    """The elements of one rank in the ``standard`` pressure form; the averaged forms extend it."""

    split = False

    def __init__(self, model: Model, comm: Comm, neighbours: list[Neighbour], timers: Timers) -> None:
        self.model = model
        self._timers = timers
        self._scratch = Scratch.of_rank()
        self.peaks: Ints = self._scratch.peaks
        """(5,) see elements/records.py."""
        self._comm, self._neighbours = comm, neighbours
        self._herald: Herald | None = None
        self._connect()
        self.cohesion: Bridges | None = None
        """What pulls besides the tets."""
        self.pressure = np.zeros(1)
        """(nodes,) nodal pressure, Pa; kept by the ``split`` form only."""

    @property
    def limit_bits(self) -> int:
        """Bits of the largest one-over-stable-step of this rank's tets."""
        return int(self.peaks[records.LARGEST_LIMIT])

    @property
    def limit(self) -> float:
        """The largest one-over-stable-step of this rank's tets, 1/s; NaN when a tet is inverted or not a number."""
        return fixed_point.float_of(self.limit_bits)

    @property
    def limiting(self) -> int:
        """Smallest global id of the tets of this rank that have the limit."""
        return int(self.peaks[records.LIMITING_TET])

    @property
    def force(self) -> float:
        """Largest contribution to a nodal force of this rank, N."""
        return fixed_point.float_of(int(self.peaks[records.LARGEST_FORCE]))

    @property
    def worn(self) -> int:
        """What has been found of worn-out tets (elements/wear.py)."""
        return int(self.peaks[records.WORN])

    @property
    def hot(self) -> bool:
        """Whether some face passes the strength by its tet's own stress."""
        return bool(self.peaks[records.HOT])

    def advance(self, dt: float, scale: float) -> None:
        """Stress and forces at n+1; the completion of the shared forces is under way when it returns."""
        self.peaks[:] = 0
        self._begin(scale)
        self._both_regions(lambda block, begin, end: self._standard(block, begin, end, dt, scale), self._send)

    def again(self, scale: float) -> None:
        """The forces of the present stress in a coarser quantum."""
        limit = self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]]
        self.peaks[records.LARGEST_FORCE] = 0
        self._begin(scale, again=True)
        self._both_regions(lambda block, begin, end: self._again(block, begin, end, scale), self._send)
        self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]] = limit

    def _begin(self, scale: float, again: bool = False) -> None:
        """Forces other than those of tets."""
        nodes = self.model.nodes
        nodes.force[:] = 0
        if self.cohesion is not None:
            if not again:
                self.cohesion.open(nodes.x)
            largest = self.cohesion.scatter(nodes.force, scale)
            self.peaks[records.LARGEST_FORCE] = max(int(self.peaks[records.LARGEST_FORCE]), largest)

    def grow(self, copies: Copies) -> None:
        """Takes up copies of nodes; they are shared already."""
        if not self.shared_forces.serves(self._neighbours):
            self.free()
            self._connect()

    def keep(self, parcel: Parcel) -> None:
        """Adds what the elements must remember besides their state to a parcel; all ranks take part."""
        limit = fixed_point.bits_of(float(self._comm.maximum(np.array([self.limit]))[0]))
        mine = -float(self.limiting) if self.limit_bits == limit else -np.inf
        parcel.known["peaks"] = limit, -int(self._comm.maximum(np.array([mine]))[0])

    def resume(self, parcel: Parcel) -> None:
        """Takes it back."""
        self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]] = parcel.known["peaks"]

    def employ(self, herald: Herald) -> None:
        """From now on a word for each neighbour goes with the forces; neighbours take part."""
        self.free()
        self._herald = herald
        self._connect()

    def finish(self) -> None:
        """Returns when the forces of shared nodes are complete."""
        self.shared_forces.finish(self.model.nodes.force)
        if self._herald is not None:
            self._herald.hear(self.shared_forces.heard)

    def free(self) -> None:
        """Gives the messages of the exchanges back to MPI."""
        for shared in self._exchanges():
            shared.free()

    def _exchanges(self) -> list[SharedSum]:
        return [self.shared_forces]

    def _connect(self) -> None:
        headed = self._herald is not None
        self.shared_forces = SharedSum(self._comm, self._neighbours, 3, Tag.FORCE, headed=headed)

    def _send(self) -> None:
        words = None if self._herald is None else self._herald.words(self.hot)
        self.shared_forces.begin(self.model.nodes.force, words)

    def _both_regions(self, work: Callable[[Block, int, int], None], send: Callable[[], None]) -> None:
        self._over_blocks(work, lambda block: (0, block.border_chunks))
        send()
        self._over_blocks(work, lambda block: (block.border_chunks, block.chunks))

    def _over_blocks(self, work: Callable[[Block, int, int], None], chunks: Callable[[Block], tuple[int, int]]) -> None:
        now = cpu_time()
        for block in self.model.blocks:
            begin, end = chunks(block)
            if begin < end:
                work(block, begin, end)
            start, now = now, cpu_time()
            block.seconds += now - start

    def _standard(self, block: Block, begin: int, end: int, dt: float, scale: float) -> None:
        motion, body, marks = Motion.of(self.model.nodes), Body.of(block), Marks.of(block)
        sweep.standard_pass(motion, body, marks, self._scratch, begin, end, dt, scale)

    def _again(self, block: Block, begin: int, end: int, scale: float) -> None:
        motion, body = Motion.of(self.model.nodes), Body.of(block)
        sweep.forces_again(motion, body, self._scratch, self._means(), begin, end, scale)

    def _means(self) -> Means:
        return Means.none()
