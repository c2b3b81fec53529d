"""A candidate that rests would not have met: random flights, knocks and turns, against looking at every pair."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import parse_case, read_data
from conoid.worker import simulation, step
from conoid.worker.contact.rest import Rest
from conoid.worker.digest import digest
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.state import Indices

from .kernels import edge_edge, edge_sizes, face_sizes, moments, node_face

SHARDS = 60
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
FACES = np.array([[0, 2, 1, 3], [0, 1, 3, 2], [1, 2, 3, 0], [0, 3, 2, 1]])
EDGES = np.array([[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]])


def apart(one: Indices, two: Indices) -> Indices:
    """Places of pairs of rows of different shards: shard of ``one`` below that of ``two`` for edges."""
    pairs = np.stack(np.meshgrid(np.arange(len(one)), np.arange(len(two)), indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(pairs[one[pairs[:, 0]] != two[pairs[:, 1]]], np.int32)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("violence", [0.0, 0.02, 0.5])
def test_who_rests_does_not_meet(seed: int, violence: float) -> None:
    """Tets fly, turn and are knocked about; what the kernels find among all pairs is among those that are awake.

    Nodes look where their tet's corner points, more or less, and one in four everywhere.
    """
    draw = np.random.default_rng(seed)
    x = (draw.uniform(-2.5, 2.5, (SHARDS, 1, 3)) + CORNERS).reshape(-1, 3)
    v = np.repeat(draw.normal(0.0, 0.4, (SHARDS, 3)), 4, axis=0)
    first, shard = 4 * np.arange(SHARDS), np.arange(SHARDS)
    faces = (first[:, None, None] + FACES).reshape(-1, 4).astype(np.int32)
    edges = (first[:, None, None] + EDGES).reshape(-1, 4).astype(np.int32)
    part = np.repeat(shard % 3, 4).astype(np.int32)
    nodes = apart(np.repeat(shard, 4), np.repeat(shard, 4))
    ridges = apart(np.repeat(shard, 6), np.repeat(shard, 6))
    ridges = ridges[ridges[:, 0] < ridges[:, 1]]
    size, length = face_sizes(x, faces), edge_sizes(x, edges)
    outward = np.tile(CORNERS - CORNERS.mean(axis=0), (SHARDS, 1))[:, None] + draw.normal(0.0, 0.3, (len(x), 3, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    outward[draw.uniform(size=len(x)) < 0.25] = 0.0
    rest = Rest(x, v, len(faces), len(edges), len(nodes), len(ridges))
    met, looked = 0, 0
    for _ in range(40):
        dt = float(draw.uniform(0.005, 0.02))
        v = v + violence * draw.normal(0.0, 1.0, v.shape) * (draw.uniform(size=(len(v), 1)) < 0.1)
        rest.move(x, v, faces, edges, dt)
        some, few = rest.awake(nodes, ridges)
        found = node_face(x, v, faces, nodes, dt, part, out=outward)
        assert np.isin(found.pair[: found.n], some).all()
        alone = edge_edge(x, v, edges, np.ascontiguousarray(ridges[few]), dt)
        every = edge_edge(x, v, edges, ridges, dt)
        assert np.array_equal(alone.nodes[: alone.n], every.nodes[: every.n])
        met += found.n + every.n
        looked += len(some) + len(few)
        planes, known = np.empty((len(faces), 3)), np.zeros(len(faces), bool)
        of = (nodes, ridges, faces, size, edges, length, moments(outward), planes, known)
        rest.settle(some, few, *of, x + dt * v, part)
        x = x + dt * v
    assert met > 20
    assert looked < 40 * (len(nodes) + len(ridges)) * (0.1 if violence < 0.1 else 0.5)


def test_a_pair_whose_face_has_new_corners_is_looked_at() -> None:
    x = np.array([[0.0, 0.0, 9.0], *CORNERS])
    faces, edges = np.array([[1, 2, 3, 4]], np.int32), np.zeros((0, 4), np.int32)
    pairs, none = np.zeros((1, 2), np.int32), np.zeros((0, 2), np.int32)
    rest = Rest(x, np.zeros_like(x), 1, 0, 1, 0)
    sizes, part = np.ones(1), np.zeros(5, np.int32)
    for fresh in (True, False, True):
        rest.move(x, np.zeros_like(x), faces, edges, 1.0)
        some, few = rest.awake(pairs, none)
        assert len(some) == fresh
        of = (pairs, none, faces, sizes, edges, np.zeros(0), np.zeros((5, 9)), np.empty((1, 3)), np.zeros(1, bool))
        rest.settle(some, few, *of, x, part)
        rest.faces[0] = not fresh


def test_a_body_that_breaks_comes_to_the_same_without_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """To the bit: pairs of copies and of faces with new corners among them."""
    case = parse_case(read_data(Path(__file__).parents[1] / "parallel" / "breaking.toml"))

    def end() -> tuple[str | None, int]:
        sim = simulation.build(case, Path(), SerialComm())
        step.prepare(sim)
        for _ in range(40):
            step.first_half(sim)
            sim.clock.frame += sim.clock.frame_due
            step.second_half(sim)
        assert sim.fracture is not None
        return digest(sim.model, sim.comm, []), sim.fracture.broken

    def every(rest: Rest, node_face: Indices, edge_edge: Indices) -> tuple[Indices, Indices]:
        return np.arange(len(node_face), dtype=np.int32), np.arange(len(edge_edge), dtype=np.int32)

    rested = end()
    monkeypatch.setattr(Rest, "awake", every)
    assert end() == rested
    assert rested[1] > 100
