"""The ``standard`` pressure form, with the methods that the time step calls. The methods advance the elements by a step
and start the completion of the sums at shared nodes. The other forms are in averaging.py.

Border chunks are computed before interior chunks. Border chunks contain every tet of a shared node, so the exchange
runs during the pass over the interior chunks.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..accounts.timers import Timers
from ..kernels.jit import cpu_time, wall_time
from ..migration.parcel import Parcel
from ..model.state import Block, Floats, Ints, Model
from ..model.topology import Split
from ..parallel import fixed_point
from ..parallel.arguments import Follow
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from ..parallel.team import Stage, Team
from . import chunks, records, tasks
from .chunk_tasks import ChunkTasks
from .passes import BlockPass, Values
from .records import Means, Scratches


class Bridges(Protocol):
    """Forces between nodes that are not forces of tets: those of cohesive facets."""

    def open(self, x: Floats) -> None:
        """Computes the forces at the positions ``x``, which are those at the end of the step."""

    def scatter(self, force: Ints, scale: float) -> int:
        """Adds the forces, in quanta of 1 / ``scale`` N. Returns the largest force as its bit pattern (integer)."""


class FlagExchange(Protocol):
    """Flags for the neighbour ranks. The flags are sent together with the forces of shared nodes."""

    def words(self, hot: bool) -> Ints:
        """(neighbours,) flags to send, computed after the tets at shared nodes. ``hot``: True if a face of these tets
        is overstressed.
        """

    def receive(self, words: Ints) -> None:
        """Stores the flags of the neighbours."""


class Elements:
    """Elements of one rank in the ``standard`` pressure form; the averaged forms extend it."""

    split = False

    def __init__(self, model: Model, comm: Comm, neighbours: list[Neighbour], timers: Timers, team: Team) -> None:
        self.model = model
        self._timers, self.team = timers, team
        self.scratches = Scratches.of(team.threads)
        """Scratch memory and peaks of each thread."""
        self.peaks: Ints = self.scratches.peaks[0, : records.PEAKS]
        """(5,) peaks over all tets of the rank, see elements/records.py."""
        self._words = self.peaks.data
        self._reals = self.peaks.view(np.float64).data
        self._standard = BlockPass(tasks.standard, tasks.STANDARD)
        self._again = BlockPass(tasks.again, tasks.AGAIN, marked=False)
        self._tasks = ChunkTasks(team)
        self._comm, self._neighbours = comm, neighbours
        self._flags: FlagExchange | None = None
        self._connect()
        self.cohesion: Bridges | None = None
        """Cohesive facets; None if the case has none."""

    @property
    def pressure(self) -> Floats:
        """(rows,) nodal pressure, Pa, in the ``split`` form; in other forms an array with one row."""
        return np.zeros(1)

    @property
    def limit_bits(self) -> int:
        """Bit pattern of the largest 1 / stable step of this rank's tets."""
        return self._words[records.LARGEST_LIMIT]

    @property
    def limit(self) -> float:
        """Largest 1 / stable step of this rank's tets, 1/s. The value is NaN if a tet is inverted or has a value that
        is not a number.
        """
        return self._reals[records.LARGEST_LIMIT]

    @property
    def limiting(self) -> int:
        """Smallest global id of the tets of this rank whose 1 / stable step equals ``limit``."""
        return self._words[records.LIMITING_TET]

    @property
    def force(self) -> float:
        """Largest magnitude of a contribution of this rank to a nodal force, N."""
        return self._reals[records.LARGEST_FORCE]

    @property
    def worn(self) -> int:
        """State of the tets that erosion will remove: SOUND, TIRED or BROKEN (elements/wear.py)."""
        return self._words[records.WORN]

    @property
    def hot(self) -> bool:
        """True if a face is overstressed by the stress of its own tet."""
        return self._words[records.HOT] != 0

    @property
    def nodal(self) -> list[Floats]:
        """Nodal arrays of the pressure form for the digest, (nodes,) each."""
        return []

    def advance(self, dt: float, scale: float) -> None:
        """Computes stress and forces at n+1. Adds the forces to nodal sums, which must be zero on entry. On return the
        completion of the sums at shared nodes is in progress.
        """
        self.scratches.peaks[:] = 0
        self._bridge(scale, opens=True)
        self._over(self._standard, (), (dt, scale), self._send)

    def advancing(self, dt: Follow, scale: Follow) -> list[tuple[Stage, Block | None]]:
        """Returns the passes of ``advance`` on a single rank as stages of a program, with the block of each stage.
        ``scratches.peaks`` must be zero before the stages.
        """
        return self._staged(self._standard, (), (dt, scale))

    def ending(self, scale: Follow) -> list[Stage] | None:
        """Returns the kernels of ``finish`` on a single rank as stages of a program; None if code outside of the
        program is needed.
        """
        return []

    def went_on(self, scale: float) -> None:
        """Sets the scale of the last sum of forces, after a program of steps."""

    def again(self, scale: float) -> None:
        """Sums the forces of the present stress again, in a larger quantum than before."""
        limit = self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]]
        self.scratches.peaks[:] = 0
        self.model.nodes.force[:] = 0
        self._bridge(scale, opens=False)
        self._over(self._again, self._means(), (scale,), self._send)
        self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]] = limit

    def _bridge(self, scale: float, *, opens: bool) -> None:
        """Adds the forces of cohesive facets."""
        if self.cohesion is None:
            return
        nodes = self.model.nodes
        if opens:
            self.cohesion.open(nodes.x)
        largest = self.cohesion.scatter(nodes.force, scale)
        self.peaks[records.LARGEST_FORCE] = max(int(self.peaks[records.LARGEST_FORCE]), largest)

    def grow(self, split: Split) -> None:
        """Extends the exchange of forces after a separation of nodes. Before the call, the copies must be shared nodes
        and the tets must have their new nodes.
        """
        if not self.shared_forces.serves(self._neighbours):
            self.free()
            self._connect()

    def keep(self, parcel: Parcel) -> None:
        """Adds the state of the pressure form to a parcel (a checkpoint or migration message), without the state of the
        tets. Collective.
        """
        limit = fixed_point.bits_of(float(self._comm.maximum(np.array([self.limit]))[0]))
        mine = -float(self.limiting) if self.limit_bits == limit else -np.inf
        parcel.known["peaks"] = limit, -int(self._comm.maximum(np.array([mine]))[0])

    def resume(self, parcel: Parcel) -> None:
        """Restores the state of the pressure form from a parcel (a checkpoint or migration message)."""
        self.peaks[[records.LARGEST_LIMIT, records.LIMITING_TET]] = parcel.known["peaks"]

    def attach(self, flags: FlagExchange) -> None:
        """Sends the given flags together with the forces, after this call. Collective among neighbours."""
        first, self._flags = self._flags is None, flags
        if first:
            self.free()
            self._connect()

    def finish(self) -> None:
        """Waits until the sums of forces at shared nodes are complete."""
        self.shared_forces.finish(self.model.nodes.force)
        if self._flags is not None:
            self._flags.receive(self.shared_forces.received)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
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
        """Passes over all tets. Calls ``send`` after the border chunks."""
        if self._neighbours:
            self._over_blocks(work, means, numbers, border=True)
            send()
        self._over_blocks(work, means, numbers, border=False)

    def _over_blocks(self, work: BlockPass, means: Values, numbers: Values, *, border: bool) -> None:
        blocks, nodes = [block for block in self.model.blocks if not block.rigid and block.chunks], self.model.nodes
        if self.team.threads > 1 and len(blocks) > 1 and not self._neighbours:
            self._over_joined(work, blocks, means, numbers)
            return
        clock = cpu_time if self._neighbours else wall_time  # the wall clock needs no system call
        now = clock() if len(blocks) > 1 else 0.0
        for block in blocks:
            first = block.border_chunks if self._neighbours else 0
            begin, end = (0, first) if border else (first, block.chunks)
            if begin < end:
                some = self._tasks.of(block, begin, end, nodes.n)
                table = work.address(nodes, block, self.scratches, means, numbers)
                self.team.run(work.kernel, table, some.tasks, some.starts)
            if len(blocks) > 1:
                start, now = now, clock()
                block.seconds += now - start
        if self.team.threads > 1:
            chunks.gather_peaks(self.scratches.peaks)

    def _over_joined(self, work: BlockPass, blocks: list[Block], means: Values, numbers: Values) -> None:
        """Passes over several blocks in one parallel region."""
        began, nodes = wall_time(), self.model.nodes
        tables = [work.address(nodes, block, self.scratches, means, numbers) for block in blocks]
        shares = self._tasks.run_joined(work.kernel, tables, blocks, nodes.n)
        passed = wall_time() - began
        for block, share in zip(blocks, shares.tolist(), strict=True):
            block.seconds += passed * share
        chunks.gather_peaks(self.scratches.peaks)

    def _staged(self, work: BlockPass, means: Values, numbers: Values) -> list[tuple[Stage, Block | None]]:
        """Returns a pass over all tets of a single rank as stages of a program."""
        found: list[tuple[Stage, Block | None]] = []
        for block in self.model.blocks:
            if not block.rigid and block.chunks:
                some = self._tasks.of(block, 0, block.chunks, self.model.nodes.n)
                table, ties = work.bind(self.model.nodes, block, self.scratches, means, numbers)
                found.append((Stage(work.kernel, table, some.tasks, some.starts, ties), block))
        return found

    def _means(self) -> Values:
        return Means.none()
