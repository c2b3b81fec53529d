"""What a law states: a file of its own has its constants, its rows of state, when it acts, and its kernel over a chunk.

Its keys in a case, its cost and what is odd about it stand in the file of the same name in cases/laws. models.py lists
the laws; a law needs no other file.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..model.state import Floats

DENSITY, BULK, SHEAR, Q_LINEAR, Q_SHOCK, Q_QUADRATIC, ORDER, SPALL, DILATES, BREAKS = range(10)
"""Places in a block's constants: what every material has. ORDER says when its law acts; SPALL is infinite where the
material names none; DILATES is the sine of the dilation angle, zero where flow keeps the volume; BREAKS is 1
where the part fractures."""
EQUATION, FIRST, SIZE = 10, 15, 42
"""Where the constants of the equation of state and of the law begin, and how many there is room for."""
FROM_SHAPE, BEFORE_PRESSURE, AFTER_PRESSURE = range(3)
"""When a law acts: it makes the deviatoric stress from the undeformed shape; it returns the trial stress, before the
equation of state; it does that after it, since its strength depends on the new pressure."""


@dataclass(frozen=True)
class Law:
    """A law of strength: its kernel(w, s, params, n, dt) brings the deviatoric stress of a chunk to that of n+1."""

    model: str
    """Its name in a case; empty for the law of a material without a strength."""
    order: int
    """FROM_SHAPE, BEFORE_PRESSURE or AFTER_PRESSURE."""
    rows: Callable[[Any], int]
    """How many rows of state a tet needs (worker/model/rows.py), from its table in the case."""
    constants: Callable[[Any], tuple[float, ...]]
    """Its constants from its table; they stand from FIRST on."""
    begin: Callable[[Any, float], dict[int, float]]
    """Rows that do not begin with zero, from its table and the temperature, K."""
    kernel: Any
    equation: str = ""
    """Name of the equation of state that the law brings; else that of the material holds."""
    dilates: Callable[[Any], float] = lambda _: 0.0
    """Sine of the dilation angle, from its table; above zero the law keeps row DILATION."""


@dataclass(frozen=True)
class Equation:
    """An equation of state: its kernel(w, s, params, n) makes the pressure of n+1, its work and the MODULUS."""

    model: str
    """Its name in a case; empty for the pressure of the elasticity."""
    rows: int
    """How many rows of state a tet needs."""
    constants: Callable[[Any], tuple[float, ...]]
    """Its constants from its table in the case; they stand from EQUATION on."""
    kernel: Any
    volume: Any
    """Its kernel(w, s, params, n) makes VOLUME_SEEN of n, m^3: of the matter and pores that have the pressure of n."""
    averaged: int = 0
    """Rows in the averaged pressure forms if the equation has a nodal mean of its own (BULKING_STEP, HEAT)."""


def placed(params: Floats, begin: int, constants: tuple[float, ...], room: int) -> None:
    """Puts constants into ``params`` (SIZE,) from ``begin`` on; there must be ``room`` for them."""
    assert len(constants) <= room
    params[begin : begin + len(constants)] = constants
