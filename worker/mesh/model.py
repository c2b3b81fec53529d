"""Tet meshes: nodes, tets, and the checks of a usable mesh.

Node order of a tet, positive: seen from node 3, nodes 0, 1, 2 run clockwise::

          3
         /|\\
        / | \\          6 V = (x1 - x0) x (x2 - x0) . (x3 - x0) > 0
       /  |  \\
      0---|---2
       \\  |  /
        \\ | /
          1
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Ids = NDArray[np.int64]

MAX_TETS = 50_000_000
"""Largest number of tets. A larger number is treated as a mistake in ``element_size``."""

REGULAR_STEP = 1.0 / math.sqrt(6.0)
"""Step length of the regular tet with edge 1: half its altitude."""

FLAT = 1e-9
"""Smallest ratio of the volume of a tet to (root of the sum of its squared face areas)^(3/2). A tet with a smaller
ratio of volume to areas counts as flat. Chosen value: the ratio is 0.15 for a regular tet, and 1e-16 for the round-off
of its nodes."""


@dataclass(frozen=True, eq=False)
class Origin:
    """File from which a mesh was read, and the numbers of its nodes there."""

    file: str
    """sha256 of the bytes of the file, and of the files that it includes."""
    nodes: Ids
    """(n,) number of each node in the file, unique in the file."""
    notes: tuple[str, ...] = ()
    """Contents of the file that are not in the mesh or are interpreted in an unexpected way; one text for each."""
    included: tuple[tuple[str, str], ...] = ()
    """Path and sha256 of each further file that was read for the mesh."""


@dataclass(frozen=True, eq=False)
class NodeSet:
    """A set of nodes, or a surface, that a mesh file defines."""

    names: tuple[str, ...]
    """Names of the set that a case may use. Lists of sets show the first name."""
    nodes: Ints
    """(k,) nodes of the mesh that belong to the set, ascending. A surface has the nodes of all its faces."""
    faces: Ints | None = None
    """(n, 3) faces of a surface that are outer faces of the mesh; None for a set of nodes."""
    inner: int = 0
    """Number of faces of the surface that are inside of the mesh. All nodes of an inner face of the surface are nodes
    of the mesh."""


@dataclass(frozen=True, eq=False)
class TetMesh:
    """A mesh: ``points`` (n, 3) float64, m; ``tets`` (m, 4) int32 node indices, positively oriented.

    Do not write into ``points`` and ``tets``. Raises MeshError if an array has a wrong shape.
    """

    points: Floats
    tets: Ints
    origin: Origin | None = None
    """File from which the mesh was read; None for a generated mesh."""
    sets: tuple[NodeSet, ...] = ()
    """Sets that the mesh file defines, including empty sets."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", np.ascontiguousarray(self.points, np.float64))
        object.__setattr__(self, "tets", np.ascontiguousarray(self.tets, np.int32))
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            raise MeshError(f"points have the shape {self.points.shape}; expected (n, 3)")
        if self.tets.ndim != 2 or self.tets.shape[1] != 4:
            raise MeshError(f"tets have the shape {self.tets.shape}; expected (m, 4)")

    def volumes(self) -> Floats:
        """Return (m,) signed volumes, m^3."""
        return volume_and_area(self.points, self.tets)[0]

    def step_lengths(self) -> Floats:
        """Return (m,) 1 / sqrt(sum |grad N|^2), m, with the sign of the volume.

        The stable time step is the returned step length divided by the speed of sound (lumped linear tets: omega_max^2
        <= 4 c^2 sum |grad N|^2).
        """
        return step_lengths(self.points, self.tets)


@dataclass(frozen=True)
class Names:
    """Numbers that the nodes (n,) and the tets (m,) have in the file of a mesh."""

    nodes: Ids
    tets: Ids
    lines: Ids | None = None
    """(m,) lines of the tets in the file; 0 if the format has no line numbers."""

    def tet(self, index: int) -> str:
        """Return the name of a tet for messages: ``tet 7 (line 12)``."""
        line = "" if self.lines is None or not self.lines[index] else f" (line {self.lines[index]})"
        return f"tet {self.tets[index]}{line}"


def step_lengths(points: Floats, tets: NDArray[np.integer]) -> Floats:
    """Return the step lengths, m, of the tets (..., 4); see ``TetMesh.step_lengths``."""
    volume, area = volume_and_area(points, tets)
    return np.divide(3 * volume, area, out=np.zeros_like(volume), where=area > 0)


def check(mesh: TetMesh, names: Names | None = None) -> TetMesh:
    """Return the mesh if a run can use it, else raise MeshError.

    Conditions: finite coordinates, at least one tet, every index in range, every node used, every volume positive.
    Messages use the ``names`` of nodes and tets if they are given, otherwise indices from 0.
    """
    points, tets = mesh.points, mesh.tets
    names = names or Names(np.arange(len(points)), np.arange(len(tets)))
    if len(tets) == 0:
        raise MeshError("the mesh has no tets")
    lost = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(lost):
        raise MeshError(
            f"node {names.nodes[lost[0]]} has a coordinate that is not finite ({_count(lost, points)} nodes)"
        )
    wild = np.flatnonzero(((tets < 0) | (tets >= len(points))).any(axis=1))
    if len(wild):
        raise MeshError(
            f"{names.tet(wild[0])} has the node indices {_list(tets[wild[0]])}; allowed: 0 to {len(points) - 1}"
        )
    unused = np.flatnonzero(np.bincount(tets.ravel(), minlength=len(points)) == 0)
    if len(unused):
        raise MeshError(f"node {names.nodes[unused[0]]} belongs to no tet ({_count(unused, points)} nodes)")
    _check_volumes(mesh, names)
    return mesh


def _check_volumes(mesh: TetMesh, names: Names) -> None:
    volumes, areas = volume_and_area(mesh.points, mesh.tets)
    nothing = FLAT * areas * np.sqrt(areas)
    bad = np.flatnonzero(volumes <= nothing)
    if len(bad):
        tet, inverted = bad[0], volumes[bad[0]] < -nothing[bad[0]]
        raise MeshError(
            f"{names.tet(tet)} is {'inverted' if inverted else 'flat'}: its nodes "
            f"{_list(names.nodes[mesh.tets[tet]])} span a volume of {volumes[tet]:.3g} m^3; it must be above "
            f"{nothing[tet]:.2g} ({_count(bad, volumes)} tets are inverted or flat)"
        )


def volume_and_area(points: Floats, tets: NDArray[np.integer]) -> tuple[Floats, Floats]:
    """Return the signed volume of each tet, m^3, and the root of the sum of its four squared face areas, m^2."""
    x, y, z = ([column[tets[..., i]] for i in range(4)] for column in points.T)
    e = [[x[i] - x[0], y[i] - y[0], z[i] - z[0]] for i in (1, 2, 3)]
    a, b, c = _cross(e[1], e[2]), _cross(e[2], e[0]), _cross(e[0], e[1])
    volume: Floats = (e[0][0] * a[0] + e[0][1] * a[1] + e[0][2] * a[2]) / 6
    squares = [p * p + q * q + r * r + (p + q + r) ** 2 for p, q, r in zip(a, b, c, strict=True)]
    area: Floats = 0.5 * np.sqrt(squares[0] + squares[1] + squares[2])
    return volume, area


def _cross(u: list[Floats], v: list[Floats]) -> list[Floats]:
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def _count(some: NDArray[np.intp], every: Floats) -> str:
    return f"{len(some):,} of {len(every):,}"


def _list(numbers: NDArray[np.integer]) -> str:
    return ", ".join(str(n) for n in numbers)
