"""Physical quantities as text: ``"210 m/s"`` becomes 210.0 in SI units.

The grammar (no part of the text is executed)::

    quantity = number [ unit { ("*" | "/" | " ") unit } ]
    unit     = symbol [ "^" integer ]

A number without a unit is taken as a value in SI. Factors of units are exact and a quantity is rounded only once: ``0.4
mm`` and ``400 um`` are the same number, and give the same run. The text of an error has the quantity, what is wrong
with it, and what is allowed.
"""

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any

from pydantic import BeforeValidator, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from .reading.similar import meant

Dimension = tuple[int, int, int, int]
"""Exponents of metre, kilogram, second and kelvin."""

_LENGTH, _MASS, _TIME, _TEMPERATURE = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)
_FORCE, _STRESS, _ENERGY, _POWER = (1, 1, -2, 0), (-1, 1, -2, 0), (2, 1, -2, 0), (2, 1, -3, 0)
_NONE, _FREQUENCY = (0, 0, 0, 0), (0, 0, -1, 0)
"""Dimensions of plain numbers and of frequencies: exponents of metre, kilogram, second and kelvin."""

_ONE, _KILO, _MEGA, _GIGA = Fraction(1), Fraction(1000), Fraction(10**6), Fraction(10**9)
_CENTI, _MILLI, _MICRO = Fraction(1, 100), Fraction(1, 1000), Fraction(1, 10**6)
_NANO, _PICO = Fraction(1, 10**9), Fraction(1, 10**12)
"""SI prefixes as exact factors."""
_INCH, _POUND = Fraction("0.0254"), Fraction("0.45359237")
"""Inch in m and pound in kg; exact by the international agreement of 1959."""
_PSI = _POUND * Fraction("9.80665") / _INCH**2
"""Pound-force per square inch, Pa; exact, with standard gravity."""
UNITS: dict[str, tuple[Fraction, Dimension]] = {
    "1": (_ONE, _NONE),
    "m": (_ONE, _LENGTH), "km": (_KILO, _LENGTH), "cm": (_CENTI, _LENGTH), "mm": (_MILLI, _LENGTH),
    "um": (_MICRO, _LENGTH), "µm": (_MICRO, _LENGTH), "nm": (_NANO, _LENGTH), "in": (_INCH, _LENGTH),
    "ft": (12 * _INCH, _LENGTH),
    "kg": (_ONE, _MASS), "g": (_MILLI, _MASS), "mg": (_MICRO, _MASS), "t": (_KILO, _MASS),
    "lb": (_POUND, _MASS),
    "s": (_ONE, _TIME), "ms": (_MILLI, _TIME), "us": (_MICRO, _TIME), "µs": (_MICRO, _TIME), "ns": (_NANO, _TIME),
    "ps": (_PICO, _TIME), "min": (Fraction(60), _TIME), "h": (Fraction(3600), _TIME),
    "K": (_ONE, _TEMPERATURE),
    "Hz": (_ONE, _FREQUENCY), "kHz": (_KILO, _FREQUENCY), "rad": (_ONE, _NONE),
    "deg": (Fraction(math.pi) / 180, _NONE), "rev": (2 * Fraction(math.pi), _NONE),
    "rpm": (Fraction(math.pi) / 30, _FREQUENCY),
    "N": (_ONE, _FORCE), "kN": (_KILO, _FORCE), "MN": (_MEGA, _FORCE),
    "Pa": (_ONE, _STRESS), "kPa": (_KILO, _STRESS), "MPa": (_MEGA, _STRESS), "GPa": (_GIGA, _STRESS),
    "bar": (Fraction(10**5), _STRESS), "kbar": (Fraction(10**8), _STRESS), "Mbar": (Fraction(10**11), _STRESS),
    "psi": (_PSI, _STRESS), "ksi": (_KILO * _PSI, _STRESS),
    "J": (_ONE, _ENERGY), "mJ": (_MILLI, _ENERGY), "kJ": (_KILO, _ENERGY), "MJ": (_MEGA, _ENERGY),
    "W": (_ONE, _POWER), "%": (_CENTI, _NONE),
}  # fmt: skip

KINDS: dict[Dimension, str] = {
    _NONE: "a plain number, without a unit", _LENGTH: "a length", _MASS: "a mass", _TIME: "a time",
    _TEMPERATURE: "a temperature", _FREQUENCY: "a rate", (1, 0, -1, 0): "a speed",
    (1, 0, -2, 0): "an acceleration", _STRESS: "a stress",
    (-3, 1, 0, 0): "a density", (2, 0, -2, -1): "a specific heat", (2, 0, -2, 0): "an energy per mass",
    (2, 0, 0, 0): "an area", (0, 1, -2, 0): "an energy per area",
    (2, 1, 0, 0): "a moment of inertia",
}  # fmt: skip
"""Words for a quantity of each dimension."""

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*")
NUMBER = r"^\s*[+-]?(\d+\.?\d*|\.\d+)"
"""Pattern of the beginning of the text of a quantity, for the JSON schema."""
_FACTOR = re.compile(r"\s*([*/·]?)\s*([A-Za-zµ%]+|1)(?:\^([+-]?\d))?")
QUANTITY = "the quantity's"
"""Text that stands for the unit of a key whose unit depends on another key."""
_LONGEST = 80
"""Largest number of characters of a quantity (chosen value); every sensible number with its unit is shorter. A longer
text is refused before it is read as a quantity."""
LARGEST = 1e30
"""Largest quantity in SI units; the smallest quantity is its inverse. With quantities below this limit the kinetic
energy of any mass and speed is a finite number (reason of the chosen value)."""


_WRITTEN = str.maketrans({
    "\N{GREEK SMALL LETTER MU}": "\N{MICRO SIGN}", "\N{SUPERSCRIPT TWO}": "^2", "\N{SUPERSCRIPT THREE}": "^3",
})  # fmt: skip
"""Other characters that are accepted in units: the Greek letter mu for the micro sign, and raised digits for exponents.
"""


def parse_unit(text: str) -> tuple[Fraction, Dimension]:
    """Returns the exact factor to SI and the dimension of a unit such as ``kg/m^3``. Raises ValueError if the unit is
    unknown.
    """
    text = text.translate(_WRITTEN)
    factor, dimension, position = _ONE, [0, 0, 0, 0], 0
    while position < len(text):
        match = _FACTOR.match(text, position)
        if match is None:
            raise ValueError(f"cannot read the unit {text!r}; write it like 'kg/m^3'")
        operator, symbol, power = match.groups()
        if symbol not in UNITS:
            raise ValueError(f"unknown unit {symbol!r} in {text!r}; known: {', '.join(UNITS)}{meant(symbol, UNITS)}")
        exponent = int(power or 1) * (-1 if operator == "/" else 1)
        scale, base = UNITS[symbol]
        factor *= scale**exponent
        dimension = [d + exponent * b for d, b in zip(dimension, base, strict=True)]
        position = match.end()
    return factor, (dimension[0], dimension[1], dimension[2], dimension[3])


def parse_quantity(value: object, unit: str) -> float:
    """Returns the value of a quantity in SI units. ``value``: a number, which is already in SI units, or a text with a
    unit of the same dimension as ``unit``.

    Raises ValueError if the dimension differs, if the unit is unknown, for NaN and infinity, and for values beyond
    LARGEST or below its inverse.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a quantity in {unit or 'plain numbers'}, got {value!r}")
    number = _read_text(value, unit) if isinstance(value, str) else _to_float(value)
    if not math.isfinite(number):
        raise ValueError(f"{value!r} is not finite")
    return usable(number, f"{value!r} cannot be used: in SI units it")


def written(value: object) -> tuple[str, str] | None:
    """Returns the number and the unit of a quantity as they are written; the unit is empty if there is none. The result
    is None for other text. The function does not check whether the unit exists.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    match = _QUANTITY.fullmatch(str(value)) if len(str(value)) <= _LONGEST else None
    return (match[1], match[2]) if match is not None else None


def usable(number: float, what: str = "it") -> float:
    """Returns ``number`` if its absolute value is 0 or between the inverse of LARGEST and LARGEST. Raises ValueError
    for any other number. ``what``: words for the number in the message.
    """
    if number and not 1.0 / LARGEST <= abs(number) <= LARGEST:
        raise ValueError(f"{what} is not between {1.0 / LARGEST:g} and {LARGEST:g}")
    return number


def _to_float(number: float) -> float:
    try:
        return float(number)
    except OverflowError:
        raise ValueError("a whole number this large cannot be used") from None


def _read_text(text: str, unit: str) -> float:
    match = _QUANTITY.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None:
        example = f"1.5 {unit}".strip()
        raise ValueError(f"{text[:_LONGEST]!r} is not a quantity; write a number and a unit, such as {example!r}")
    factor, dimension = parse_unit(match[2])
    if match[2] and dimension != parse_unit(unit)[1]:
        raise ValueError(f"{text!r} has the wrong dimension; expected {kind_of(unit)}")
    try:
        return float(Fraction(match[1]) * factor)
    except OverflowError:
        return math.inf


def kind_of(unit: str) -> str:
    """Returns the words for a quantity in ``unit``, such as ``a length, in a unit such as 'm'``, for an error
    message.
    """
    kind = "an angle" if unit == "rad" else KINDS.get(parse_unit(unit)[1], "a quantity")
    return f"{kind}, in a unit such as {unit!r}" if unit else kind


def _reader(unit: str) -> BeforeValidator:
    def read(value: Any) -> float:
        return parse_quantity(value, unit)

    return BeforeValidator(read)


@dataclass(frozen=True)
class Written:
    """Addition to the JSON schema of a key whose value is a number or a text with a unit. ``unit``: unit of a number
    without a unit.
    """

    unit: str

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Returns the JSON schema with the addition; pydantic calls this method."""
        return {**handler(core), "type": ["number", "string"], "unit": self.unit}


Length = Annotated[float, _reader("m"), Written("m")]
Time = Annotated[float, _reader("s"), Written("s")]
Speed = Annotated[float, _reader("m/s"), Written("m/s")]
Acceleration = Annotated[float, _reader("m/s^2"), Written("m/s^2")]
Rate = Annotated[float, _reader("1/s"), Written("1/s")]
AngularSpeed = Annotated[float, _reader("rad/s"), Written("rad/s")]
Temperature = Annotated[float, _reader("K"), Written("K")]
Density = Annotated[float, _reader("kg/m^3"), Written("kg/m^3")]
Stress = Annotated[float, _reader("Pa"), Written("Pa")]
Area = Annotated[float, _reader("m^2"), Written("m^2")]
FractureEnergy = Annotated[float, _reader("J/m^2"), Written("J/m^2")]
SpecificHeat = Annotated[float, _reader("J/kg/K"), Written("J/kg/K")]
Mass = Annotated[float, _reader("kg"), Written("kg")]
Inertia = Annotated[float, _reader("kg*m^2"), Written("kg*m^2")]
Angle = Annotated[float, _reader("rad"), Written("rad")]
Ratio = Annotated[float, _reader(""), Written("")]
