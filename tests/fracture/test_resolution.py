"""What a part is told of its mesh and its step before it breaks."""

import re
from typing import Any

import pytest

from conoid.cases import materials, schema
from conoid.worker.fracture.resolution import warnings
from conoid.worker.fracture.strength import toughness

GLASS = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=72e9, poisson=0.22),
    brittle=materials.Brittle(strength=60e6, energy=8.0),
)  # fmt: skip


def told(size: float, safety: float = 0.9, **spec: Any) -> list[str]:
    """Of glass with tets of edge ``size``, m."""
    fracture = schema.Fracture(model="cohesive", **spec)
    return warnings("pane", fracture, toughness(GLASS, fracture, size), size, safety)


@pytest.mark.parametrize("size", [0.6e-3, 0.7e-3, 1e-3, 1.23e-3, 2e-3, 3.1e-3])
def test_a_zone_that_is_as_long_as_it_was_asked_to_be_is_resolved(size: float) -> None:
    """To the last bits."""
    assert not [line for line in told(size, resolve="strength") if "resolved" in line]


def test_the_advice_on_a_zone_helps() -> None:
    [line] = told(0.6e-3)
    assert line.endswith("fracture.resolve = 'strength' keeps it and lowers the strength")
    [line] = told(0.6e-3, resolve="strength", resolution=2.0)
    assert line.endswith("fracture.resolution = 3 keeps it and lowers the strength further")
    assert told(0.6e-3, resolve="strength", resolution=3.0) == []


def test_the_advice_on_the_step_helps() -> None:
    line = told(5e-3)[-1]
    found = re.search(r"numerics.dt_safety below (\S+)$", line)
    assert found is not None
    limit = float(found[1])
    assert 0.0 < limit < 0.9
    assert "no law can be followed" not in told(5e-3, 0.95 * limit)[-1]
    assert "no law can be followed" in told(5e-3, 1.05 * limit)[-1]
