"""The formulas of the kernels in plain numpy, as a reference for the tests. Tensors have the shape (n, 3, 3), and the
pressure is minus the mean stress."""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
IDENTITY = np.eye(3)


def volumes(corners: Floats) -> Floats:
    """Returns the volumes (n,) of tets with the nodes ``corners`` (n, 4, 3); the volumes are equal to those of the
    kernels to the bit."""
    e1, e2, e3 = ((corners[:, k] - corners[:, 0]).T for k in (1, 2, 3))
    sixth = 1.0 / 6.0
    bx, by = (e2[1] * e3[2] - e2[2] * e3[1]) * sixth, (e2[2] * e3[0] - e2[0] * e3[2]) * sixth
    return np.asarray(e1[0] * bx + e1[1] * by + e1[2] * ((e2[0] * e3[1] - e2[1] * e3[0]) * sixth))


def gradients(corners: Floats) -> tuple[Floats, Floats]:
    """Returns volumes (n,) and shape-function gradients (n, 4, 3) of tets with the nodes ``corners`` (n, 4, 3)."""
    jacobian = corners[:, 1:] - corners[:, :1]
    inner = np.linalg.inv(jacobian).transpose(0, 2, 1)
    return np.asarray(np.linalg.det(jacobian) / 6.0), np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def velocity_gradient(velocities: Floats, grad: Floats) -> Floats:
    """Returns L_ij = sum_a v_ai dN_a/dx_j from nodal velocities (n, 4, 3)."""
    return np.asarray(np.einsum("nai,naj->nij", velocities, grad))


def deviator(a: Floats) -> Floats:
    """Returns the deviator of the symmetric part of a, a - tr(a) / 3 I."""
    symmetric = 0.5 * (a + a.transpose(0, 2, 1))
    return np.asarray(symmetric - np.trace(symmetric, axis1=1, axis2=2)[:, None, None] / 3.0 * IDENTITY)


def cayley(spin: Floats, dt: float) -> Floats:
    """Returns (I - W dt/2)^-1 (I + W dt/2)."""
    return np.asarray(np.linalg.solve(IDENTITY - 0.5 * dt * spin, IDENTITY + 0.5 * dt * spin), np.float64)


def rotated(s: Floats, L: Floats, dt: float) -> Floats:
    """Returns Q s Q^T with the rotation Q of the step."""
    q = cayley(0.5 * (L - L.transpose(0, 2, 1)), dt)
    return q @ s @ q.transpose(0, 2, 1)


def stretching(L: Floats, dt: float) -> Floats:
    """Returns the deviator of D, rotated from the middle of the step to the end of the step by the square root R of Q.
    I + Q is R times a symmetric positive matrix, so R is the polar rotation of I + Q.
    """
    u, _, v = np.linalg.svd(IDENTITY + cayley(0.5 * (L - L.transpose(0, 2, 1)), dt))
    return np.asarray((u @ v) @ deviator(L) @ (u @ v).transpose(0, 2, 1))


def hyperelastic(F: Floats, shear: float) -> tuple[Floats, Floats]:
    """Returns the deviatoric Cauchy stress G / 2J dev(b - b^-1), Pa, and its energy per volume, G/4 (tr b + tr b^-1
    - 6), J/m^3."""
    J = np.linalg.det(F)
    b = J[:, None, None] ** (-2.0 / 3.0) * F @ F.transpose(0, 2, 1)
    inverse = np.linalg.inv(b)
    stress = 0.5 * shear / J[:, None, None] * deviator(b - inverse)
    return stress, np.asarray(0.25 * shear * (np.trace(b + inverse, axis1=1, axis2=2) - 6.0))


def mises(s: Floats) -> Floats:
    """Returns sqrt(3/2 s : s)."""
    return np.asarray(np.sqrt(1.5 * (s * s).sum(axis=(1, 2))))


def power(s: Floats, L: Floats, dt: float) -> Floats:
    """Returns s : D with D rotated to the end of the step."""
    return np.asarray((s * stretching(L, dt)).sum(axis=(1, 2)))


def forces(volume: Floats, stress: Floats, grad: Floats) -> Floats:
    """Returns the forces on the four nodes, -V stress . grad N_a, (n, 4, 3)."""
    return np.asarray(-volume[:, None, None] * np.einsum("nij,naj->nai", stress, grad))


def at_nodes(tets: npt.NDArray[np.integer], values: Floats, nodes: int) -> Floats:
    """Returns the nodal sums of values (n, 4, ...) that are given for the four nodes of each tet."""
    total = np.zeros((nodes, *values.shape[2:]))
    np.add.at(total, tets, values)
    return total


def inverse_length(grad: Floats) -> Floats:
    """Returns sqrt(sum_a |grad N_a|^2), 1/m."""
    return np.asarray(np.sqrt((grad * grad).sum(axis=(1, 2))))


def stiffness(volume: float, grad: Floats, bulk: float, shear: float) -> Floats:
    """Returns the (12, 12) stiffness matrix of one tet, V B^T D B, with isotropic elasticity."""
    strains = np.zeros((12, 3, 3))
    for a in range(4):
        for i in range(3):
            strains[3 * a + i, i] += grad[a]
    strains = 0.5 * (strains + strains.transpose(0, 2, 1))
    trace = np.trace(strains, axis1=1, axis2=2)
    parts = strains - trace[:, None, None] / 3.0 * IDENTITY
    return np.asarray(volume * (bulk * np.outer(trace, trace) + 2.0 * shear * np.einsum("aij,bij->ab", parts, parts)))
