"""Extrapolated velocities of the broad phase: rigid motions are preserved, vibrations are removed."""

import numpy as np
import pytest

from conoid.worker.contact.broad_phase.extrapolation import courses, rigid_motions
from conoid.worker.model.state import Block, Floats, Nodes
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.team import team

TET = np.array([[0.0, 0.0, 0.0], [1.1, 0.1, 0.0], [0.2, 0.9, 0.1], [0.1, 0.2, 1.2]]) * 1e-3
QUANTUM = 2.0**-16


def course(x: Floats, v: Floats, tets: list[list[int]], brittle: bool = True) -> Floats:
    """Returns the extrapolated velocities of nodes of 1 kg."""
    n, corners = len(x), np.array(tets, np.uint32)
    one = np.zeros(n, np.int32)
    force = np.zeros((n, 3), np.int64)
    nodes = Nodes(np.arange(n), one, one, np.ones(n, bool), x, x, v, np.ones(n), force, np.zeros(n))
    bond = np.zeros((len(tets) if brittle else 0, 4), np.uint8)
    block = Block(0, len(tets), corners, np.arange(len(tets)), np.zeros((0, 0, 0)), 0, 0, np.zeros(0), bond=bond)
    return courses([block], nodes, [], SerialComm(), rigid_motions(team(1)))


def test_a_rigid_motion_is_kept() -> None:
    v = np.array([30.0, -200.0, 7.0]) + np.cross([3e4, -5e4, 1e4], TET - TET.mean(axis=0))
    assert np.abs(course(TET, v, [[0, 1, 2, 3]]) - v).max() <= 0.51 * QUANTUM


@pytest.mark.parametrize("seed", range(3))
def test_the_rigid_motion_has_the_momentum_and_spin_of_the_tet(seed: int) -> None:
    """The rigid motion is that of least squares: the removed part of the velocities has neither momentum nor spin."""
    v = np.random.default_rng(seed).normal(0.0, 100.0, (4, 3))
    left = v - course(TET, v, [[0, 1, 2, 3]])
    assert np.abs(left.sum(axis=0)).max() < 4 * QUANTUM
    assert np.abs(np.cross(TET, left).sum(axis=0)).max() < 4 * QUANTUM * np.abs(TET).max()
    assert np.abs(left).max() > 10.0


def test_vibration_is_removed() -> None:
    """A tet that changes its size is extrapolated with the velocity of its centre."""
    v = 1e5 * (TET - TET.mean(axis=0)) + np.array([50.0, 0.0, 0.0])
    assert np.abs(course(TET, v, [[0, 1, 2, 3]]) - [50.0, 0.0, 0.0]).max() < QUANTUM


def test_a_node_of_two_tets_has_the_mean_of_their_motions() -> None:
    x = np.concatenate([TET, [[1.0, 1.1, 1.0]]])
    v = np.random.default_rng(1).normal(0.0, 100.0, (5, 3))
    one, two = course(x, v, [[0, 1, 2, 3]]), course(x, v, [[1, 2, 3, 4]])
    both = course(x, v, [[0, 1, 2, 3], [1, 2, 3, 4]])
    assert np.abs(both[1:4] - 0.5 * (one + two)[1:4]).max() < 2 * QUANTUM
    assert np.array_equal(both[[0, 4]], [one[0], two[4]])


def test_other_nodes_keep_their_velocities() -> None:
    """Nodes of a metal, and nodes without tets, are extrapolated with their own velocities or with mean velocities; so
    are nodes of a tet that is too flat for a spin.
    """
    v = np.random.default_rng(2).normal(0.0, 100.0, (4, 3))
    assert np.array_equal(course(TET, v, [[0, 1, 2, 3]], brittle=False), v)
    assert np.array_equal(course(np.concatenate([TET, TET[:1]]), np.concatenate([v, v[:1]]), [[0, 1, 2, 3]])[4], v[0])
    line = np.outer(np.arange(4.0), [1e-3, 0.0, 0.0])
    assert np.abs(course(line, v, [[0, 1, 2, 3]]) - v.mean(axis=0)).max() < QUANTUM
