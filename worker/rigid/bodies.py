"""State of the rigid bodies of a case. All ranks have equal values."""

import math
from dataclasses import dataclass

import numpy as np

from conoid.cases.model.schema import Case, Part

from ..model.state import Flags, Floats, Indices, Ints, Nodes
from ..parallel.comm import Comm
from ..parallel.fixed_point import exact_sums
from . import rotation
from .motion import Held

STATE = ("centre", "q", "speed", "momentum")
"""Names of the quantities of bodies that change from step to step."""


@dataclass
class Bodies:
    """Rigid bodies of a case. The arrays have one row for each body."""

    part: Ints
    """(b,) number of the part of each body."""
    mass: Floats
    """(b,) mass of each body, kg."""
    origin: Floats
    """(b, 3) centre of mass at the start, m."""
    inertia: Floats
    """(b, 3, 3) inertia about the centre of mass, along the axes of the case, at the start, kg m^2."""
    reach: Floats
    """(b,) reach of each body: a power of two that is larger than the greatest distance of a node from the centre, m.
    The quantum of moments is the quantum of impulses multiplied by the reach."""
    held: list[Held]

    def __post_init__(self) -> None:
        """Sets all bodies to rest in their initial position."""
        n = len(self.part)
        self.centre, self.speed, self.momentum = self.origin.copy(), np.zeros((n, 3)), np.zeros((n, 3))
        """Three values of each body: centre of mass, m; velocity of the centre at mid-step, m/s; and angular momentum
        about the centre at mid-step, kg m^2/s."""
        self.q = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        """(b, 4) unit quaternion of the rotation from the start, scalar first."""
        self.inverse = np.array([inverse(tensor) for tensor in self.inertia]).reshape(n, 3, 3)
        self.rotation, self.compliance = np.empty((n, 3, 3)), np.empty((n, 3, 3))
        """(b, 3, 3) present rotation; and inverse of the inertia along the axes of space. If a body can turn about one
        axis only, it is the inverse of the inertia about this axis."""
        self.free = np.array([each.free for each in self.held]).reshape(n, 3)
        self.turns = np.array([each.turns for each in self.held]).reshape(n, 3)
        """(b, 3) 1 for an axis along which impulses may move the body, else 0. The second array (b, 3) is 1 for an axis
        about which impulses may rotate the body, else 0."""
        self.loose = np.flatnonzero(self.turns.all(axis=1))
        """Indices of the bodies that can turn about all axes."""
        self.lightness = self.free / self.mass[:, None]
        self.pose()

    @property
    def n(self) -> int:
        """Number of bodies."""
        return len(self.part)

    def pose(self) -> None:
        """Updates the values that depend on the orientation of the bodies."""
        rotation.turns_of(self.rotation, self.q)
        rotation.spatial(self.compliance, self.rotation, self.inverse)
        for b in range(self.n):
            if self.turns[b].any() and not self.turns[b].all():
                axis = int(np.argmax(self.turns[b]))
                self.compliance[b] = 0.0
                self.compliance[b, axis, axis] = 1.0 / self.about(b)[axis, axis]
        self.yielding = self.compliance * self.turns[:, :, None]
        """(b, 3, 3) inverse of the inertia along the axes of space; 0 for a body whose rotation is held."""

    def about(self, b: int) -> Floats:
        """Returns the inertia of a body along the axes of space, (3, 3), kg m^2."""
        found = np.empty((1, 3, 3))
        rotation.spatial(found, self.rotation[b : b + 1], self.inertia[b : b + 1])
        return np.asarray(found[0])

    def rates(self, momentum: Floats) -> Floats:
        """Returns the rotation vectors (b, 3), rad/s, of bodies with the given angular momenta."""
        return times(self.compliance, momentum)


def times(tensors: Floats, vectors: Floats) -> Floats:
    """(b, 3) products of tensors (b, 3, 3) and vectors (b, 3). The order of the sums is fixed."""
    parts = tensors * vectors[:, None, :]
    return np.asarray((parts[..., 0] + parts[..., 1]) + parts[..., 2])


def dot(a: Floats, b: Floats) -> Floats:
    """(b,) scalar products of vectors (b, 3). The order of the sums is fixed."""
    parts = a * b
    return np.asarray((parts[:, 0] + parts[:, 1]) + parts[:, 2])


def cross(a: Floats, b: Floats) -> Floats:
    """(3,) vector product."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def inverse(tensor: Floats) -> Floats:
    """(3, 3) inverse of a symmetric tensor, computed by cofactors."""
    xx, yy, zz, yz, zx, xy = (float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)))
    a, b, c = yy * zz - yz * yz, zx * yz - xy * zz, xy * yz - yy * zx
    whole = xx * a + xy * b + zx * c
    d, e, f = zz * xx - zx * zx, xy * zx - xx * yz, xx * yy - xy * xy
    return np.asarray(np.array([[a, b, c], [b, d, e], [c, e, f]]) / whole)


def of_nodes(case: Case, nodes: Nodes) -> Indices:
    """(nodes,) number of the rigid body to which each node belongs; -1 if it belongs to none."""
    number = np.full(len(case.parts), -1, np.int32)
    number[case.rigid] = np.arange(len(case.rigid), dtype=np.int32)
    return np.asarray(number[nodes.part])


def measured(case: Case, nodes: Nodes, held: list[Held], comm: Comm) -> Bodies:
    """Returns the bodies of a case at the start. The bodies are computed from their ``nodes`` on all ranks. ``held``:
    constraints and loads of each body. Collective.
    """
    of = of_nodes(case, nodes)
    found = [_measured(case.parts[i], nodes, of == b, comm) for b, i in enumerate(case.rigid)]
    masses, centres, tensors, reach = (list(column) for column in zip(*found, strict=True))
    bodies = Bodies(
        np.array(case.rigid), np.array(masses), np.array(centres), np.array(tensors), np.array(reach), held
    )  # fmt: skip
    for b, index in enumerate(case.rigid):
        _start(bodies, b, case.parts[index])
    return bodies


def _measured(part: Part, nodes: Nodes, chosen: Flags, comm: Comm) -> tuple[float, Floats, Floats, float]:
    """Returns four properties of a body that consists of the nodes ``chosen``: mass, kg, centre of mass, m, inertia
    about this centre, kg m^2, and reach, m. Collective.
    """
    spec, some = part.rigid, chosen & nodes.owned
    assert spec is not None
    m, x = nodes.mass[some], nodes.x[some]
    total, *first = exact_sums(comm, np.column_stack([m, m[:, None] * x])).tolist()
    centre = np.array(first) / total if spec.centre is None else np.array(spec.centre)
    r = x - centre
    products = [m * r[:, i] * r[:, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))]
    xx, yy, zz, yz, zx, xy = exact_sums(comm, np.column_stack(products)).tolist()
    six = (yy + zz, zz + xx, xx + yy, -yz, -zx, -xy) if spec.inertia is None else spec.inertia
    squares = r * r
    far = float(comm.maximum(np.array([((squares[:, 0] + squares[:, 1]) + squares[:, 2]).max(initial=0.0)]))[0])
    return spec.mass or total, centre, tensor_of(six), math.ldexp(1.0, math.frexp(math.sqrt(far))[1])


def tensor_of(six: tuple[float, ...]) -> Floats:
    """(3, 3) symmetric tensor with the components xx, yy, zz, yz, zx, xy."""
    xx, yy, zz, yz, zx, xy = six
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def _start(bodies: Bodies, b: int, part: Part) -> None:
    """Sets the initial motion of a body, within its constraints."""
    held, rate, speed = bodies.held[b], np.zeros(3), np.array(part.velocity)
    if part.spin is not None:
        rate = np.array(part.spin.rate)
        speed = speed + cross(rate, bodies.centre[b] - np.array(part.spin.centre))
    speed, rate = held.begin(speed, rate, bodies.centre[b])
    bodies.speed[b] = speed
    bodies.momentum[b] = held.kept(times(bodies.inertia[b : b + 1], rate[None])[0])
