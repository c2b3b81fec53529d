"""Tests of the studies of single scenes: their cases are valid, and their meshes have the properties that the tables
give."""

import numpy as np
import pytest

from conoid.cases import load

from . import comparable_rod, kalthoff, plugging
from .cracks import Crack, Run, prepared


@pytest.mark.parametrize("variant", comparable_rod.VARIANTS, ids=lambda variant: variant.name)
def test_a_variant_of_the_rod_is_a_case(variant: comparable_rod.Variant) -> None:
    """Checks the case without changes, and each variant."""
    load.parse_case(comparable_rod.data_of(variant))
    alike = [
        other.name
        for other in comparable_rod.VARIANTS
        if comparable_rod.data_of(other) == comparable_rod.data_of(variant)
    ]
    assert alike == [variant.name]


@pytest.mark.parametrize("variant", [*plugging.CURVE, *plugging.CAUSES], ids=lambda variant: variant.name)
def test_a_variant_of_the_plate_is_a_case(variant: plugging.Variant) -> None:
    """Checks the case without changes, and each variant."""
    data = plugging.data_of(variant)
    load.parse_case(data)
    alike = [other.name for other in (*plugging.CURVE, *plugging.CAUSES) if plugging.data_of(other) == data]
    assert alike == [variant.name]


def test_a_random_plate_has_a_smooth_slit_of_the_length_that_is_asked_for() -> None:
    """The sides of the slit are doubled nodes on y = 0, no tet crosses the slit, and the nodes at the tip are not
    doubled."""
    plan = kalthoff.plan("random", 2.5e-3, 1)
    _, mesh = prepared(plan)
    _, where, count = np.unique(mesh.points.round(9), axis=0, return_index=True, return_counts=True)
    doubled = mesh.points[where[count > 1]]
    assert (doubled[:, 1] == 0.0).all()
    assert len(doubled) == 2 * 20
    assert doubled[:, 0].max() == pytest.approx(kalthoff.TIP - plan.size)
    y = mesh.points[mesh.tets, 1]
    crossing = (y.min(axis=1) < -1e-9) & (y.max(axis=1) > 1e-9)
    assert mesh.points[mesh.tets[crossing], 0].mean(axis=1).min() > kalthoff.TIP


def test_the_angle_and_the_speed_of_a_crack_that_is_known() -> None:
    """The open facets lie along 65 degrees from the tip of the slit, at 1.5 km/s from 20 us on; further open facets
    come from the other side."""
    r, turned = np.linspace(0.5e-3, 60e-3, 60), np.radians(65.0)
    centre = np.column_stack([kalthoff.TIP + r * np.cos(turned), r * np.sin(turned), 0.0 * r])
    far = np.array([[90e-3, -20e-3, 0.0]] * 5)
    crack = Crack(1e-3, kalthoff.TIP, 0.1, np.arange(65), np.concatenate([centre, far]), np.ones(65),
                  np.concatenate([20e-6 + r / 1500.0, np.full(5, 50e-6)]))  # fmt: skip
    case, _ = prepared(kalthoff.plan("structured", 2.5e-3))
    path = kalthoff.Path(Run(kalthoff.plan("structured", 1e-3), case, 0, crack, None, 0, 0, 0.0, 0.0))  # type: ignore[arg-type]
    assert path.angle(1.0) == pytest.approx(65.0)
    assert path.angle(20e-3) == pytest.approx(65.0)
    assert path.speed == pytest.approx(1500.0)
    assert path.reach == pytest.approx(60e-3)
    assert path.share == pytest.approx(60 / 65)
