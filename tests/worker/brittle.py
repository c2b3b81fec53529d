"""Glass with the Mohr-Coulomb law for the tests, random stresses, and time steps centred on the initial mesh."""

import math
from typing import Any

import numpy as np

from conoid.cases.model import materials
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import PRESSURE

from . import formulas
from .kernels import GLASS, Patch
from .meshes import REGULAR, Floats

SHEAR, BULK = 72e9 / 2.44, 72e9 / 1.68
DT = 1e-7
C, PHI = 0.158e9, math.radians(54.9)


def brittle(cohesion: float = C, angle: float = PHI, **keys: Any) -> materials.Material:
    """Returns glass with the given strength."""
    law = materials.MohrCoulomb(model="mohr_coulomb", cohesion=cohesion, friction_angle=angle, **keys)
    return materials.Material(density=2500.0, elastic=GLASS.elastic, strength=law)


def free(n: int, material: materials.Material, s: Floats, pressure: Floats | float) -> Patch:
    """Returns ``n`` regular tets at rest with deviators (n, 3, 3) and pressures, Pa."""
    points = np.tile(REGULAR, (n, 1))
    patch = Patch(TetMesh(points, np.arange(4 * n, dtype=np.int32).reshape(n, 4)), material)
    patch.deviator = s
    patch.put(PRESSURE, pressure)
    return patch


def rotations(n: int, random: np.random.Generator) -> Floats:
    return np.asarray(np.linalg.qr(random.normal(size=(n, 3, 3)))[0])


def random_deviators(n: int, random: np.random.Generator) -> Floats:
    """Returns deviators in random directions with von Mises stresses from 10 MPa to 100 GPa. Every third deviator
    has two equal principal values, every fifth has two nearly equal principal values, and every seventh has the axes
    as principal directions.
    """
    values = random.normal(size=(n, 3))
    third, fifth = np.arange(n) % 3 == 0, np.arange(n) % 5 == 0
    values[third, 1] = values[third, 0]
    values[fifth, 1] = values[fifth, 0] * (1.0 + 10.0 ** random.uniform(-16.0, -6.0, fifth.sum()))
    q = rotations(n, random)
    q[np.arange(n) % 7 == 0] = np.eye(3)
    s = formulas.deviator(np.einsum("nij,nj,nkj->nik", q, values, q))
    return s * (10.0 ** random.uniform(7.0, 11.0, n) / formulas.mises(s))[:, None, None]


def stretched(patch: Patch, L: Floats, dt: float = DT) -> None:
    """Makes a step with the velocity gradient L (3, 3), 1/s; in the middle of the step the mesh has its initial
    positions.
    """
    patch.nodes.x[:] = patch.sim.model.nodes.x0
    patch.strain(L, dt)
    patch.advance(dt)
