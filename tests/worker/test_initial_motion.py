"""Initial motion of bodies: velocity, spin, stretch, and a random part that does not depend on the cut of the mesh."""

from typing import Any

import numpy as np
import pytest

from conoid.worker.model.hashing import splitmix64, uniform
from conoid.worker.scene import domain, motion

from .kernels import scene, whole_of
from .meshes import Floats, block

MESH = block((4, 3, 3), 1e-3, seed=5)


def started(**keys: Any) -> Floats:
    """Returns (n, 3) the initial velocities, m/s."""
    return whole_of(MESH, scene(**keys)).velocity


def test_the_sequence_is_splitmix64() -> None:
    """The first five numbers for the seed 1234567 are those of the reference implementation."""
    assert splitmix64(np.arange(5), 1234567).tolist() == [
        6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821,
    ]  # fmt: skip


def test_uniform_is_uniform() -> None:
    """The mean, the variance and the correlation of neighbours of a million numbers are within four standard errors,
    and 64 bins show no bias.
    """
    u = uniform(np.arange(1_000_000), 7)
    assert 0.0 <= u.min() < 1e-5
    assert 1.0 - 1e-5 < u.max() < 1.0
    assert u.mean() == pytest.approx(0.5, abs=4 * 12**-0.5 / 1e3)
    assert u.var() == pytest.approx(1 / 12, abs=4 * 180**-0.5 / 1e3)
    assert abs(((u[1:] - 0.5) * (u[:-1] - 0.5)).mean()) < 4 / 12 / 1e3
    count = np.bincount((64 * u).astype(int), minlength=64)
    assert ((count - 1e6 / 64) ** 2 / (1e6 / 64)).sum() == pytest.approx(63, abs=4 * 126**0.5)


def test_stretch_adds_to_velocity_and_spin() -> None:
    centre, rate, v = np.array([1e-3, 0.0, -2e-3]), np.array([2e3, -1e3, 5e2]), np.array([3.0, 4.0, 5.0])
    stretch = {"centre": tuple(centre.tolist()), "rate": tuple(rate.tolist())}
    spin = {"centre": (0.0, 0.0, 0.0), "rate": (0.0, 0.0, 1e4)}
    found = started(velocity=tuple(v.tolist()), spin=spin, stretch=stretch)
    turning = np.cross([0.0, 0.0, 1e4], MESH.points)
    assert found == pytest.approx(v + turning + (MESH.points - centre) @ np.diag(rate), rel=1e-14, abs=1e-12)


def test_jitter_fills_its_range_and_adds_to_the_velocity() -> None:
    still, moving = started(jitter=2.0), started(jitter=2.0, velocity=(100.0, 0.0, 0.0))
    assert 1.9 < np.abs(still).max() <= 2.0
    assert np.abs(still.mean(axis=0)).max() < 4 * 2.0 / (3 * len(still)) ** 0.5
    assert len(np.unique(still)) == still.size
    assert moving == pytest.approx(still + np.array([100.0, 0.0, 0.0]), rel=1e-14, abs=1e-12)
    assert not started(jitter=0.0).any()


@pytest.mark.parametrize("ranks", [2, 3, 7])
def test_jitter_does_not_depend_on_ranks(ranks: int) -> None:
    whole = whole_of(MESH, scene(jitter=1.0))
    for piece in domain.cut(whole, ranks):
        expected = 2.0 * uniform(3 * piece.node_ids[:, None] + np.arange(3), motion._JITTER) - 1.0
        assert (piece.velocity == expected).all()
