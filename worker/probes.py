"""Probes: mass-weighted means of a field over chosen tets, as columns of history.csv."""

import numpy as np

from conoid.cases.schema import Case, Probe

from .errors import InputError
from .output.frames import von_mises
from .parallel.comm import Comm
from .parallel.fixed_point import exact_sums
from .state import (
    MASS,
    PLASTIC_STRAIN,
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    TEMPERATURE,
    VISCOUS,
    WORK,
    WORK_VISCOUS,
    Block,
    Floats,
    Model,
)

_NORMAL = {"stress_xx": S_XX, "stress_yy": S_YY, "stress_zz": S_ZZ}
_SHEAR = {"stress_yz": S_YZ, "stress_zx": S_ZX, "stress_xy": S_XY}
_ROWS = {"plastic_strain": PLASTIC_STRAIN, "temperature": TEMPERATURE, **_SHEAR}
_VELOCITY = {"velocity_x": 0, "velocity_y": 1, "velocity_z": 2}


def tet_volumes(block: Block, x: Floats) -> Floats:
    """(n,) present volumes of the tets of a block, m^3."""
    origin = x[block.tets[:, 0]]
    e1, e2, e3 = (x[block.tets[:, k]] - origin for k in (1, 2, 3))
    volumes: Floats = np.einsum("ij,ij->i", e1, np.cross(e2, e3)) / 6.0
    return volumes


def field(block: Block, name: str, model: Model) -> Floats:
    """(n,) a field of ``cases.schema.ProbeField`` over the tets of a block; stress includes the viscous part."""
    if name in _NORMAL:
        return block.row(_NORMAL[name]) - block.row(PRESSURE) - block.row(VISCOUS)
    if name == "temperature" and not block.has(TEMPERATURE):
        return np.full(block.n, block.temperature)
    if name in _ROWS:
        return block.row(_ROWS[name]) if block.has(_ROWS[name]) else np.zeros(block.n)
    if name in _VELOCITY:
        return np.asarray(model.nodes.v[block.tets, _VELOCITY[name]].mean(axis=1))
    if name == "pressure":
        return block.row(PRESSURE) + block.row(VISCOUS)
    if name == "mises":
        return von_mises(np.array([block.row(row) for row in range(S_XX, S_XY + 1)]))
    if name == "density":
        return block.row(MASS) / tet_volumes(block, model.nodes.x)
    return (block.row(WORK) + block.row(WORK_VISCOUS)) / block.row(MASS)


class Probes:
    """The probes of a case on this rank. Raises InputError, on every rank alike, when one holds no tet."""

    def __init__(self, case: Case, model: Model, comm: Comm) -> None:
        self.names = [probe.name for probe in case.probes]
        self._fields = [probe.field for probe in case.probes]
        self._model = model
        self._comm = comm
        self._chosen = [[_inside(probe, block, model) for block in model.blocks] for probe in case.probes]
        counts = comm.sum(np.array([sum(len(c) for c in chosen) for chosen in self._chosen], np.int64))
        for index in np.flatnonzero(counts == 0):
            raise InputError(
                f"probes[{index}]: no tet of part {case.probes[index].part!r} has its centre between low and high"
            )

    def measure(self) -> Floats:
        """(probes,) the present values, equal on any number of ranks."""
        if not self.names:
            return np.zeros(0)
        sums = [self._sums(name, chosen) for name, chosen in zip(self._fields, self._chosen, strict=True)]
        totals = [exact_sums(self._comm, s) for s in sums]
        return np.array([total / mass for total, mass in totals])

    def _sums(self, name: str, chosen: list["np.ndarray"]) -> Floats:
        columns = [np.zeros((0, 2))]
        for block, inside in zip(self._model.blocks, chosen, strict=True):
            if len(inside):
                mass = block.row(MASS)[inside]
                columns.append(np.column_stack([field(block, name, self._model)[inside] * mass, mass]))
        return np.concatenate(columns)


def _inside(probe: Probe, block: Block, model: Model) -> "np.ndarray":
    if model.parts[block.part] != probe.part:
        return np.zeros(0, np.int64)
    centres = model.nodes.x0[block.tets].mean(axis=1)
    return np.flatnonzero(((centres >= np.array(probe.low)) & (centres <= np.array(probe.high))).all(axis=1))
