"""Pressure that follows the surface: it acts on the present area of each face, along the present normal of the face.

The force of a face, -p (b - a) x (c - a) / 2, is distributed in thirds to its nodes a, b, c. The forces are integers in
quanta that are a power of two, so that sums over faces do not depend on the order of the faces. The sums of shared
nodes are completed in one exchange. Impulses and work are computed as for a traction, with x(n), v(n-1/2) and v(n+1/2)
of the nodes, so the energy account closes for any motion of the surface.

The faces of a closed surface have zero total force and moment up to round-off, which is half a quantum for each node
and face. At the start the largest force on a node of a face is 2^42 quanta.
"""

import math

import numpy as np

from conoid.cases.model.schema import Traction

from ..kernels.jit import njit
from ..migration.parcel import Parcel
from ..model.ids import IdIndex
from ..model.loads import LoadedFaces
from ..model.state import WIDE, Block, Flags, Floats, Indices, Ints, Model, Nodes
from ..model.topology import Split
from ..parallel.arguments import Arguments
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum, complete
from ..parallel.tags import Tag
from . import impulses
from .boundaries import KEPT
from .course import Course
from .drivers import Forcing

_BITS = 42
"""Binary logarithm of the number of quanta in the largest force on a node of a face at the start. Chosen value: the
round-off is 1e-13 of the force of a face. The area of a face may increase by a factor 2^(_MOST - _BITS)."""
_MOST = 56
"""Binary logarithm of the largest number of quanta on a node of a face. With this number of quanta, the sum of the
forces of 64 faces at a node cannot overflow."""


def scale(spec: Traction, outward: Floats) -> float:
    """Returns the number of quanta per newton, for faces with area vectors ``outward`` (m, 3), m^2."""
    largest = abs(spec.pressure or 0.0) * float(np.abs(outward).max(initial=0.0)) / 3.0
    return math.ldexp(1.0, _BITS - math.frexp(largest)[1]) if largest > 0.0 else 1.0


class SurfacePressure(Forcing):
    """Applies a ``pressure``, Pa, to faces. The pressure is multiplied by the mean factor of the ``course`` and acts
    for the mean time step of the kick.

    A rank has the faces of its own tets, and all its nodes that are loaded on any rank.
    """

    on_faces = True

    def __init__(
        self, model: Model, faces: LoadedFaces, pressure: float, course: Course, neighbours: list[Neighbour], comm: Comm
    ) -> None:  # fmt: skip
        """Makes the table of faces, and the list of the loaded nodes. Collective."""
        self._model, self._comm, self._neighbours = model, comm, neighbours
        self._faces, self._corners = faces, model.nodes.places(faces.nodes.reshape(-1)).reshape(-1, 3)
        self._quanta = -pressure * faces.scale / 6.0
        super().__init__(self._agreed(np.zeros(model.nodes.n, bool)), course)
        self._arguments = Arguments(*impulses.PUSH)
        self._places = self._placed()
        self._shared: SharedSum | None = None
        self._sharing: list[Indices] = []
        """Nodes shared with each neighbour at the last planning of the exchange."""
        self._watched: list[tuple[Block, Ints, Ints]] | None = None
        """Blocks of parts that fracture. For each block: its loaded faces, and the places of the tets of these faces.
        The list of blocks is empty before its first use."""

    @property
    def force(self) -> Floats:
        """(n, 3) force on each node, N, at the present positions. If a face has become too large for the quanta, the
        result is NaN, which ends the run with an error on all ranks. Collective.
        """
        sums = np.zeros((len(self.nodes), 3), np.int64)
        largest = _press(sums, self._model.nodes.x, self._corners, self._places, self._quanta)
        shared = self._sums()
        shared.begin(sums)
        shared.finish(sums)
        return np.asarray(sums / (self._faces.scale if largest < 2.0**_MOST else math.nan))

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self._drop_loose_faces()
        self._act(impulses.push, self._arguments, state, self.force, self._duration(dt, t))

    def keep(self, parcel: Parcel, name: str) -> None:
        super().keep(parcel, name)
        parcel.known[f"{name}.scale"] = self._faces.scale
        parcel.rows[f"{name}.faces"] = {"tet": self._faces.tets, "corners": parcel.nodes["id"][self._corners]}

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        booked = [(parcel.nodes[f"{name}.{key}"] != 0.0).reshape(len(parcel.nodes["id"]), -1) for key in KEPT]
        self.nodes = self._agreed(np.asarray(np.concatenate(booked, axis=1).any(axis=1)))
        super().resume(parcel, name, dt)
        self._places = self._placed()

    def grow(self, split: Split, ids: Ints) -> None:
        super().grow(split, ids)
        self._corners = split.followed(self._corners, ids, self._faces.tets)
        self._places = self._placed()

    def drop(self, tets: Ints) -> None:
        self._take(~np.isin(self._faces.tets, tets))
        self._watched = None

    def free(self) -> None:
        if self._shared is not None:
            self._shared.free()
            self._shared = None

    def _take(self, stay: Flags) -> None:
        if not stay.all():
            self._faces, self._corners = self._faces.take(stay), self._corners[stay]
            self._places = self._placed()
            self._watched = None

    def _placed(self) -> Indices:
        """(m, 3) places of the corners of the faces among the nodes of the boundary."""
        return np.searchsorted(self.nodes, self._corners).astype(np.int32)

    def _agreed(self, some: Flags) -> Indices:
        """Returns the nodes ``some`` (nodes,) together with the nodes of the faces, of any rank. Collective."""
        some[self._corners] = True
        sums = some[:, None].astype(np.int64)
        complete(self._comm, self._neighbours, sums, Tag.LOAD)
        return np.flatnonzero(sums).astype(np.int32)

    def _sums(self) -> SharedSum:
        """Returns the exchange of the shared loaded nodes. The exchange is planned again after nodes have separated."""
        if self._shared is None or any(
            one.nodes is not nodes for one, nodes in zip(self._neighbours, self._sharing, strict=True)
        ):
            self.free()
            self._sharing = [each.nodes for each in self._neighbours]
            place = np.full(self._model.nodes.n, -1, np.int32)
            place[self.nodes] = np.arange(len(self.nodes), dtype=np.int32)
            held = [(each.rank, place[each.nodes]) for each in self._neighbours]
            common = [Neighbour(rank, at[at >= 0]) for rank, at in held if (at >= 0).any()]
            self._shared = SharedSum(self._comm, common, 3, Tag.LOAD)
        return self._shared

    def _within(self, block: Block) -> tuple[Block, Ints, Ints]:
        """Returns a block of a part that fractures, its loaded faces, and the places of the tets of these faces."""
        at = IdIndex(block.id).places(self._faces.tets)
        rows = np.flatnonzero(at >= 0)
        return block, rows, at[rows].astype(np.int64)

    def _drop_loose_faces(self) -> None:
        """Removes the load from the faces of tets whose facets are all broken and wide open."""
        if self._watched is None:
            self._watched = [self._within(block) for block in self._model.blocks if len(block.bond)]
        stay = np.ones(len(self._faces.tets), bool)
        for block, rows, tets in self._watched:
            across, bond = block.across[tets], block.bond[tets]
            stay[rows] = ((across >= 0) & (bond != WIDE)).any(axis=1) | (across < 0).all(axis=1)
        self._take(stay)


@njit("float64(int64[:, ::1], float64[:, ::1], int32[:, ::1], int32[:, ::1], float64)", cache=True)
def _press(sums, x, corners, places, factor):  # type: ignore[no-untyped-def]
    """Adds ``factor`` times twice the area vector of each face, in quanta, to ``sums`` (n, 3). ``corners`` (m, 3):
    nodes of the faces; ``places``: rows of these nodes in ``sums``. Returns the largest component.
    """
    largest = 0.0
    for k in range(len(corners)):
        a, b, c = corners[k, 0], corners[k, 1], corners[k, 2]
        for i in range(3):
            j, h = (i + 1) % 3, (i + 2) % 3
            area = (x[b, j] - x[a, j]) * (x[c, h] - x[a, h]) - (x[b, h] - x[a, h]) * (x[c, j] - x[a, j])
            value = np.rint(factor * area)
            if not abs(value) <= largest:
                largest = abs(value)
            if largest < 2.0**62:
                for corner in range(3):
                    sums[places[k, corner], i] += np.int64(value)
    return largest
