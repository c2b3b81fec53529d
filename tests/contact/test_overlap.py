"""Bodies that overlap at the start are refused with position and depth, or are moved apart without stress."""

from typing import Any

import numpy as np
import pytest

from conoid.worker.errors import InputError
from conoid.worker.mesh.model import TetMesh
from conoid.worker.simulation import Simulation

from ..worker.kernels import build, run
from ..worker.meshes import block
from .bodies import meeting_of, moved

SIZE = 1e-3
SLOPE = float(np.tan(np.radians(20.0)))


def lowered(depth: float, across: float = 0.0) -> list[TetMesh]:
    """Returns a block four cubes high, and a block on top that penetrates the first block by ``depth``, m."""
    upper = block((2, 2, 2), SIZE, seed=3)
    return [
        block((4, 4, 4), SIZE, seed=2),
        TetMesh(upper.points + np.array([across, across, 4 * SIZE - depth]), upper.tets),
    ]


def met(depth: float, across: float = 0.0, **contact: Any) -> Simulation:
    case = meeting_of([{}, {"velocity": (0.0, 0.0, -1.0)}], contact, end=2e-7)
    return build(case, lowered(depth, across))


@pytest.mark.parametrize("across", [0.0, 1.3 * SIZE])
def test_an_overlap_is_refused_with_its_place_and_depth(across: float) -> None:
    with pytest.raises(InputError, match=r"'body[01]' overlaps 'body[01]' by 0\.0002 m at \(.*\) m; move them apart"):
        met(0.2 * SIZE, across)


def test_bodies_that_touch_do_not_overlap() -> None:
    met(0.0)
    met(1e-9 * SIZE)


def test_bodies_that_cross_each_other_are_refused() -> None:
    """The scene has two crossed bars that penetrate each other; no node of a bar is inside of the other bar."""
    one = block((8, 1, 1), SIZE, 0.0)
    turned = TetMesh(one.points[:, [2, 0, 1]] * [0.8, 1.0, 1.4], one.tets)
    other = moved(turned, [3.1 * SIZE, -3.5 * SIZE, -0.2 * SIZE])
    with pytest.raises(InputError, match=r"'body[01]' overlaps 'body[01]' at \(.*\) m, deeper than"):
        build(meeting_of([{}, {}]), [one, other])
    build(meeting_of([{}, {}]), [one, moved(other, [0.0, 0.0, 1.3 * SIZE])])


def test_parts_without_contact_may_overlap() -> None:
    met(0.2 * SIZE, parts=("body0",))


@pytest.mark.parametrize("across", [0.0, 1.3 * SIZE])
def test_bodies_are_moved_apart_without_a_stress(across: float) -> None:
    sim = met(0.1 * SIZE, across, overlap="push")
    before = np.concatenate([mesh.points for mesh in lowered(0.1 * SIZE, across)])
    assert 0.04 * SIZE < np.abs(sim.model.nodes.x - before).max() < 0.1 * SIZE
    run(sim)
    assert abs(sim.ledger.lost) < 0.3
    assert np.abs(sim.model.nodes.v).max() < 1.5


def test_bodies_are_moved_apart_by_no_more_than_they_overlap() -> None:
    """A ridge of the dent is nearest to a corner node of the smaller block, but the foot of the node lies on the far
    side.
    """
    wide, small = block((4, 4, 2), SIZE, shake=0.0), block((4, 4, 3), 0.8 * SIZE, shake=0.0)
    low = np.array([-2 * SIZE, -2 * SIZE, 0.0])
    bodies = [
        TetMesh(wide.points + low, wide.tets),
        TetMesh(small.points + np.array([-1.5 * SIZE, -1.5 * SIZE, 0.01 * SIZE - 2.4 * SIZE]), small.tets),
    ]
    sim = build(meeting_of([{}, {}], {"overlap": "push"}, end=2e-7), bodies)
    before = np.concatenate([mesh.points for mesh in bodies])
    assert np.abs(sim.model.nodes.x - before).max() <= 0.01001 * SIZE


def pushed(*bodies: TetMesh) -> Simulation:
    return build(meeting_of([{} for _ in bodies], {"overlap": "push"}, end=2e-7), bodies)


TOO_DEEP = r"^parts: 'body[01]' overlaps 'body[01]' at \(.*\) m, deeper than contact\.overlap = 'push' can undo; move "
WIDE = block((4, 4, 4), SIZE, shake=0.0)


def test_bodies_that_are_one_cannot_be_pushed_apart() -> None:
    """No node is inside of the other body: each node lies on a face of the other body."""
    with pytest.raises(InputError, match=TOO_DEEP):
        pushed(WIDE, WIDE)


@pytest.mark.parametrize("cells", [(1, 1, 1), (2, 2, 2)])
def test_a_body_inside_another_cannot_be_pushed_out(cells: tuple[int, int, int]) -> None:
    inner = block(cells, SIZE, shake=0.0)
    with pytest.raises(InputError, match=TOO_DEEP):
        pushed(WIDE, TetMesh(inner.points + 0.9 * SIZE, inner.tets))


@pytest.mark.parametrize("across", [0.0, 0.3 * SIZE])
@pytest.mark.parametrize("depth", [1.0, 2.0, 2.5])
def test_bodies_that_overlap_by_elements_cannot_be_pushed_apart(depth: float, across: float) -> None:
    with pytest.raises(InputError, match=TOO_DEEP):
        pushed(WIDE, TetMesh(WIDE.points + np.array([across, across, (4.0 - depth) * SIZE]), WIDE.tets))


@pytest.mark.parametrize("cells", [1, 4])
@pytest.mark.parametrize("depth", [0.01, 0.5])
def test_the_rims_of_bodies_with_sides_in_one_plane_are_pushed_apart_too(cells: int, depth: float) -> None:
    """The nodes lie on faces of the sides of the other body, but penetrate the other body."""
    body = block((cells, cells, 4), SIZE, shake=0.0)
    sim = pushed(body, TetMesh(body.points + np.array([0.0, 0.0, (4.0 - depth) * SIZE]), body.tets))
    lower, upper = np.split(sim.model.nodes.x[:, 2], 2)
    assert lower.max() < upper.min() < lower.max() + 0.1 * depth * SIZE


def test_bodies_that_coincide_and_are_not_pushed_are_refused_by_the_worker() -> None:
    with pytest.raises(InputError, match=r"^parts: 'body0' overlaps 'body1' by"):
        build(meeting_of([{}, {}], {"overlap": "refuse"}, end=2e-7), [WIDE, WIDE])


def test_the_common_plane_of_flush_bodies_is_no_overlap() -> None:
    for off in ((4 * SIZE, 0.0, 0.0), (2 * SIZE, 0.0, 4 * SIZE), (4 * SIZE, 4 * SIZE, 0.0)):
        pushed(WIDE, TetMesh(WIDE.points + np.array(off), WIDE.tets))


def wedge(cells: int) -> TetMesh:
    """Returns a wedge 4 mm high and 3 mm thick with an angle of 40 degrees. The tip of the wedge is cut off 0.2 mm from
    the line at which its sides would intersect, at the origin.
    """
    mesh = block((1, 1, cells), 1.0, shake=0.0)
    across, along, up = (mesh.points / (1, 1, cells)).T
    z = 0.2 + 4.0 * up
    return TetMesh(1e-3 * np.column_stack([(2.0 * across - 1.0) * SLOPE * z, 3.0 * along - 1.5, z]), mesh.tets)


def beside_wedge(cells: int, moved: float = 0.0) -> TetMesh:
    """Returns a block 3.3 mm thick that touches the whole left side of the wedge and is moved to the right by
    ``moved``, m.
    """
    mesh = block((1, 1, cells), 1.0, shake=0.0)
    across, along, up = (mesh.points / (1, 1, cells)).T
    z = 0.2 + 4.0 * up
    points = 1e-3 * np.column_stack([-4.0 + (4.0 - SLOPE * z) * across, 3.3 * along - 1.65, z])
    return TetMesh(points + np.array([moved, 0.0, 0.0]), mesh.tets)


@pytest.mark.parametrize("cells", [(6, 5), (1, 2), (5, 6), (7, 5), (3, 7), (11, 9)])
def test_a_corner_on_the_rim_of_two_slanted_sides_touches(cells: tuple[int, int]) -> None:
    """The mean of the normals of the corner may be compatible with neither side of the wedge. An earlier version
    reported a depth of 3.15 mm, from the far side of the wedge.
    """
    case = meeting_of([{}, {"velocity": (0.0, 0.0, 0.0)}], {}, end=1e-7)
    build(case, [wedge(cells[0]), beside_wedge(cells[1])])
    with pytest.raises(InputError, match=r"overlaps .* by 4\.7e-05 m"):
        build(case, [wedge(cells[0]), beside_wedge(cells[1], 5e-5)])
