"""Pieces with only a common edge or node: while the cracks around this edge or node are narrow, the pieces do not pass
each other there. The pieces pass each other if their faces would not touch.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.model import materials, schema
from conoid.worker import step
from conoid.worker.fracture.strength import Toughness
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows
from conoid.worker.model.state import Floats, Ints
from conoid.worker.parallel.fixed_point import exact_sums
from conoid.worker.simulation import Simulation

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


def mesh_of(height: int = 2) -> TetMesh:
    """Returns a block of 4 x 2 x 4 mm, with planes of facets at x and z = 2 mm that cross in the middle of the block;
    ``height``: extent along y, mm.
    """
    return block((4, height, 4), MM, shake=0.0)


@contextmanager
def planes_that_break(mesh: TetMesh, axes: list[int]) -> Iterator[None]:
    """Strengths: facets in the middle planes of the given axes have a strength of 1 Pa, all other facets hold."""
    facets = inner(mesh)
    points = mesh.points[corners_of(mesh, facets)]
    weak = facets[(points[:, :, axes] == MIDDLE).all(axis=1).any(axis=1), 0]

    def strengths(self: Toughness, ids: Ints, area: Floats) -> Floats:
        return np.where(np.isin(ids, weak), 1.0, 1e30)

    with patch.object(Toughness, "strengths", strengths):
        yield


@pytest.fixture
def columns_come_apart() -> Iterator[None]:
    """Breaks the block into four columns; each column has two neighbours, and is opposite to one column across the edge
    in the middle.
    """
    with planes_that_break(mesh_of(), [0, 2]):
        yield


def case_of() -> schema.Case:
    return meeting_of([{"fracture": schema.Fracture(delay=0.0)}], {"friction": 0.0}, material=SOFT, end=1.0)


def columns(sim: Simulation) -> Ints:
    """Returns (nodes,) the column of each node: 1 for x, plus 2 for z, if the node is beyond the middle. All ranks must
    call the function.
    """
    sim.count_nodes()
    nodes = sim.model.nodes
    found = np.zeros(sim.model.nodes_global)
    for b in sim.model.blocks:
        middle = nodes.x0[b.tets].mean(axis=1)
        found[nodes.id[b.tets]] = ((middle[:, 0] > MIDDLE) + 2 * (middle[:, 2] > MIDDLE))[:, None]
    return sim.comm.maximum(found)[nodes.id].astype(np.int64)


def at_rest(sim: Simulation, axes: Sequence[int] = (0, 2)) -> Simulation:
    """Returns the block just after the planes of the given ``axes`` have broken at a stress of a few Pa: without
    stress, force and motion.
    """
    nodes = sim.model.nodes
    step.prepare(sim)
    whole = sim.model.nodes_global
    planes = np.zeros(whole, np.int64)
    planes[nodes.id] = (nodes.x0[:, list(axes)] == MIDDLE).sum(axis=1)
    planes = sim.comm.maximum(planes.astype(np.float64)).astype(np.int64)
    nodes.v[:] = 1e-6 * np.sign(nodes.x0 - MIDDLE) * np.isin(np.arange(3), axes)
    for _ in range(4):
        step.first_half(sim)
        step.second_half(sim)
    sim.count_nodes()
    assert sim.model.nodes_global == (2**planes).sum()
    nodes.x[:], nodes.v[:], nodes.force[:] = nodes.x0, 0.0, 0
    for b in sim.model.blocks:
        b.state[:, : rows.VISCOUS + 1, :] = 0.0
    return sim


def meeting(sim: Simulation) -> Ints:
    """Returns a scene in which two columns with the common edge collide at this edge at 4 m/s, and the other two
    columns move away.
    """
    which, speed = columns(sim), np.array([[1.0, 0.0, 1.0], [1.2, 0.0, -1.2], [-1.2, 0.0, 1.2], [-1.0, 0.0, -1.0]])
    sim.model.nodes.v[:] = speed[which] * 2.0
    return which


def depth(sim: Simulation, which: Ints) -> float:
    """Returns the penetration of the edge of one column into the opposite column, m, on one rank."""
    nodes = sim.model.nodes
    edge = (nodes.x0[:, [0, 2]] == MIDDLE).all(axis=1)
    low, high = (nodes.x[edge & (which == k)][:, [0, 2]] for k in (0, 3))
    assert len(low) == len(high) == 3
    return float((low - high).min(axis=1).max())


@pytest.mark.usefixtures("columns_come_apart")
@pytest.mark.parametrize("searched", [False, True])
def test_pieces_that_share_an_edge_do_not_pass_there(searched: bool) -> None:
    """The penetration is at most a twentieth of the penetration without contact, which is the error of five sweeps;
    momentum is exact.
    """
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


def test_a_piece_that_passes_behind_a_node_is_free() -> None:
    """Eight octants have a common node. One octant moves past its corner, below the plane of a side of the opposite
    octant but behind all tets of this octant, while the other octants move apart: no contact acts, and no velocity
    changes.
    """
    mesh = mesh_of(4)
    with planes_that_break(mesh, [0, 1, 2]):
        sim = at_rest(build(case_of(), [mesh]), (0, 1, 2))
    nodes = sim.model.nodes
    for b in sim.model.blocks:
        way = np.sign(nodes.x0[b.tets].mean(axis=1) - MIDDLE)
        speed = np.where(way.sum(axis=1)[:, None] == -3.0, 0.0, 3.0 * way)
        speed[way.sum(axis=1) == 3.0] = [-1.0, 0.2, 0.2]
        nodes.v[b.tets] = speed[:, None]
    given = nodes.v.copy()
    for _ in range(10):
        step.first_half(sim)
        step.second_half(sim)
    assert nodes.v == pytest.approx(given, abs=1e-5)


@pytest.mark.usefixtures("columns_come_apart")
def test_contact_at_a_shared_edge_is_equal_on_any_number_of_ranks() -> None:
    """Broad phases occur between the steps; the results are bit-identical."""

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
