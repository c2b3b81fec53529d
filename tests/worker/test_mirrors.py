"""A body that moves towards a symmetry plane collides with its mirror image."""

import numpy as np
import pytest

from conoid.worker import step
from conoid.worker.boundaries.mirrors import Mirrors
from conoid.worker.mesh.model import TetMesh
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import COPPER, STEEL, build
from .meshes import block
from .simulations import tick

MM = 1e-3
PLANE = {"kind": "symmetry", "axis": "y"}
SPEED, GAP = 100.0, 0.02 * MM


def above() -> TetMesh:
    """Returns a cube of 2 mm above the plane y = 0, which the cube does not touch."""
    return moved(block((4, 4, 4), 0.5 * MM, shake=0.1), (0.0, GAP, 0.0))


def image(mesh: TetMesh) -> TetMesh:
    """Returns the mirror image of the mesh below the plane."""
    return TetMesh(mesh.points * [1.0, -1.0, 1.0], np.ascontiguousarray(mesh.tets[:, [0, 2, 1, 3]]))


def mean(sim: Simulation, part: int) -> float:
    """Returns the velocity of a part normal to the plane, m/s."""
    nodes = sim.model.nodes
    mine = nodes.part == part
    return float((nodes.mass[mine] @ nodes.v[mine, 1]) / nodes.mass[mine].sum())


@pytest.mark.parametrize(("back", "apart"), [(0.0, 1e-6), (0.6, 0.01)])
def test_half_a_collision_is_half_of_the_whole(back: float, apart: float) -> None:
    """Contact stops opposite nodes of equal masses in the middle, which is the plane of symmetry. With restitution
    nodes rebound several times; the rebounds of the half model are at other times, so that the results differ by 0.6 %
    for any number of sweeps.
    """
    contact = {"restitution": back}
    down, up = {"velocity": (0.0, -SPEED, 0.0)}, {"velocity": (0.0, SPEED, 0.0)}
    whole = build(meeting_of([down, up], contact, material=COPPER, end=1.0), [above(), image(above())])
    aside = moved(block((4, 4, 4), 0.5 * MM, shake=0.0), (0.0, 0.0, 9 * MM))
    half = build(meeting_of([down, {}], contact, material=COPPER, end=1.0, boundaries=(PLANE,)), [above(), aside])
    for sim in (whole, half):
        step.prepare(sim)
        while sim.clock.t < 2.5e-6:
            assert tick(sim) < 1e-4
    assert abs(mean(half, 0)) < 0.2 * SPEED
    assert mean(half, 0) == pytest.approx(mean(whole, 0), rel=apart)
    assert (half.model.nodes.x[:, 1] > -1e-15).all()
    lost = sum(bound.contact_loss.sum() for bound in half.boundaries if isinstance(bound, Mirrors))
    assert 2.0 * lost == pytest.approx(whole.ledger.close(whole.model.nodes.v).contact, rel=apart)


def test_nodes_on_the_plane_stay_there_and_driven_ones_are_let_through() -> None:
    """The scene has a body with nodes on the plane and on both sides of the plane, and a driven body that passes
    through the plane."""
    both = moved(block((2, 2, 2), MM, shake=0.0), (0.0, -1.0 * MM, 0.0))
    drive = {"kind": "velocity", "parts": ["body1"], "y": -SPEED}
    case = meeting_of([{}, {}], material=STEEL, end=1.0, boundaries=(PLANE, drive))
    sim = build(case, [both, moved(block((2, 2, 2), MM), (9 * MM, 0.1 * MM, 0.0))])
    (mirrors,) = (bound for bound in sim.boundaries if isinstance(bound, Mirrors))
    heights = sim.model.nodes.x0[mirrors.nodes, 1]
    assert len(heights) == 18
    assert sorted(set(heights.round(6))) == [-1.0 * MM, 1.0 * MM]
    nodes = sim.model.nodes
    on, moved_ones = np.flatnonzero(nodes.x0[:, 1] == 0.0), nodes.part == 1
    step.prepare(sim)
    while sim.clock.t < 4e-6:
        tick(sim)
    assert len(on) == 9
    assert (nodes.x[on, 1] == 0.0).all()
    assert nodes.x[moved_ones, 1].min() < -0.2 * MM
    assert nodes.v[moved_ones, 1] == pytest.approx(-SPEED, rel=1e-12)
