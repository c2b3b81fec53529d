"""The ``standard`` pressure form as the time step sees it: advances the elements by a step and starts completing shared
nodes; averaging.py has the forms that extend it.

Border chunks come first: they hold every tet of a shared node, so the exchange runs while the interior is computed.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..jit import Kernel, cpu_time
from ..migration.parcel import Parcel
from ..parallel import fixed_point
from ..parallel.arguments import Arguments
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from ..parallel.team import Team
from ..state import Block, Copies, Floats, Ints, Model
from ..timers import Timers
from . import chunks, records, tasks
from .colours import Coloured, coloured, whole
from .records import Body, Marks, Means, Motion, Scratches


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


Pass = Callable[[Block], tuple[Kernel, int]]
"""Of a pass over a block: the kernel, and the address of its arguments."""


class Elements:
    """The elements of one rank in the ``standard`` pressure form; the averaged forms extend it."""

    split = False

    def __init__(self, model: Model, comm: Comm, neighbours: list[Neighbour], timers: Timers, team: Team) -> None:
        self.model = model
        self._timers, self._team = timers, team
        self._scratches = Scratches.of(team.threads)
        self.peaks: Ints = np.zeros(records.PEAKS, np.int64)
        """(5,) see elements/records.py."""
        self._arguments: dict[tuple[Kernel, int], Arguments] = {}
        """By kernel and part."""
        self._coloured: dict[tuple[int, int], tuple[int, Coloured]] = {}
        """By part and first chunk, with how many tets had left the block then."""
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
        self._forget_peaks()
        self._begin(scale)
        self._both_regions(lambda block: self._standard(block, dt, scale), self._send)

    def again(self, scale: float) -> None:
        """The forces of the present stress in a coarser quantum."""
        limit = self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]]
        self._forget_peaks()
        self._begin(scale, again=True)
        self._both_regions(lambda block: self._again(block, scale), self._send)
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

    def _forget_peaks(self) -> None:
        self.peaks[:] = 0
        self._scratches.peaks[:] = 0

    def _both_regions(self, work: Pass, send: Callable[[], None]) -> None:
        self._over_blocks(work, lambda block: (0, block.border_chunks))
        send()
        self._over_blocks(work, lambda block: (block.border_chunks, block.chunks))

    def _over_blocks(self, work: Pass, region: Callable[[Block], tuple[int, int]]) -> None:
        now = cpu_time()
        for block in self.model.blocks:
            begin, end = region(block)
            if begin < end:
                some = self._tasks(block, begin, end)
                self._team.run(*work(block), some.tasks, some.starts)
            start, now = now, cpu_time()
            block.seconds += now - start
        chunks.gather_peaks(self.peaks, self._scratches.peaks)

    def _tasks(self, block: Block, begin: int, end: int) -> Coloured:
        moved, known = self._coloured.get((block.part, begin), (-1, None))
        if known is None or moved != block.moved:
            alone = self._team.threads == 1
            known = whole(begin, end) if alone else coloured(block, begin, end, self.model.nodes.n)
            self._coloured[block.part, begin] = block.moved, known
        return known

    def _pass(self, kernel: Kernel, kinds: tuple[object, ...], block: Block, *values: object) -> tuple[Kernel, int]:
        """The kernel and the address of its arguments for a block: those of all passes, then ``values``."""
        key = kernel, block.part
        if key not in self._arguments:
            self._arguments[key] = Arguments(*kinds)
        return kernel, self._arguments[key].set(Motion.of(self.model.nodes), Body.of(block), *values)

    def _standard(self, block: Block, dt: float, scale: float) -> tuple[Kernel, int]:
        marks = Marks.of(block)
        return self._pass(tasks.standard, tasks.STANDARD, block, marks, self._scratches, dt, scale)

    def _again(self, block: Block, scale: float) -> tuple[Kernel, int]:
        return self._pass(tasks.again, tasks.AGAIN, block, self._scratches, self._means(), scale)

    def _means(self) -> Means:
        return Means.none()
