"""Quantities as text: the closed grammar, SI values, and one clear line for every invalid text."""

import math
from fractions import Fraction

import pytest

from conoid.cases.units import parse_quantity, parse_unit


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("210 m/s", "m/s", 210.0),
        ("21.47 mm", "m", 0.02147),
        ("7.85 g/cm^3", "kg/m^3", 7850.0),
        ("206.9GPa", "Pa", 206.9e9),
        ("460 J/kg/K", "J/kg/K", 460.0),
        ("460 J kg^-1 K^-1", "J/kg/K", 460.0),
        ("-2.5e-3 km/ms", "m/s", -2500.0),
        ("10000 rev/s", "rad/s", 20000.0 * math.pi),
        ("30000 rpm", "rad/s", 1000.0 * math.pi),
        ("120 ksi", "Pa", 120e3 * 6894.757293168362),
        ("1 psi", "Pa", 6894.757293168362),
        ("75 kbar", "Pa", 7.5e9),
        ("3000 ft/s", "m/s", 914.4),
        ("0.284 lb/in^3", "kg/m^3", 0.284 * 27679.90471020312),
        ("1 1/s", "1/s", 1.0),
        ("80 us", "s", 8e-5),
        ("80 \N{MICRO SIGN}s", "s", 8e-5),
        ("80 \N{GREEK SMALL LETTER MU}s", "s", 8e-5),
        ("40 \N{GREEK SMALL LETTER MU}m/s", "m/s", 4e-5),
        ("7850 kg/m\N{SUPERSCRIPT THREE}", "kg/m^3", 7850.0),
        ("9.81 m/s\N{SUPERSCRIPT TWO}", "m/s^2", 9.81),
        ("250 ps", "s", 2.5e-10),
        ("5 %", "", 0.05),
        ("0.3", "", 0.3),
        ("0.3", "m", 0.3),
        (7, "m", 7.0),
    ],
)
def test_reads(text: str | float, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("3 s", "m", "expected a length, in a unit such as 'm'"),
        ("3 mm", "Pa", "expected a stress"),
        ("3 m", "", "expected a plain number, without a unit"),
        ("3 furlong", "m", "unknown unit 'furlong'"),
        ("three mm", "m", "write a number and a unit, such as '1.5 m'"),
        ("9**9**9", "m", "cannot read the unit"),
        ("__import__('os')", "m", "is not a quantity"),
        ("1" + " " * 100 + "mm", "m", "is not a quantity"),
        ("1e999 m", "m", "is not finite"),
        ("1e300 km^9", "m", "wrong dimension"),
        ("nan", "m", "is not a quantity"),
        (float("nan"), "m", "is not finite"),
        (float("inf"), "m", "is not finite"),
        (10**400, "m", "this large"),
        ("1e300 m/s", "m/s", "'1e300 m/s' cannot be used: in SI units it is not between 1e-30 and 1e+30"),
        (-1e31, "m", "not between"),
        ("1e-25 um", "m", "not between"),
        (True, "m", "expected a quantity"),
        (None, "m", "expected a quantity"),
        ("", "m", "is not a quantity"),
        ("mm", "m", "is not a quantity"),
        ("1 m2", "m", "cannot read the unit"),
    ],
)
def test_refuses(text: object, unit: str, message: str) -> None:
    with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
        parse_quantity(text, unit)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("texts", "unit"),
    [
        (["0.004 mm", "4 um", "4e-9 km", "4000 nm", "0.0004 cm"], "m"),
        (["7.83 g/cm^3", "7830 kg/m^3", "7.83e-9 t/mm^3", "7.83e-6 kg/mm^3"], "kg/m^3"),
        (["0.37 GPa", "370 MPa", "3700 bar", "370 N/mm^2"], "Pa"),
        (["0.7 mm/us", "700 m/s", "0.7 km/s", "2520 km/h"], "m/s"),
    ],
)
def test_a_quantity_is_the_same_to_the_bit_in_any_unit(texts: list[str], unit: str) -> None:
    assert len({parse_quantity(text, unit) for text in texts}) == 1


def test_units_multiply_and_divide_from_the_left() -> None:
    assert parse_unit("J/kg/K") == parse_unit("J kg^-1*K^-1")
    assert parse_unit("kg/m^3") == (Fraction(1), (-3, 1, 0, 0))
