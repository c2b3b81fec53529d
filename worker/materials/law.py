"""Interface of a strength law: one file has its constants, its state rows, its place in the step, and its kernel for a
chunk.

Its keys in a case, its cost and its plausibility warnings are in the file of the same name in cases/laws. models.py
lists the laws; a law needs no other file.
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
"""First places of the constants of the equation of state and of the law, and the number of places."""
FROM_SHAPE, BEFORE_PRESSURE, AFTER_PRESSURE = range(3)
"""Place of a law in the step: computes the deviatoric stress from the undeformed shape; returns the trial stress
before the equation of state; returns it after that, since its strength depends on the new pressure."""


@dataclass(frozen=True)
class Law:
    """Strength law: its kernel(w, s, params, n, dt) computes the deviatoric stress of a chunk at n+1."""

    model: str
    """Name in a case; empty for the law of a material without a strength."""
    order: int
    """FROM_SHAPE, BEFORE_PRESSURE or AFTER_PRESSURE."""
    rows: Callable[[Any], int]
    """Function of its table in the case: number of state rows of a tet (worker/model/rows.py)."""
    constants: Callable[[Any], tuple[float, ...]]
    """Function of its table: its constants, stored from FIRST on."""
    begin: Callable[[Any, float], dict[int, float]]
    """Function of its table and the temperature, K: initial values of the rows that do not start at zero."""
    kernel: Any
    equation: str = ""
    """Name of the equation of state that belongs to the law; empty: that of the material."""
    dilates: Callable[[Any], float] = lambda _: 0.0
    """Function of its table: sine of the dilation angle; above zero the law uses row DILATION."""


@dataclass(frozen=True)
class Equation:
    """Equation of state: its kernel(w, s, params, n) computes the pressure of n+1, its work and MODULUS."""

    model: str
    """Name in a case; empty for the linear pressure."""
    rows: int
    """Number of state rows of a tet."""
    constants: Callable[[Any], tuple[float, ...]]
    """Function of its table in the case: its constants, stored from EQUATION on."""
    kernel: Any
    volume: Any
    """Kernel(w, s, params, n) that sets VOLUME_SEEN of n, m^3: volume of solid and pores at the pressure of n."""
    averaged: int = 0
    """Rows in the averaged pressure forms if the equation has a nodal mean of its own (BULKING_STEP, HEAT)."""


def placed(params: Floats, begin: int, constants: tuple[float, ...], room: int) -> None:
    """Copies constants into ``params`` (SIZE,) from ``begin`` on; there must be ``room`` for them."""
    assert len(constants) <= room
    params[begin : begin + len(constants)] = constants
