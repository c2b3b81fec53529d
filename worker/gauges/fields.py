"""Fields of tets that probes and references measure."""

import numpy as np

from ..model import rows
from ..model.state import Block, Floats, Ints, Model, Tets
from ..output.frames import von_mises

_NORMAL = {"stress_xx": rows.S_XX, "stress_yy": rows.S_YY, "stress_zz": rows.S_ZZ}
_SHEAR = {"stress_yz": rows.S_YZ, "stress_zx": rows.S_ZX, "stress_xy": rows.S_XY}
_ROWS = {"plastic_strain": rows.PLASTIC_STRAIN, "damage": rows.DAMAGE, "temperature": rows.TEMPERATURE, **_SHEAR}
_VELOCITY = {"velocity_x": 0, "velocity_y": 1, "velocity_z": 2}


def tet_volumes(tets: Tets, x: Floats) -> Floats:
    """Return (n,) present volumes of tets (n, 4), m^3."""
    origin = x[tets[:, 0]]
    e1, e2, e3 = (x[tets[:, k]] - origin for k in (1, 2, 3))
    volumes: Floats = (e1 * np.cross(e2, e3)).sum(axis=1) / 6.0
    return volumes


def field(block: Block, name: str, model: Model, places: Ints) -> Floats:
    """Return (n,) the values of a field (``cases.schema.ProbeField``) for the tets at ``places`` (n,) of a block. The
    stress includes the viscous part.
    """

    def row(row: int) -> Floats:
        return block.at(row, places)

    if name in _NORMAL:
        return row(_NORMAL[name]) - row(rows.PRESSURE) - row(rows.VISCOUS)
    if name == "temperature" and not block.has(rows.TEMPERATURE):
        return np.full(len(places), block.temperature)
    if name in _ROWS:
        return row(_ROWS[name]) if block.has(_ROWS[name]) else np.zeros(len(places))
    if name in _VELOCITY:
        a, b, c, d = model.nodes.v[block.tets[places].T, _VELOCITY[name]]
        return np.asarray((a + b + c + d) / 4.0)
    if name == "pressure":
        return row(rows.PRESSURE) + row(rows.VISCOUS)
    if name == "mises":
        return von_mises(np.array([row(component) for component in range(rows.S_XX, rows.S_XY + 1)]))
    if name == "density":
        return row(rows.MASS) / tet_volumes(block.tets[places], model.nodes.x)
    return (row(rows.WORK) + row(rows.WORK_VISCOUS)) / row(rows.MASS)
