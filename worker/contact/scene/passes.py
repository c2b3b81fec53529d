"""Passes over the slots, faces and edges of a scene, run by the threads of a rank."""

import numpy as np

from ...kernels.jit import njit, prefetch, types
from ...model.ids import IdIndex
from ...model.state import Flags, Floats, Indices, Ints
from ...parallel.arguments import reader
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team
from ..broad_phase import buckets
from ..surface import sharp
from ..surface.records import AGED, OPEN
from ..surface.sharp import TURNED

_SLOTS, _EDGES, _TURNED = 2048, 8192, 2048
"""Number of slots in a task, number of faces or edges in a task, and number of edges in a task that computes angles.
Chosen values: a task takes 10 to 20 us, compared with 2 us to start a parallel region."""
_AHEAD = 16
"""Distance, in nodes, by which kernels prefetch the data of nodes."""
_SPARSE = 32
"""Largest ratio of the largest id to the number of wanted ids for which a table of all ids is used. For a larger ratio
the ids are found by bisection, because the table takes longer to fill (model/ids.py)."""
_I, _I1, _B1, _U2, _F2, _N1, _N2 = (
    types.int64, types.int64[::1], types.boolean[::1], types.uint8[:, ::1], types.float64[:, ::1], types.int32[::1],
    types.int32[:, ::1],
)  # fmt: skip
_STORE = _F2, _F2, _N1, _N1
_EXPOSE = _U2, _B1, _B1, _N2, _B1
_ENLIVEN = _B1, _B1, _N2, _N2, _U2, _B1, _B1
_FLAG = _B1, _N2, _I, _B1
_LOOK_UP = _N1, _I1, _N1
_FLAG_CORNERS = _B1, _N2, _I
_CURVE = _I1, _F2, types.float64[::1], types.float64
_read_turn, _read_curve = reader(*TURNED), reader(*_CURVE)
_read_look_up, _read_flag_corners = reader(*_LOOK_UP), reader(*_FLAG_CORNERS)
_read_store, _read_expose, _read_enliven, _read_flag = (
    reader(*_STORE),
    reader(*_EXPOSE),
    reader(*_ENLIVEN),
    reader(*_FLAG),
)


@njit(TASK, cache=True)
def _store(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: copies the velocities ``v`` of ``local`` nodes to the slots ``held``."""
    out, v, held, local = _read_store(table)
    for h in range(first, stop):
        prefetch(v, 3 * local[min(h + _AHEAD, len(local) - 1)])
        for i in range(3):
            out[held[h], i] = v[local[h], i]


@njit(TASK, cache=True)
def _expose(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the state OPEN of edges whose faces are exposed, and updates ``meets``, which is True for edges in
    edge-edge contact (SceneEdges). ``faces`` (e, 2): faces of the edges; ``shown`` (f,): exposed faces.
    """
    opened, meets, fresh, faces, shown = _read_expose(table)
    for e in range(first, stop):
        for k in range(2):
            if faces[e, k] >= 0 and shown[faces[e, k]] and opened[e, k] < OPEN:
                opened[e, k], fresh[e] = OPEN, True
        meets[e] = min(opened[e, 0], opened[e, 1]) >= AGED and max(opened[e, 0], opened[e, 1]) == OPEN


@njit(TASK, cache=True)
def _enliven(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: adds ``sharp`` edges to the broad phase.

    An edge is added if both of its ``faces`` (e, 2) are in the broad phase (``searched`` (f,)). For one of the two
    faces it is sufficient that its state in ``opened`` (e, 2) is not 0. A face that this rank does not have is treated
    as being in the broad phase, because its exposure is unknown.
    """
    live, new, edges, faces, opened, sharp, searched = _read_enliven(table)
    for e in range(first, stop):
        one, both = False, sharp[e] and edges[e, 0] != edges[e, 1]
        for k in range(2):
            some = faces[e, k] < 0 or searched[faces[e, k]]
            one, both = one or some, both and (some or opened[e, k] >= AGED)
        new[e] |= both and one and not live[e]
        live[e] = both and one


@njit(TASK, cache=True)
def _flag(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: flags each face or edge if at least one of its first ``many`` corners is a flagged slot."""
    out, corners, many, slots = _read_flag(table)
    for f in range(first, stop):
        for k in range(many):
            out[f] |= slots[corners[f, k]]


@njit(TASK, cache=True)
def _look_up(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets ``out`` to the rows of ids, with a table of all ids up to the largest id."""
    out, ids, rows = _read_look_up(table)
    for k in range(first, stop):
        out[k] = rows[ids[k]] if ids[k] < len(rows) else -1


@njit(TASK, cache=True)
def _turn(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sharp.turned`` for a range of edges."""
    found, is_sharp, corners, meets, x, part, least = _read_turn(table)
    sharp.turned(found, is_sharp, corners, meets, x, part, least, first, stop)


@njit(TASK, cache=True)
def _curve(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``buckets.interleaved`` for a range of points."""
    codes, x, origin, inverse = _read_curve(table)
    buckets.interleaved(codes, x, origin, inverse, first, stop)


@njit(TASK, cache=True)
def _flag_corners(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: flags the slots that are among the first ``many`` corners of faces or edges."""
    out, corners, many = _read_flag_corners(table)
    for f in range(first, stop):
        for k in range(many):
            out[corners[f, k]] = True


class ScenePasses:
    """Passes over the slots, faces and edges of the scenes of a rank."""

    def __init__(self, team: Team) -> None:
        self.store = Pass(team, _store, *_STORE, size=_SLOTS)
        """Pass that copies velocities to slots."""
        self.expose = Pass(team, _expose, *_EXPOSE, size=_EDGES)
        """Pass that updates the states of edges."""
        self.enliven = Pass(team, _enliven, *_ENLIVEN, size=_EDGES)
        """Pass that adds edges to the broad phase."""
        self.flag_faces, self.flag_edges = (Pass(team, _flag, *_FLAG, size=_EDGES) for _ in range(2))
        """Passes that flag the faces and the edges at flagged slots."""
        self._turn, self._curve = Pass(team, _turn, *TURNED, size=_TURNED), Pass(team, _curve, *_CURVE, size=_SLOTS)
        self._look_up = Pass(team, _look_up, *_LOOK_UP, size=_EDGES)
        self._flag_corners = Pass(team, _flag_corners, *_FLAG_CORNERS, size=_EDGES)

    def located(self, known: Ints, wanted: Ints) -> Indices:
        """Positions in ``known`` of the ids ``wanted``, in the shape of ``wanted``; -1 for ids that are not in
        ``known``. The elements of ``known`` may have any order.
        """
        if _SPARSE * wanted.size < (largest := int(known.max(initial=-1))):
            return IdIndex(known).places(wanted)
        out, rows = np.empty(wanted.shape, np.int32), np.full(largest + 1, -1, np.int32)
        rows[known] = np.arange(len(known), dtype=np.int32)
        self._look_up.run(wanted.size, out.reshape(-1), wanted.reshape(-1), rows)
        return out

    def flag_corners(self, out: Flags, corners: Indices, many: int) -> None:
        """Flags, in ``out`` (slots,), the slots that are among the first ``many`` columns of ``corners`` (n, k)."""
        self._flag_corners.run(len(corners), out, corners, many)

    def turned(self, sharp: Flags, corners: Indices, meets: Flags, x: Floats, part: Indices, least: Floats) -> Flags:
        """(e,) True for each edge that becomes sharp; see sharp.turned."""
        found = np.empty(len(sharp), bool)
        self._turn.run(len(sharp), found, sharp, corners, meets, x, part, least)
        return found

    def curve(self, x: Floats, edge: float) -> Ints:
        """(n,) position of each point (n, 3) on a space-filling curve (Morton 1966). The curve runs through cells with
        the edge length ``edge``, m. Neighbours on the curve are neighbours in space.
        """
        codes = np.empty(len(x), np.int64)
        if len(x):
            self._curve.run(len(x), codes, x, x.min(axis=0), 1.0 / edge)
        return codes
