"""Warnings about mesh and time step of a part that fractures."""

import re
from typing import Any

import pytest

from conoid.cases.model import materials, schema
from conoid.worker.fracture.resolution import merged, warnings
from conoid.worker.fracture.strength import toughness

from ..worker.kernels import DUMMY

GLASS = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=72e9, poisson=0.22),
    brittle=materials.Brittle(strength=60e6, energy=8.0),
)  # fmt: skip


def lines(size: float, safety: float = 0.9, rate: float = 0.0, **spec: Any) -> list[str]:
    """Returns the warnings for glass with tets of edge ``size``, m, stretched along x at a ``rate``, 1/s."""
    fracture = schema.Fracture(model="cohesive", **spec)
    stretch = {"rate": (rate, 0.0, -2.0 * rate)}
    pane = schema.Part.model_validate(
        {"name": "pane", "material": "glass", "mesh": DUMMY, "fracture": fracture, "stretch": stretch}
    )
    return warnings(pane, toughness(GLASS, fracture, size), size, safety)


@pytest.mark.parametrize("size", [0.6e-3, 0.7e-3, 1e-3, 1.23e-3, 2e-3, 3.1e-3])
def test_a_cohesive_zone_of_the_requested_length_is_resolved(size: float) -> None:
    """The warned ratio equals the requested ratio up to the last bits."""
    assert not [line for line in lines(size, resolve="strength") if "resolved" in line]


def test_the_advice_on_a_zone_helps() -> None:
    [line] = lines(0.6e-3)
    assert line.endswith("fracture.resolve = 'strength' keeps the energy and lowers the strength")
    [line] = lines(0.6e-3, resolve="strength", resolution=2.0)
    assert line.endswith("fracture.resolution = 3 keeps the energy and lowers the strength further")
    assert lines(0.6e-3, resolve="strength", resolution=3.0) == []


def test_the_advice_on_the_step_helps() -> None:
    line = lines(5e-3)[-1]
    found = re.search(r"numerics.dt_safety below (\S+)$", line)
    assert found is not None
    limit = float(found[1])
    assert 0.0 < limit < 0.9
    assert "does not resolve the law" not in lines(5e-3, 0.95 * limit)[-1]
    assert "does not resolve the law" in lines(5e-3, 1.05 * limit)[-1]


def test_a_stretched_part_opens_by_its_rate_as_well() -> None:
    """Glass opens at 4.3 m/s when it breaks; at a rate of 64,000/s tets of 0.6 mm are stretched by 38 m/s."""
    assert not [line for line in lines(0.6e-3) if "does not resolve" in line]
    [line] = [line for line in lines(0.6e-3, rate=64e3) if "does not resolve" in line]
    found = re.search(r"would open by (\S+) um in a step of (\S+) ns", line)
    assert found is not None
    opening, step = float(found[1]) * 1e-6, float(found[2]) * 1e-9
    assert opening / step == pytest.approx(64e3 * 0.6e-3 + 60e6 / 14.2e6, rel=0.02)


def test_a_warning_names_its_parts_or_the_first_few() -> None:
    bricks = [f"brick{k}" for k in range(8)]
    assert merged({"long": ["a", "b"], "wide": ["a"]}) == ["a, b: long", "a: wide"]
    assert merged({"long": bricks}) == ["brick0, brick1, brick2, brick3, brick4 and 3 more: long"]
    assert merged({}) == []
