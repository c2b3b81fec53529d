"""The consistent unit systems of decks. The system is named by the user or by the deck, or found from the density of
steel.

A deck has numbers without units. The import writes a number with its unit into the case: the digits of the deck
stay, and ``cases.units`` converts them exactly.
"""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from conoid.cases.units import LARGEST, UNITS, parse_unit

from ..errors import UsageError

Dimension = tuple[int, int, int, int]
"""Exponents of length, mass, time and temperature in a unit."""

ONE: Dimension = (0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0)
TIME: Dimension = (0, 0, 1, 0)
TEMPERATURE: Dimension = (0, 0, 0, 1)
SPEED: Dimension = (1, 0, -1, 0)
RATE: Dimension = (0, 0, -1, 0)
ACCELERATION: Dimension = (1, 0, -2, 0)
STRESS: Dimension = (-1, 1, -2, 0)
DENSITY: Dimension = (-3, 1, 0, 0)
SPECIFIC_HEAT: Dimension = (2, 0, -2, -1)
MASS: Dimension = (0, 1, 0, 0)
INERTIA: Dimension = (2, 1, 0, 0)

_SLINCH = Fraction("0.45359237") * Fraction("9.80665") / Fraction("0.0254")
"""Mass of one slinch (lbf s^2 / in) in kg, exact by the agreement of 1959 and standard gravity."""
_ALIASES = {
    "ton": "t", "tonne": "t", "to": "t", "mg": "mg", "sec": "s", "msec": "ms", "usec": "us", "µs": "us", "mus": "us",
    "inch": "in", "kilogram": "kg", "gram": "g", "metre": "m", "meter": "m", "slinch": "lbf*s^2/in",
    "lbf-s^2/in": "lbf*s^2/in", "lbf*s2/in": "lbf*s^2/in", "lbfs^2/in": "lbf*s^2/in",
}  # fmt: skip
_NAMED = {
    STRESS: ("Pa", "kPa", "MPa", "GPa", "Mbar", "psi", "ksi"), SPECIFIC_HEAT: ("J/kg/K",),
    DENSITY: ("kg/m^3",), SPEED: ("m/s",), ACCELERATION: ("m/s^2",),
}  # fmt: skip
"""Common units. A quantity has a common unit in the case if this unit is exactly the unit of the system."""


@dataclass(frozen=True)
class System:
    """A consistent system of units, given by the symbols of length, mass and time."""

    length: str
    mass: str
    time: str

    def __str__(self) -> str:
        """Returns the symbols of the system, such as ``mm, t, s``."""
        return f"{self.length}, {self.mass}, {self.time}"

    def factor(self, dimension: Dimension) -> Fraction:
        """Returns the exact value, in SI, of one unit of a dimension in this system."""
        scales = (*(_scale(each) for each in (self.length, self.mass, self.time)), Fraction(1))
        result = Fraction(1)
        for scale, power in zip(scales, dimension, strict=True):
            result *= scale**power
        return result

    def si(self, value: float, dimension: Dimension) -> float:
        """Returns a number of the deck in SI units, rounded once."""
        return float(Fraction(repr(float(value))) * self.factor(dimension))

    def quantity(self, value: float, dimension: Dimension) -> str | float:
        """Returns a number of the deck with its unit, in the notation of a case. Raises ValueError if the number is
        outside the range of numbers in a case.
        """
        if not math.isfinite(value):
            raise ValueError(f"{value!r} is not finite")
        scaled = Fraction(repr(float(value))) * self.factor(dimension)
        if scaled and not 1 / LARGEST <= abs(scaled) <= LARGEST:
            raise ValueError(f"{value:g} converted to SI is not between {1.0 / LARGEST:g} and {LARGEST:g}")
        if dimension == ONE:
            return float(value)
        unit = self._unit(dimension)
        return f"{_digits(float(scaled))} {_si(dimension)}" if unit is None else f"{_digits(value)} {unit}"

    def _unit(self, dimension: Dimension) -> str | None:
        """Returns the text of a unit; None if cases do not have this unit."""
        if dimension == TEMPERATURE:
            return "K"
        factor = self.factor(dimension)
        for name in _NAMED.get(dimension, ()):
            if parse_unit(name)[0] == factor:
                return name
        if self.mass not in UNITS and dimension[1]:
            return None
        return _composed((self.length, self.mass, self.time, "K"), dimension)


def _digits(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


def _composed(symbols: tuple[str, str, str, str], dimension: Dimension) -> str:
    """Returns a unit composed of symbols, such as ``kg/mm/ms^2`` or ``1/ms``."""
    above = [s if p == 1 else f"{s}^{p}" for s, p in zip(symbols, dimension, strict=True) if p > 0]
    below = [s if p == -1 else f"{s}^{-p}" for s, p in zip(symbols, dimension, strict=True) if p < 0]
    return "/".join(["*".join(above) or "1", *below])


def _si(dimension: Dimension) -> str:
    return _NAMED[dimension][0] if dimension in _NAMED else _composed(("m", "kg", "s", "K"), dimension)


def _scale(symbol: str) -> Fraction:
    return _SLINCH if symbol == "lbf*s^2/in" else UNITS[symbol][0]


USUAL = (
    System("m", "kg", "s"), System("mm", "t", "s"), System("mm", "kg", "ms"), System("mm", "g", "ms"),
    System("mm", "kg", "s"), System("mm", "mg", "us"), System("mm", "g", "us"), System("cm", "g", "us"),
    System("cm", "g", "s"), System("in", "lbf*s^2/in", "s"),
)  # fmt: skip
"""Unit systems that are usual for decks."""


def named(text: str) -> System:
    """Returns the system for a text such as ``mm,ms,kg``: a length, a mass and a time in any order. Raises
    UsageError.
    """
    wanted: dict[Dimension, str] = {}
    for word in re.split(r"[,;\s]+", text.strip()):
        symbol = _ALIASES.get(word, _ALIASES.get(word.lower(), word))
        kind = MASS if symbol == "lbf*s^2/in" else UNITS[symbol][1] if symbol in UNITS else None
        if kind not in (LENGTH, MASS, TIME) or wanted.setdefault(kind, symbol) != symbol:
            raise UsageError(f"--units = {text[:60]!r}: {_WANTED}")
    if len(wanted) < 3:
        raise UsageError(f"--units = {text[:60]!r}: {_WANTED}")
    return System(wanted[LENGTH], wanted[MASS], wanted[TIME])


_WANTED = "expected a length, a mass and a time, such as 'mm,t,s', 'mm,kg,ms', 'm,kg,s', 'cm,g,us'"

# Found from steel --------------------------------------------------------------------------------------------------

_STEEL, _NEAR = 7850.0, 0.04
"""Density of steel, kg/m^3, and its tolerance. The range 7,536 to 8,164 contains no other common metal."""
_LEAST, _MOST = 1.7e11, 2.3e11
"""Limits of Young's modulus of steels, Pa: 190 to 215 GPa in handbooks, with some margin."""


@dataclass(frozen=True)
class Weighed:
    """Name, density and Young's modulus of a material of a deck; Young's modulus is None if the deck does not give
    it.
    """

    name: str
    density: float
    young: float | None


def system_of(materials: Iterable[Weighed]) -> tuple[System, str]:
    """Returns the only usual system in which a material is steel, with the reason. The test uses the density, and
    Young's modulus if the deck gives it. Raises UsageError if no system or several systems fit.
    """
    every = list(materials)
    found = [(system, one) for system in USUAL for one in every if _steel(system, one)]
    systems = list(dict.fromkeys(system for system, _ in found))
    if len(systems) == 1:
        system, one = found[0]
        modulus = "" if one.young is None else f" and Young's modulus {one.young:g} is {_giga(system, one):.3g} GPa"
        density = system.si(one.density, DENSITY)
        return system, f"{system} is the only usual system in which {one.name} is steel: the density {one.density:g} " \
            f"is {density:.4g} kg/m^3{modulus}"  # fmt: skip
    if systems:
        fits = " or in ".join(str(each) for each in systems)
        raise UsageError(f'--units is needed: {found[0][1].name} may be steel in {fits}; write --units "{systems[0]}"')
    densities = ", ".join(f"{one.name} {one.density:g}" for one in every[:5]) or "none"
    raise UsageError(
        f"--units is needed: no material has the density of steel in a usual system (densities: {densities}); "
        'write --units "mm,t,s", or the units of the deck'
    )


def _steel(system: System, one: Weighed) -> bool:
    if not math.isfinite(one.density) or abs(system.si(one.density, DENSITY) / _STEEL - 1.0) > _NEAR:
        return False
    return one.young is None or _LEAST <= system.si(one.young, STRESS) <= _MOST


def _giga(system: System, one: Weighed) -> float:
    return 1e-9 * system.si(one.young or 0.0, STRESS)
