"""Ridges that collide: bodies do not penetrate each other where two edges cross, at any angle. The edges are sharp at
the start, or become sharp by plastic flow.
"""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data
from conoid.worker import simulation, step
from conoid.worker.accounts.digest import digest
from conoid.worker.contact.scene.passes import ScenePasses
from conoid.worker.contact.surface.sharp import SHARP
from conoid.worker.mesh.model import TetMesh
from conoid.worker.parallel.comm import Comm
from conoid.worker.parallel.team import team

from ..worker.kernels import HARD, build, run
from ..worker.meshes import Floats, positive
from ..worker.simulations import kept_again
from .bodies import meeting_of, rotation
from .ranks import on_ranks

SIZE = 1e-3
ROOF = SIZE * np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, -0.6], [0.0, -0.5, -0.6]])
"""A tet with an edge along x on its top; the faces at this edge have a slope of 50 degrees."""
TET = np.array([[0, 1, 2, 3]])


def tet(points: Floats) -> TetMesh:
    return TetMesh(points, positive(points, TET))


def deep(x: Floats, y: Floats) -> float:
    """Returns the overlap of two tets (4, 3) along the direction in which it is smallest, m; negative if the tets are
    apart.
    """
    sides = [np.array([p[j] - p[i] for i in range(4) for j in range(i + 1, 4)]) for p in (x, y)]
    axes = [np.cross(p[[1, 0, 0, 0]] - p[[2, 3, 1, 2]], p[[3, 2, 3, 1]] - p[[2, 3, 1, 2]]) for p in (x, y)]
    every = np.concatenate([*axes, np.cross(sides[0][:, None], sides[1][None]).reshape(-1, 3)])
    length = np.linalg.norm(every, axis=1)
    every = every[length > 1e-9 * length.max()]
    one, two = x @ every.T, y @ every.T
    overlap = np.minimum(one.max(axis=0) - two.min(axis=0), two.max(axis=0) - one.min(axis=0))
    return float((overlap / np.linalg.norm(every, axis=1)).min())


@pytest.mark.parametrize("angle", [0.5, 3.0, 30.0])
def test_tets_that_come_ridge_on_ridge_do_not_pass_into_each_other(angle: float) -> None:
    """Angles between the ridges, degrees. In an earlier version ridges at 2.9 degrees and less had only contacts of
    nodes and faces, which do not prevent the penetration.
    """
    over = ROOF @ rotation((1, 0, 0), np.pi).T @ rotation((0, 0, 1), np.radians(angle)).T + [0.0, 0.0, 0.01 * SIZE]
    motions = [{"velocity": (0.0, 0.0, 30.0)}, {"velocity": (0.0, 0.0, -30.0)}]
    sim = build(meeting_of(motions, end=4e-6), [tet(ROOF), tet(over)])
    most = [0.0]
    run(sim, lambda sim, _: most.append(deep(sim.model.nodes.x[:4], sim.model.nodes.x[4:])))
    assert sim.contact is not None
    assert sim.contact.last_push > 0.0
    assert max(most) < 0.005 * SIZE


FLAT = SIZE * np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, -1.2]])
"""Two adjacent tets with a flat top; the middle of the top is an edge along x."""
PAIR = np.array([[0, 1, 2, 4], [1, 0, 3, 4]])


def folded(angle: float) -> Floats:
    """Returns ``FLAT`` with its top folded about the middle edge until the normals of the two halves differ by
    ``angle``, degrees.
    """
    points, half = FLAT.copy(), np.radians(0.5 * angle)
    points[2:4] = points[2:4] * np.cos(half) - [0.0, 0.0, 0.5 * SIZE * np.sin(half)]
    return points


def test_tets_that_flow_has_folded_do_not_pass_into_each_other() -> None:
    """The tops are flat at the start and are folded by 80 degrees later. In an earlier version the middle edges, whose
    nodes are far away, had no contact.
    """
    half_turn = rotation((1, 0, 0), np.pi).T @ rotation((0, 0, 1), 0.5 * np.pi).T
    gap = [0.0, 0.0, 0.01 * SIZE]
    motions = [{"velocity": (0.0, 0.0, 30.0)}, {"velocity": (0.0, 0.0, -30.0)}]
    meshes = [TetMesh(points, positive(points, PAIR)) for points in (FLAT, FLAT @ half_turn + gap)]
    sim = build(meeting_of(motions, material=HARD, end=4e-6), meshes)
    assert sim.contact is not None
    assert not (np.isin(sim.contact.exterior.surface.edges.nodes[:, :2], [0, 1]).all(axis=1)
                & sim.contact.exterior.surface.edges.sharp).any()  # fmt: skip
    x = sim.model.nodes.x
    x[:5], x[5:] = folded(80.0), folded(80.0) @ half_turn + gap
    most = [0.0]
    run(sim, lambda sim, _: most.extend(deep(x[a], x[5 + b]) for a, b in product(PAIR, PAIR)))
    assert sim.contact.last_push > 0.0
    assert max(most) < 0.005 * SIZE


@pytest.mark.parametrize(("angle", "found"), [(20.0, False), (30.0, True), (-30.0, False)])
def test_an_edge_becomes_sharp_when_it_bulges_by_more_than_25_degrees(angle: float, found: bool) -> None:
    corners, one, meets = np.array([[0, 1, 2, 3]], np.int32), np.zeros(1, bool), np.ones(1, bool)
    part, least = np.ones(5, np.int32), np.array([-1.0, SHARP])
    turned = ScenePasses(team(1)).turned
    assert turned(one, corners, meets, folded(angle), part, least).tolist() == [found]
    assert not turned(~one, corners, meets, folded(angle), part, least).any()
    assert not turned(one, corners, ~meets, folded(angle), part, least).any()
    assert not turned(one, corners, meets, folded(angle), part - 1, least).any()


STOPS = (150, 300)
COLLIDING = Path(__file__).parents[1] / "parallel" / "colliding.toml"


def flown(comm: Comm, folder: Path, stops: tuple[int, ...]) -> tuple[str | None, int]:
    """Returns the digest of the scene, and the number of edges that became sharp by flow. The run is stored and
    restored at the steps ``stops``.
    """
    case = parse_case(apply_overrides(read_data(COLLIDING), ["run.frames=0", "balance.weights=tets"]))
    sim = simulation.build(case, Path(), comm)
    step.prepare(sim)
    while sim.clock.step < STOPS[-1] + 20:
        step.first_half(sim)
        step.second_half(sim)
        if sim.clock.step in stops:
            sim = kept_again(sim, case, folder)
    assert sim.contact is not None
    many = int(comm.sum(np.array([len(sim.contact.exterior.surface.turned)]))[0])
    found = digest(sim.model, comm, []), many
    sim.free()
    return found


def test_edges_made_by_flow_are_the_same_on_any_number_of_ranks_and_after_a_checkpoint(tmp_path: Path) -> None:
    one = on_ranks(1, lambda comm: flown(comm, tmp_path / "never", ()))[0]
    assert one[1] > 20
    assert on_ranks(1, lambda comm: flown(comm, tmp_path / "alone", STOPS))[0] == one
    assert on_ranks(3, lambda comm: flown(comm, tmp_path / "three", STOPS))[0] == one
