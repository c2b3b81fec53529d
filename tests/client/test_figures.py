"""Numbers as people read them."""

import math

import pytest

from conoid.client.figures import count, duration, number, rough, si


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (80e-6, "s", "80.0 µs"),
        (8.1e-9, "s", "8.10 ns"),
        (0.99999e-6, "s", "1.00 µs"),
        (999.96, "J", "1.00 kJ"),
        (-215e6, "Pa", "-215 MPa"),
        (9.7e6, "", "9.70 M"),
        (0.0, "J", "0 J"),
        (5e-14, "s", "0.05 ps"),
        (2e-15, "s", "2e-15 s"),
        (7.85e24, "N s", "7.85e+24 N s"),
        (math.inf, "s", "inf s"),
    ],
)
def test_si(value: float, unit: str, text: str) -> None:
    assert si(value, unit) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.42, "0.4 s"), (9.96, "10 s"), (59.6, "1 min 00 s"), (125, "2 min 05 s"), (11040, "3 h 04 min"),
     (1.2e22, "3.33e+18 h"), (-1, "–"),
     (math.nan, "–")],
)  # fmt: skip
def test_duration(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_counts_and_numbers() -> None:
    assert count(1234567.4) == "1 234 567"
    assert count(2.4e21) == "2.4e+21"
    assert number(0.0214612345) == "0.0214612"
    assert {count(None), number(math.nan), rough(math.nan), si(math.nan, "s")} == {"–"}, "not known"
