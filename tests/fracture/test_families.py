"""Pieces that have an edge alone in common do not pass each other there, while the cracks round it are narrow."""

from collections.abc import Iterator
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases import materials, schema
from conoid.worker import state, step
from conoid.worker.fracture.strength import Toughness
from conoid.worker.mesh.model import TetMesh
from conoid.worker.parallel.fixed_point import exact_sums
from conoid.worker.simulation import Simulation
from conoid.worker.state import Floats, Ints

from ..contact.bodies import meeting_of
from ..worker.kernels import build
from ..worker.meshes import block
from ..worker.simulations import on
from .facets import corners_of, inner

MM = 1e-3
SOFT = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=70e9, poisson=0.2),
    brittle=materials.Brittle(strength=1e6, energy=1e-3),
)  # fmt: skip
MIDDLE = 2.0 * MM


def mesh_of() -> TetMesh:
    """A block of 4 x 2 x 4 mm, with planes of facets x and z = 2 mm, which cross in the middle."""
    return block((4, 2, 4), MM, shake=0.0)


@pytest.fixture(autouse=True)
def only_the_planes_break() -> Iterator[None]:
    """Their facets have a strength of 1 Pa, all others hold: four columns are left, each beside two and facing one
    across the edge in the middle."""
    mesh = mesh_of()
    facets = inner(mesh)
    points = mesh.points[corners_of(mesh, facets)]
    weak = facets[(points[:, :, [0, 2]] == MIDDLE).all(axis=1).any(axis=1), 0]

    def strengths(self: Toughness, ids: Ints, area: Floats) -> Floats:
        return np.where(np.isin(ids, weak), 1.0, 1e30)

    with patch.object(Toughness, "strengths", strengths):
        yield


def case_of() -> schema.Case:
    return meeting_of([{"fracture": schema.Fracture(delay=0.0)}], {"friction": 0.0}, material=SOFT, end=1.0)


def columns(sim: Simulation) -> Ints:
    """(nodes,) which column each node belongs to: 1 for x, 2 for z beyond the middle; all ranks take part."""
    nodes = sim.model.nodes
    found = np.zeros(sim.model.nodes_global)
    for b in sim.model.blocks:
        middle = nodes.x0[b.tets].mean(axis=1)
        found[nodes.id[b.tets]] = ((middle[:, 0] > MIDDLE) + 2 * (middle[:, 2] > MIDDLE))[:, None]
    return sim.comm.maximum(found)[nodes.id].astype(np.int64)


def at_rest(sim: Simulation) -> Simulation:
    """The block just after both planes have broken by a stress of a few Pa: without stress, force and motion."""
    nodes = sim.model.nodes
    step.prepare(sim)
    first = sim.model.nodes_global
    nodes.v[:] = 1e-6 * np.sign(nodes.x0 - MIDDLE) * [1.0, 0.0, 1.0]
    for _ in range(4):
        step.first_half(sim)
        step.second_half(sim)
    assert sim.model.nodes_global == first + 3 * 3 + 4 * 2 * 3
    nodes.x[:], nodes.v[:], nodes.force[:] = nodes.x0, 0.0, 0
    for b in sim.model.blocks:
        b.state[:, : state.VISCOUS + 1, :] = 0.0
    return sim


def meeting(sim: Simulation) -> Ints:
    """Two columns that have the edge in common meet there at 4 m/s, the two others make way."""
    which, speed = columns(sim), np.array([[1.0, 0.0, 1.0], [1.2, 0.0, -1.2], [-1.2, 0.0, 1.2], [-1.0, 0.0, -1.0]])
    sim.model.nodes.v[:] = speed[which] * 2.0
    return which


def depth(sim: Simulation, which: Ints) -> float:
    """How far the edge of one column has come into the one that it faces, m; one rank."""
    nodes = sim.model.nodes
    edge = (nodes.x0[:, [0, 2]] == MIDDLE).all(axis=1)
    low, high = (nodes.x[edge & (which == k)][:, [0, 2]] for k in (0, 3))
    assert len(low) == len(high) == 3
    return float((low - high).min(axis=1).max())


@pytest.mark.parametrize("searched", [False, True])
def test_what_has_an_edge_alone_in_common_does_not_pass(searched: bool) -> None:
    """To a twentieth of the way that they would have gone, which five sweeps leave; momentum is exact."""
    sim = at_rest(build(case_of(), [mesh_of()]))
    assert sim.contact is not None
    which, nodes = meeting(sim), sim.model.nodes
    before = (nodes.mass[:, None] * nodes.v).sum(axis=0)
    sim.contact.searches.due = searched
    deepest, start = 0.0, sim.clock.t
    for _ in range(40):
        step.first_half(sim)
        deepest = max(deepest, depth(sim, which))
        step.second_half(sim)
    assert deepest < 0.05 * 4.0 * (sim.clock.t - start)
    assert (nodes.mass[:, None] * nodes.v).sum(axis=0) == pytest.approx(before, abs=1e-12 * nodes.mass.sum())


def test_it_is_held_alike_on_any_number_of_ranks() -> None:
    """Through searches, to the bit."""

    def work(sim: Simulation) -> list[float]:
        at_rest(sim)
        assert sim.contact is not None
        nodes = sim.model.nodes
        meeting(sim)
        nodes.v[:, 1] += nodes.id * 0.37 % 1.0
        for n in range(40):
            sim.contact.searches.due |= n in (10, 11, 25)
            step.first_half(sim)
            step.second_half(sim)
        moments = np.concatenate([nodes.x, nodes.v], axis=1) * (1.0 + nodes.id[:, None])
        sums: list[float] = exact_sums(sim.comm, moments[nodes.owned]).tolist()
        return sums

    runs = [on(ranks, case_of(), [mesh_of()], work) for ranks in (1, 2, 3)]
    assert all(one == runs[0][0] for found in runs for one in found)
