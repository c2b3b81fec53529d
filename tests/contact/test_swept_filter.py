"""Swept filter: removed pairs do not come near each other during the horizon, and most pairs that stay apart are
removed.
"""

import numpy as np
import pytest

from conoid.worker.contact.broad_phase.boxes import Lines
from conoid.worker.contact.broad_phase.swept_filter import SweptFilter
from conoid.worker.contact.narrow_phase.tables import DEEP_SELF
from conoid.worker.parallel.team import team

from ..worker.meshes import Floats
from .bodies import Flags, Indices
from .distances import above, across

PAIRS, SKIN, HORIZON = 10_000, 0.1, 1.0
TIMES = np.linspace(0.0, HORIZON, 41)


def flights(seed: int, many: int, turn: float) -> tuple[Floats, Floats]:
    """Returns (pairs, 2, many, 3) positions and velocities of pairs of things. A thing has ``many`` corners and is
    about 1 m long; it moves by about its length and rotates by about ``turn``, rad.
    """
    draw = np.random.default_rng(seed)
    shape = draw.normal(size=(PAIRS, 2, many, 3))
    shape /= np.linalg.norm(shape - shape.mean(axis=2, keepdims=True), axis=3).mean(axis=2)[..., None, None]
    away = draw.normal(size=(PAIRS, 2, 1, 3)) * np.array([0.7, 0.7, 0.7])
    spin = turn * draw.normal(size=(PAIRS, 2, 1, 3)) / np.sqrt(3.0)
    flight = draw.normal(size=(PAIRS, 2, 1, 3)) * 0.5
    middle = shape.mean(axis=2, keepdims=True)
    return shape - middle + away, flight + np.cross(spin, shape - middle)


def lines(x: Floats, v: Floats, horizon: float) -> Lines:
    """Extrapolation of the nodes of one part."""
    flat = x.reshape(-1, 3).copy()
    return Lines(flat, v.reshape(-1, 3).copy(), horizon, np.zeros(len(flat), np.int32))


def kept_edges(pairs: Indices, corners: Indices, deep: Floats, of: Lines, skin: float) -> Flags:
    """(p,) pairs that the filter keeps, no two with the same first edge."""
    left = SweptFilter(team(1)).edges(pairs.copy(), corners, deep, of, skin)
    return np.asarray(np.isin(pairs[:, 0], left[:, 0]))


def wrong_edges(seed: int, turn: float) -> tuple[int, float]:
    """Returns the number of removed pairs of edges that come nearer than half the skin, and the fraction of removed
    pairs.
    """
    x, v = flights(seed, 2, turn)
    ends = np.arange(4 * PAIRS, dtype=np.int32).reshape(-1, 2)
    pairs = np.arange(2 * PAIRS, dtype=np.int32).reshape(-1, 2)
    size = np.linalg.norm(x[:, :, 1] - x[:, :, 0], axis=2).reshape(-1)
    corners = np.column_stack([ends, ends]).astype(np.int32)
    kept = kept_edges(pairs, corners, DEEP_SELF * size, lines(x, v, HORIZON), SKIN)
    x, v = x[~kept], v[~kept]
    ways = (x + t * v for t in TIMES)
    least = np.min([across(y[:, 0, 0], y[:, 0, 1], y[:, 1, 0], y[:, 1, 1]) for y in ways], axis=0)
    return int((least < 0.5 * SKIN).sum()), len(x) / PAIRS


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.5, 1.0])
def test_no_edges_are_removed_that_come_near(turn: float) -> None:
    wrong, share = wrong_edges(1, turn)
    assert share > 0.3
    assert wrong == 0


def wrong_faces(seed: int, turn: float) -> tuple[int, float]:
    """Returns the number of removed pairs of nodes and faces that come nearer than half the skin, and the fraction of
    removed pairs.
    """
    x, v = flights(seed, 3, turn)
    corners = np.arange(6 * PAIRS, dtype=np.int32).reshape(PAIRS, 2, 3)
    faces = np.column_stack([corners[:, 1], corners[:, 1, :1]]).astype(np.int32)
    pairs = np.column_stack([corners[:, 0, 0], np.arange(PAIRS)]).astype(np.int32)
    size = np.sqrt(np.linalg.norm(np.cross(x[:, 1, 1] - x[:, 1, 0], x[:, 1, 2] - x[:, 1, 0]), axis=1))
    left = SweptFilter(team(1)).faces(pairs.copy(), faces, size, lines(x, v, HORIZON), SKIN)
    kept = np.isin(pairs[:, 1], left[:, 1])
    x, v = x[~kept], v[~kept]
    ways = (x + t * v for t in TIMES)
    least = np.min([above(y[:, 0, 0], y[:, 1, 0], y[:, 1, 1], y[:, 1, 2]) for y in ways], axis=0)
    return int((least < 0.5 * SKIN).sum()), len(x) / PAIRS


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.5, 1.0])
def test_no_node_is_removed_that_comes_near_a_face(turn: float) -> None:
    wrong, share = wrong_faces(1, turn)
    assert share > 0.3
    assert wrong == 0


def test_edges_that_come_near_between_two_moments_are_not_removed() -> None:
    """The edges are 0.13 m apart after a twelfth of the horizon. At the beginning, the middle and the end of the
    horizon the crossing is beyond an end of an edge.
    """
    x = np.array([[-1.0, 1.175, -1.896], [-0.046, 0.775, -0.536], [0.263, 1.232, -0.359], [-0.201, 1.28, -0.777]])
    v = np.array([[-0.677, 2.596, -0.252], [0.334, 2.861, 0.613], [-0.615, 0.038, -1.033], [-0.528, 0.628, -0.385]])
    edges, pair = np.array([[0, 1, 0, 0], [2, 3, 0, 0]], np.int32), np.array([[0, 1]], np.int32)
    then = x + 0.125 * v
    assert across(*then) < 0.15
    assert kept_edges(pair, edges, DEEP_SELF * np.array([1.41, 1.0]), lines(x, v, 1.5), 0.2).all()
