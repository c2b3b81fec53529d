"""Counts of a run for its reports: sizes of the model, and number and sizes of fragments. A count is sent when it has
changed.

To find the fragments, all ranks read the state of all their tets (docs/reference/snapshots.md, "Between two
snapshots"). Fragments are therefore searched only when a facet has broken or a tet was removed since the last search,
and never in a scene that can neither break nor erode. The searches may take only a fraction of the wall time: a small
model is searched for every report, a large model every few seconds. Rank 0 decides whether to search, and sends its
decision with the loads.
"""

import math
import time
from typing import Any

import numpy as np

from conoid.cases.model.joined import bodies

from ..fracture import connectivity
from ..kernels.jit import njit, types
from ..model.ids import located, unique
from ..model.state import Floats, Ints, Model
from ..parallel.arguments import reader
from ..parallel.comm import Comm
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team, team
from ..simulation import Simulation
from ..snapshots.table import by_size

SHARE = 1.0 / 50.0
"""Fraction of the wall time that the search for fragments between frames may take. Chosen value: a run of a minute
takes one second longer."""
_TETS = 4096
"""Number of tets in a task. Chosen value: a task takes about 20 us."""
_MEASURE = (
    types.int64[::1], types.float64[:, ::1], types.int64[::1], types.int64[::1], types.uint32[:, ::1],
    types.float64[:, ::1],
)  # fmt: skip
_read_measure = reader(*_MEASURE)


class Counter:
    """Counts of a run. Every method is collective except ``due``."""

    def __init__(self) -> None:
        """Create an object without counts."""
        self._sent: tuple[object, ...] = ()
        self._found: tuple[int, int] = (-1, -1)
        """Number of broken facets and number of tets at the last search for fragments."""
        self._step = -1
        """Number of the step of the last search for fragments."""
        self._again = -math.inf
        """Wall time after which fragments may be searched for again, s, on the clock time.monotonic()."""
        self._fragments, self._smallest, self._sizes = 0, 0, list[int]()

    def due(self, sim: Simulation, now: float, *, ending: bool) -> bool:
        """Return whether fragments must be searched; only rank 0 calls this method.

        ``ending``: True if this is the last report.
        """
        return _changing(sim) and _state(sim) != self._found and (ending or now >= self._again)

    def find(self, sim: Simulation) -> None:
        """Find the fragments and their sizes. The search is omitted if the number of fragments cannot have changed.
        Collective.

        The duration of the first search does not count for the interval between two searches, because the first search
        loads a kernel.
        """
        if not _changing(sim) or (sim.record is None and _state(sim) == self._found):
            return
        began, first = time.monotonic(), self._step < 0
        self._fragments, labels = fragments(sim)
        self._smallest, self._sizes = sizes(sim.model, labels, sim.comm, team(sim.case.run.threads))
        self._found, self._step, ended = _state(sim), sim.clock.step, time.monotonic()
        self._again = ended if first else ended + (ended - began) / SHARE

    def changed(self, sim: Simulation, cuts: int) -> dict[str, Any] | None:
        """Return the fields of a message (messages.Counts), if the counts have changed. ``cuts``: number of new
        divisions of the tets among the ranks so far.
        """
        model, found = sim.model, self._count(sim)
        now = model.elements_global, model.nodes_global, cuts, found, self._found
        if now == self._sent:
            return None
        self._sent = now
        held, shared = sim.comm.gather(sum(block.n for block in model.blocks)), sim.shared_nodes()
        return {
            "elements": model.elements_global, "nodes": model.nodes_global, "shared": shared, "fragments": found,
            "elements_per_rank": held or [], "particles": sim.erosion.particles if sim.erosion is not None else 0,
            "facets": sim.fracture.broken if sim.fracture is not None else 0, "smallest": self._smallest,
            "sizes": self._sizes, "counted": self._step,
        }  # fmt: skip

    def _count(self, sim: Simulation) -> int:
        """Return the number of fragments of the last search. Before the first search, return the number that an earlier
        process of the run found, or the number of bodies.
        """
        if self._step >= 0:
            return self._fragments
        return sim.record.count if sim.record is not None and sim.record.count else len(set(bodies(sim.case)))


def fragments(sim: Simulation) -> tuple[int, list[Ints]]:
    """Return the number of fragments, and the fragment of each tet: one array (n,) for each block. Collective.

    Fragments are separated by broken facets; if no part breaks, they are separated by removed tets. If the neighbours
    of the tets are not stored, the fragments are the bodies of the case.
    """
    if sim.record is not None:
        sim.record.update()
        return sim.record.count, sim.record.labels
    if not _connected(sim):
        return len(set(bodies(sim.case))), of_bodies(sim)
    labels = connectivity.labels(sim.model, np.zeros((0, 2), np.int64), sim.comm)
    return connectivity.count(sim.model, labels, sim.comm), labels


def of_bodies(sim: Simulation) -> list[Ints]:
    """Return the body of each tet (cases/model/joined.py): one array (n,) for each block."""
    body = np.array(bodies(sim.case))
    return [np.full(block.n, body[block.part]) for block in sim.model.blocks]


def _connected(sim: Simulation) -> bool:
    """Return True if the neighbours of the tets are stored (``Block.across``); fragments are found by the
    neighbours.
    """
    return sim.record is not None or sim.contact is not None


def _changing(sim: Simulation) -> bool:
    """Return True if the number of fragments can change."""
    return _connected(sim) and (sim.fracture is not None or sim.erosion is not None)


def _state(sim: Simulation) -> tuple[int, int]:
    return sim.fracture.broken if sim.fracture is not None else 0, sim.model.elements_global


def sizes(model: Model, labels: list[Ints], comm: Comm, threads: Team) -> tuple[int, list[int]]:
    """Return the number of fragments, and a histogram of their sizes (snapshots/table.by_size), on rank 0; (0, []) on
    other ranks. Collective.

    ``labels``: the fragment of each tet, one array (n,) for each block.
    """
    boxes, bounds = [np.zeros(0, np.int64)], [np.zeros((0, 6))]
    measure = Pass(threads, _measure, *_MEASURE, size=_TETS)
    for block, of in zip(model.blocks, labels, strict=True):
        label, reach, counts = np.empty(block.n, np.int64), np.empty((block.n, 6)), np.zeros(measure.many(block.n), int)
        measure.run(block.n, label, reach, counts, of, block.tets, model.nodes.x)
        for k, n in enumerate(counts.tolist()):
            boxes.append(label[_TETS * k : _TETS * k + n])
            bounds.append(reach[_TETS * k : _TETS * k + n])
    pieces = comm.gather(_merged(np.concatenate(boxes), np.concatenate(bounds)))
    return by_size(_extents(pieces)) if pieces is not None else (0, [])


def _merged(labels: Ints, bounds: Floats) -> tuple[Ints, Floats]:
    """Return the distinct labels. Also return the bounds of each label, (g, 6), which are the maxima of the rows of the
    label.
    """
    here = unique(labels)
    reach = np.full((len(here), 6), -np.inf)
    _raise(reach, located(here, labels), bounds)
    return here, reach


def _extents(pieces: list[tuple[Ints, Floats]]) -> Floats:
    """Return (g,) the longest side of the bounding box of each fragment, m. The pieces of a fragment may be on several
    ranks.
    """
    label, of = np.unique(np.concatenate([labels for labels, _ in pieces]), return_inverse=True)
    whole = np.full((len(label), 6), -np.inf)
    np.maximum.at(whole, of, np.concatenate([reach for _, reach in pieces]))
    return np.asarray((whole[:, :3] + whole[:, 3:]).max(axis=1, initial=0.0))


@njit(TASK, cache=True)
def _measure(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: list the fragments of a range of tets, and their ``reach``: upper corner and negative lower corner of the
    bounding box. Successive tets of one fragment share one row.
    """
    labels, reach, counts, of, tets, x = _read_measure(table)
    n = first - 1
    for tet in range(first, stop):
        if n < first or labels[n] != of[tet]:
            n += 1
            labels[n] = of[tet]
            for i in range(6):
                reach[n, i] = -np.inf
        for corner in range(4):
            node = tets[tet, corner]
            for i in range(3):
                reach[n, i] = max(reach[n, i], x[node, i])
                reach[n, 3 + i] = max(reach[n, 3 + i], -x[node, i])
    counts[first // _TETS] = n + 1 - first


@njit("void(float64[:, ::1], int32[::1], float64[:, ::1])", cache=True)
def _raise(reach, of, rows):  # type: ignore[no-untyped-def]
    """Raise the rows ``of`` (k,) of ``reach`` (g, 6) to the values ``rows`` (k, 6)."""
    for k in range(len(rows)):
        for i in range(6):
            reach[of[k], i] = max(reach[of[k], i], rows[k, i])
