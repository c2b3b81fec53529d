"""Interface of a strength law. The file of a law contains its constants, its state rows, its position in the time step,
and its kernel for a chunk.

The keys of the law in a case, its cost and its plausibility warnings are in the file of the same name in cases/laws.
The file models.py lists the laws; a law needs no other file.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..model.state import Floats

DENSITY, BULK, SHEAR, Q_LINEAR, Q_SHOCK, Q_QUADRATIC, ORDER, SPALL, DILATES, BREAKS = range(10)
"""Places in the constants of a block that every material has. ORDER: position of the law in the time step; SPALL: spall
strength, infinite if the material has none; DILATES: sine of the dilation angle, zero if plastic flow keeps the volume;
BREAKS: 1 if the part fractures."""
EQUATION, FIRST, SIZE = 10, 15, 42
"""First place of the constants of the equation of state, first place of the constants of the strength law, and number
of places in the constants of a block."""
FROM_SHAPE, BEFORE_PRESSURE, AFTER_PRESSURE = range(3)
"""Position of a law in the time step. FROM_SHAPE: the law computes the deviatoric stress from the undeformed shape.
BEFORE_PRESSURE: the law returns the trial stress to the yield surface before the equation of state. AFTER_PRESSURE: the
law returns the trial stress after the equation of state, because its strength depends on the new pressure."""


@dataclass(frozen=True)
class Law:
    """Strength law; its kernel(w, s, params, n, dt) computes the deviatoric stress of a chunk at step n+1."""

    model: str
    """Name of the law in a case; empty for the law of a material without a strength law."""
    order: int
    """Position in the time step: FROM_SHAPE, BEFORE_PRESSURE or AFTER_PRESSURE."""
    rows: Callable[[Any], int]
    """Function that returns the number of state rows of a tet (worker/model/rows.py). Its argument is the table of the
    law in the case."""
    constants: Callable[[Any], tuple[float, ...]]
    """Function that returns the constants of the law. Its argument is the table of the law in the case. The constants
    are stored from FIRST on."""
    begin: Callable[[Any, float], dict[int, float]]
    """Function that returns initial values of state rows. Its arguments are the table of the law in the case and the
    temperature, K. Rows whose initial value is zero are omitted."""
    kernel: Any
    equation: str = ""
    """Name of the equation of state that belongs to the law. If the name is empty, the material chooses its equation of
    state."""
    dilates: Callable[[Any], float] = lambda _: 0.0
    """Function that returns the sine of the dilation angle. Its argument is the table of the law in the case. If the
    sine is above zero, the law uses row DILATION."""


@dataclass(frozen=True)
class Equation:
    """Equation of state; its kernel(w, s, params, n) computes the pressure at step n+1, the work of the pressure, and
    MODULUS.
    """

    model: str
    """Name of the equation of state in a case; empty for the linear pressure."""
    rows: int
    """Number of state rows of a tet."""
    constants: Callable[[Any], tuple[float, ...]]
    """Function that returns the constants of the equation of state. Its argument is the table of the equation in the
    case. The constants are stored from EQUATION on."""
    kernel: Any
    volume: Any
    """Kernel(w, s, params, n) that sets VOLUME_SEEN at step n, m^3: the volume of solid and pores at the pressure of
    step n."""
    averaged: int = 0
    """Number of state rows in the averaged pressure forms, for an equation of state with an additional nodal mean
    (BULKING_STEP, HEAT)."""


def placed(params: Floats, begin: int, constants: tuple[float, ...], room: int) -> None:
    """Copies constants into ``params`` (SIZE,) from the place ``begin`` on. ``room``: largest number of constants."""
    assert len(constants) <= room
    params[begin : begin + len(constants)] = constants
