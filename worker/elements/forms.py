"""The ``standard`` pressure form as the time step sees it: advances the elements by a step and starts completing shared
nodes; averaging.py has the forms that extend it.

Border chunks come first: they hold every tet of a shared node, so the exchange runs while the interior is computed.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..accounts.timers import Timers
from ..kernels.jit import cpu_time
from ..migration.parcel import Parcel
from ..model.state import Block, Floats, Ints, Model
from ..model.topology import Split
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from ..parallel.team import Team
from . import chunks, records, tasks
from .colours import Coloured, coloured, whole
from .passes import BlockPass, Values
from .records import Means, Scratches


class Bridges(Protocol):
    """Forces between nodes besides those of tets."""

    def open(self, x: Floats) -> None:
        """Takes the positions of the end of the step."""

    def scatter(self, force: Ints, scale: float) -> int:
        """Adds the forces in quanta of 1 / ``scale`` N; returns the bits of the largest."""


class FlagExchange(Protocol):
    """Has a word for each neighbour that goes with the forces of shared nodes."""

    def words(self, hot: bool) -> Ints:
        """(neighbours,) to send, once the tets of shared nodes are done; ``hot``: some face of theirs is
        overstressed.
        """

    def receive(self, words: Ints) -> None:
        """Takes those of the neighbours."""


class Elements:
    """The elements of one rank in the ``standard`` pressure form; the averaged forms extend it."""

    split = False

    def __init__(self, model: Model, comm: Comm, neighbours: list[Neighbour], timers: Timers, team: Team) -> None:
        self.model = model
        self._timers, self._team = timers, team
        self._scratches = Scratches.of(team.threads)
        self.peaks: Ints = self._scratches.peaks[0, : records.PEAKS]
        """(5,) see elements/records.py."""
        self._words = self.peaks.data
        self._reals = self.peaks.view(np.float64).data
        self._standard = BlockPass(tasks.standard, tasks.STANDARD)
        self._again = BlockPass(tasks.again, tasks.AGAIN, marked=False)
        self._coloured: dict[tuple[int, int], tuple[int, Coloured]] = {}
        """By part and first chunk, with how many tets had left the block then."""
        self._comm, self._neighbours = comm, neighbours
        self._flags: FlagExchange | None = None
        self._connect()
        self.cohesion: Bridges | None = None
        """What pulls besides the tets."""
        self.pressure = np.zeros(1)
        """(nodes,) nodal pressure, Pa; kept by the ``split`` form only."""

    @property
    def limit_bits(self) -> int:
        """Bits of the largest one-over-stable-step of this rank's tets."""
        return self._words[records.LARGEST_LIMIT]

    @property
    def limit(self) -> float:
        """The largest one-over-stable-step of this rank's tets, 1/s; NaN when a tet is inverted or not a number."""
        return self._reals[records.LARGEST_LIMIT]

    @property
    def limiting(self) -> int:
        """Smallest global id of the tets of this rank that have the limit."""
        return self._words[records.LIMITING_TET]

    @property
    def force(self) -> float:
        """Largest contribution to a nodal force of this rank, N."""
        return self._reals[records.LARGEST_FORCE]

    @property
    def worn(self) -> int:
        """What has been found of worn-out tets (elements/wear.py)."""
        return self._words[records.WORN]

    @property
    def hot(self) -> bool:
        """Whether some face passes the strength by its tet's own stress."""
        return self._words[records.HOT] != 0

    @property
    def nodal(self) -> list[Floats]:
        """What the nodes carry besides their motion, (nodes,) each, for the digest."""
        return []

    def advance(self, dt: float, scale: float) -> None:
        """Stress and forces at n+1, added to nodal forces that are zero; the completion of the shared ones is under way
        when it returns.
        """
        self._scratches.peaks[:] = 0
        self._bridge(scale, opens=True)
        self._over(self._standard, (), (dt, scale), self._send)

    def again(self, scale: float) -> None:
        """The forces of the present stress in a coarser quantum."""
        limit = self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]]
        self._scratches.peaks[:] = 0
        self.model.nodes.force[:] = 0
        self._bridge(scale, opens=False)
        self._over(self._again, self._means(), (scale,), self._send)
        self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]] = limit

    def _bridge(self, scale: float, *, opens: bool) -> None:
        """Forces other than those of tets."""
        if self.cohesion is None:
            return
        nodes = self.model.nodes
        if opens:
            self.cohesion.open(nodes.x)
        largest = self.cohesion.scatter(nodes.force, scale)
        self.peaks[records.LARGEST_FORCE] = max(int(self.peaks[records.LARGEST_FORCE]), largest)

    def grow(self, split: Split) -> None:
        """Takes up the copies of nodes; they are shared already, and their tets have them."""
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

    def attach(self, flags: FlagExchange) -> None:
        """From now on a word for each neighbour goes with the forces; neighbours take part."""
        self.free()
        self._flags = flags
        self._connect()

    def finish(self) -> None:
        """Returns when the forces of shared nodes are complete."""
        self.shared_forces.finish(self.model.nodes.force)
        if self._flags is not None:
            self._flags.receive(self.shared_forces.received)

    def free(self) -> None:
        """Gives the messages of the exchanges back to MPI."""
        for shared in self._exchanges():
            shared.free()

    def _exchanges(self) -> list[SharedSum]:
        return [self.shared_forces]

    def _connect(self) -> None:
        headed = self._flags is not None
        self.shared_forces = SharedSum(self._comm, self._neighbours, 3, Tag.FORCE, headed=headed)

    def _send(self) -> None:
        words = None if self._flags is None else self._flags.words(self.hot)
        self.shared_forces.begin(self.model.nodes.force, words)

    def _over(self, work: BlockPass, means: Values, numbers: Values, send: Callable[[], None]) -> None:
        """A pass over all tets; ``send``: what the neighbours want as soon as the border chunks are done."""
        if self._neighbours:
            self._over_blocks(work, means, numbers, border=True)
            send()
        self._over_blocks(work, means, numbers, border=False)

    def _over_blocks(self, work: BlockPass, means: Values, numbers: Values, *, border: bool) -> None:
        blocks, nodes = [block for block in self.model.blocks if not block.rigid], self.model.nodes
        now = cpu_time() if len(blocks) > 1 else 0.0
        for block in blocks:
            first = block.border_chunks if self._neighbours else 0
            begin, end = (0, first) if border else (first, block.chunks)
            if begin < end:
                some = self._tasks(block, begin, end)
                table = work.address(nodes, block, self._scratches, means, numbers)
                self._team.run(work.kernel, table, some.tasks, some.starts)
            if len(blocks) > 1:
                start, now = now, cpu_time()
                block.seconds += now - start
        if self._team.threads > 1:
            chunks.gather_peaks(self._scratches.peaks)

    def _tasks(self, block: Block, begin: int, end: int) -> Coloured:
        moved, known = self._coloured.get((block.part, begin), (-1, None))
        if known is None or moved != block.moved:
            alone = self._team.threads == 1
            known = whole(begin, end) if alone else coloured(block, begin, end, self.model.nodes.n)
            self._coloured[block.part, begin] = block.moved, known
        return known

    def _means(self) -> Values:
        return Means.none()
