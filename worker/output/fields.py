"""Fields of frames that a case requests (``run.fields``): density, strain, strain rate, contact pressure.

Density, strain and strain rate are computed from positions and velocities. The contact pressure is computed from the
impulses of contact since the previous frame. Each value depends on its tet or node only, not on ranks or on the order
of tets.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..mesh.faces import boundary_faces, normals
from ..model.rows import MASS
from ..model.state import Block, Floats, Ints, Nodes

_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
"""Indices of the tensor components in the order that VTK uses."""


_FACING = 0.5
"""Smallest cosine of the angle between an impulse and the inward normal of a face on which it acts. The value is a
choice between two cases: on a flat face the cosine is larger up to a coefficient of friction of 1.7; on the sides of an
edge of 90 degrees the cosine is smaller up to a coefficient of 0.6."""


class Wanted(NamedTuple):
    """Fields that a case requests for a frame, and the data from which they are computed."""

    names: tuple[str, ...] = ()
    """Names of the fields (``cases.schema.FrameField``)."""
    impulses: Floats | None = None
    """(nodes, 3) impulses of contact and walls on each node since the previous frame, N s."""
    passed: float = 0.0
    """Simulated time since the previous frame, s; 0 for the first frame."""
    walls: Floats | None = None
    """(walls, 3) present position of ``point`` of each wall of the case, m; None if no wall moves."""
    sets: Mapping[str, int] = MappingProxyType({})
    """Dictionary from the name of the array of each set to the bit of the set in ``Nodes.marks``."""


def of_tets(names: tuple[str, ...], block: Block, nodes: Nodes) -> dict[str, Floats]:
    """Return the requested fields of the tets of a block."""
    found: dict[str, Floats] = {}
    edges = _edges(nodes.x, block)
    if "density" in names:
        mass = block.row(MASS) if block.has(MASS) else np.zeros(block.n)
        found["density"] = mass / (_determinant(edges) / 6.0)
    if "strain" in names:
        strain = logarithmic(_product(np.swapaxes(edges, 1, 2), _inverse_transposed(_edges(nodes.x0, block))))
        found["strain"] = np.stack([strain[:, i, j] for i, j in _ORDER], axis=1)
        found["effective_strain"] = effective(strain)
    if "strain_rate" in names:
        gradient = _product(np.swapaxes(_edges(nodes.v, block), 1, 2), _inverse_transposed(edges))
        found["strain_rate"] = effective(0.5 * (gradient + np.swapaxes(gradient, 1, 2)))
    return found


def logarithmic(F: Floats) -> Floats:
    """Return (n, 3, 3) the logarithmic strains ln V (Hencky) of deformation gradients F = V R (n, 3, 3). ln V is half
    the logarithm of the eigenvalues of F F^T, on its axes. An inverted tet has the strain of its mirror image.
    """
    squares, axes = np.linalg.eigh(_product(F, np.swapaxes(F, 1, 2)))
    logarithms = 0.5 * np.log(np.maximum(squares, np.finfo(float).tiny))
    return _product(axes * logarithms[:, None, :], np.swapaxes(axes, 1, 2))


def effective(strain: Floats) -> Floats:
    """Return (n,) sqrt(2/3 e' : e') of the deviators e' of strains or of strain rates (n, 3, 3)."""
    mean = (strain[:, 0, 0] + strain[:, 1, 1] + strain[:, 2, 2]) / 3.0
    deviator = strain - mean[:, None, None] * np.eye(3)
    return np.asarray(np.sqrt(2.0 / 3.0 * (deviator * deviator).sum(axis=(1, 2))))


def contact_pressure(x: Floats, tets: Ints, impulses: Floats, passed: float) -> Floats:
    """Return (nodes,) the mean contact pressure on the nodes of the surface, Pa; 0 for nodes inside of bodies and for
    nodes without a loaded face.

    The pressure is the component of the ``impulses`` (nodes, 3), N s, along the normal of the loaded area of a node,
    divided by this area and the time ``passed``, s. The loaded area is a third of each face whose inward normal is
    within 60 degrees of the impulse. The side faces of an edge are therefore omitted.
    """
    faces, share = boundary_faces(tets.astype(np.int32)), np.zeros((len(x), 3))
    outward = normals(x, faces) / 6.0
    size = np.sqrt((outward * outward).sum(axis=1))
    for corner in faces.T:
        push = impulses[corner]
        against = -(outward * push).sum(axis=1) > _FACING * size * np.sqrt((push * push).sum(axis=1))
        np.add.at(share, corner[against], outward[against])
    squared, push = (share * share).sum(axis=1), -(impulses * share).sum(axis=1)
    over = squared * passed
    return np.asarray(np.divide(push, over, out=np.zeros(len(x)), where=over > 0.0))


def _edges(values: Floats, block: Block) -> Floats:
    """Return (n, 3, 3) three vectors for each tet, as rows: the nodal values (nodes, 3) of its nodes 1, 2, 3, minus the
    value of its node 0.
    """
    corners = values[block.tets]
    return np.asarray(corners[:, 1:] - corners[:, :1])


def _determinant(rows: Floats) -> Floats:
    return np.asarray((rows[:, 0] * np.cross(rows[:, 1], rows[:, 2])).sum(axis=1))


def _inverse_transposed(rows: Floats) -> Floats:
    """Return (n, 3, 3) transposed inverses of matrices, computed by cofactors."""
    a, b, c = rows[:, 0], rows[:, 1], rows[:, 2]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    return np.asarray(cofactors / _determinant(rows)[:, None, None])


def _product(a: Floats, b: Floats) -> Floats:
    """Return (n, 3, 3) products of matrices. The order of the sums is fixed."""
    return a[:, :, 0, None] * b[:, None, 0] + a[:, :, 1, None] * b[:, None, 1] + a[:, :, 2, None] * b[:, None, 2]
