"""Orders of magnitude of a model, from which the quanta of integer sums are computed."""

import math

import numpy as np

from .gauges.fields import tet_volumes
from .materials.elementary import power
from .materials.law import BULK, DENSITY, SHEAR
from .model.rows import MASS
from .model.state import Model
from .parallel.comm import Comm

_SMALLEST_STRAIN = 1e-12
"""Smallest strain whose nodal forces the force quantum must resolve. Chosen value: in steel, the stress at the smallest
strain is 0.2 Pa."""


def extremes(model: Model, comm: Comm) -> tuple[float, float, float]:
    """Returns three maxima over all ranks: nodal mass, kg; speed (wave speed or velocity), m/s; and distance from the
    origin, m.
    """
    speeds = [float(np.linalg.norm(model.nodes.v, axis=1).max(initial=0.0))]
    for block in model.blocks:
        p = block.params
        speeds.append(math.sqrt((p[BULK] + 4.0 / 3.0 * p[SHEAR]) / p[DENSITY]))
    mass, arm = model.nodes.mass.max(initial=0.0), np.linalg.norm(model.nodes.x, axis=1).max(initial=0.0)
    largest, fastest, farthest = comm.maximum(np.array([mass, max(speeds), arm])).tolist()
    return largest, fastest, farthest


def force_floor(model: Model, comm: Comm) -> float:
    """Returns the nodal force of the largest tet at the strain _SMALLEST_STRAIN, N. The force quantum is never made
    smaller than the nodal force of the largest tet requires.

    Collective.
    """
    largest = 0.0
    for block in model.blocks:
        volume = float(block.row(MASS).max()) / float(block.params[0])
        if block.rigid:  # the case may give the mass of a rigid part
            volume = float(tet_volumes(block.tets, model.nodes.x0).max())
        largest = max(largest, float(block.params[BULK]) * power(volume, 2.0 / 3.0))
    return _SMALLEST_STRAIN * float(comm.maximum(np.array([largest]))[0])
