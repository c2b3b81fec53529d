"""Interface of a strength law. Each law has one file with its constants, its state rows, its place in the step, and its
kernel for a chunk.

The keys of the law in a case, its cost and its plausibility warnings are in the file of the same name in cases/laws.
The file models.py lists the laws; a law needs no other file.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..model.state import Floats

DENSITY, BULK, SHEAR, Q_LINEAR, Q_SHOCK, Q_QUADRATIC, ORDER, SPALL, DILATES, BREAKS = range(10)
"""Places in a block's constants that every material has. ORDER: place of the law in the step; SPALL: infinite if the
material has none; DILATES: sine of the dilation angle, zero if plastic flow keeps the volume; BREAKS: 1 if the part
fractures."""
EQUATION, FIRST, SIZE = 10, 15, 42
"""First place of the constants of the equation of state, first place of the constants of the law, and number of
places in the constants of a block."""
FROM_SHAPE, BEFORE_PRESSURE, AFTER_PRESSURE = range(3)
"""Place of a law in the step. FROM_SHAPE: the law computes the deviatoric stress from the undeformed shape.
BEFORE_PRESSURE: the law returns the trial stress to the yield surface before the equation of state. AFTER_PRESSURE:
the law does so after the equation of state, because its strength depends on the new pressure."""


@dataclass(frozen=True)
class Law:
    """Strength law: its kernel(w, s, params, n, dt) computes the deviatoric stress of a chunk at n+1."""

    model: str
    """Name in a case; empty for the law of a material without a strength."""
    order: int
    """FROM_SHAPE, BEFORE_PRESSURE or AFTER_PRESSURE."""
    rows: Callable[[Any], int]
    """Function of the law's table in the case: number of state rows of a tet (worker/model/rows.py)."""
    constants: Callable[[Any], tuple[float, ...]]
    """Function of the law's table in the case: constants of the law, stored from FIRST on."""
    begin: Callable[[Any, float], dict[int, float]]
    """Function of the law's table and the temperature, K: initial values of the state rows whose initial value is
    not zero."""
    kernel: Any
    equation: str = ""
    """Name of the equation of state that belongs to the law; empty: the equation of state of the material is used."""
    dilates: Callable[[Any], float] = lambda _: 0.0
    """Function of the law's table: sine of the dilation angle. If the sine is above zero, the law uses row DILATION."""


@dataclass(frozen=True)
class Equation:
    """Equation of state: its kernel(w, s, params, n) computes the pressure of n+1, its work and MODULUS."""

    model: str
    """Name in a case; empty for the linear pressure."""
    rows: int
    """Number of state rows of a tet."""
    constants: Callable[[Any], tuple[float, ...]]
    """Function of the table of the equation of state in the case: constants of the equation, stored from EQUATION
    on."""
    kernel: Any
    volume: Any
    """Kernel(w, s, params, n) that sets VOLUME_SEEN of n, m^3: volume of solid and pores at the pressure of n."""
    averaged: int = 0
    """Number of state rows in the averaged pressure forms if the equation has an additional nodal mean
    (BULKING_STEP, HEAT)."""


def placed(params: Floats, begin: int, constants: tuple[float, ...], room: int) -> None:
    """Copies constants into ``params`` (SIZE,) from ``begin`` on; ``room``: largest number of constants."""
    assert len(constants) <= room
    params[begin : begin + len(constants)] = constants
