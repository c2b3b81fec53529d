"""Penetration: the length of lines inside of the remaining tets, and the depth of the hole that begins at the mouth."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.model import schema
from conoid.worker import simulation
from conoid.worker.gauges import reference
from conoid.worker.gauges.penetration import LINES, MEASURED, bottoms, depth, spans, thickness
from conoid.worker.mesh.model import TetMesh
from conoid.worker.scene import assembly
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from ..contact.ranks import on_ranks
from .meshes import Floats, block

MM = 1e-3


def length(mesh: TetMesh, axis: int, at: tuple[float, float]) -> float:
    """Returns the length of a line inside of a mesh, m."""
    _, span = spans(mesh.points, mesh.tets.astype(np.uint32), axis, at)
    assert (span[:, 1] > span[:, 0]).all()
    return float((span[:, 1] - span[:, 0]).sum())


LONG = np.array([3.0, 4.0, 5.0]) * MM


@pytest.mark.parametrize("axis", range(3))
def test_a_line_through_a_box_is_as_long_as_the_box(axis: int) -> None:
    mesh = block((3, 4, 5), MM)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for share in np.random.default_rng(axis).uniform(0.0, 1.0, (50, 2)):
        at = (float(share[0] * LONG[i]), float(share[1] * LONG[j]))
        assert length(mesh, axis, at) == pytest.approx(LONG[axis], rel=1e-12)
    for at in ((-1e-6, 1e-3), (1e-3, LONG[j] + 1e-6), (LONG[i] + 1e-6, 1e-3)):
        assert length(mesh, axis, at) == 0.0


@pytest.mark.parametrize("shares", [(0.1, 0.1), (0.3, 0.3), (1.0 / 3.0, 0.5), (2.0 / 3.0, 0.5)])
def test_a_line_in_the_faces_or_edges_of_tets_is_counted_once(shares: tuple[float, float]) -> None:
    """The diagonals of the cubes of a structured mesh lie in the plane of the lines of a penetration probe."""
    mesh = block((3, 3, 5), MM, shake=0.0)
    assert length(mesh, 2, (3 * MM * shares[0], 3 * MM * shares[1])) == pytest.approx(5 * MM, rel=1e-9)


# Depth of the hole

PLATES = ((0.0, 22.0), (22.0, 44.0), (44.0, 66.0))
"""Three plates on each other: start and end of each plate, mm."""
RADIUS = 3.5


def rows_of(left: dict[int, list[tuple[int, float, float]]]) -> Floats:
    """Returns an artificial state: for some lines the remaining pieces of the plates (plate, from, to); the other lines
    have the pieces of the last line."""
    table, last = [], left[0]
    for line in range(len(LINES)):
        last = left.get(line, last)
        table += [(line, plate, low, high) for plate, low, high in last]
    return np.array(table, float).reshape(-1, 4)


WHOLE = rows_of({0: [(k, low, high) for k, (low, high) in enumerate(PLATES)]})
THICK = thickness(WHOLE, len(PLATES))


def depth_of(left: dict[int, list[tuple[int, float, float]]]) -> float:
    return depth(rows_of(left), THICK, RADIUS)


def test_whole_plates_have_no_hole_and_no_plates_are_pierced() -> None:
    assert depth(WHOLE, THICK, RADIUS) == 0.0
    assert depth(np.zeros((0, 4)), THICK, RADIUS) == 66.0


def test_a_cavity_ahead_of_the_hole_does_not_count() -> None:
    """A hole of 53.9 mm and a cavity of 11 mm behind 2 mm of plate do not add up to a depth of 64.9 mm."""
    assert depth_of({0: [(2, 53.9, 55.0), (2, 65.0, 66.0)]}) == pytest.approx(53.9)


def test_a_cavity_that_the_hole_has_joined_beside_the_line_counts() -> None:
    """On the second line no material is left between hole and cavity."""
    joined = {0: [(2, 53.9, 55.0), (2, 65.0, 66.0)], 1: [(2, 65.0, 66.0)], 2: [(2, 53.9, 55.0), (2, 65.0, 66.0)]}
    assert depth_of(joined) == pytest.approx(65.0)


def test_a_flake_in_the_hole_does_not_end_it() -> None:
    flake = {0: [(0, 5.0, 6.0), (2, 50.0, 66.0)], 2: [(2, 50.0, 66.0)]}
    assert depth_of(flake) == pytest.approx(50.0)


def test_plates_that_part_ahead_of_the_hole_are_whole() -> None:
    """In this test the second plate has moved by 3 mm; the third plate has moved by 5 mm and has a cavity of 4 mm."""
    assert depth_of({0: [(0, 10.0, 22.0), (1, 25.0, 47.0), (2, 49.0, 60.0), (2, 64.0, 71.0)]}) == pytest.approx(10.0)


def test_a_plate_that_is_pushed_along_is_not_pierced_by_that() -> None:
    assert depth_of({0: [(k, low + 9.0, high + 9.0) for k, (low, high) in enumerate(PLATES)]}) == 0.0


def test_a_hole_through_the_last_plate_beside_the_line_is_not_one_on_it() -> None:
    """The free space behind the plates does not connect the hole and the cavity."""
    assert depth_of({0: [(2, 60.0, 66.0)], 6: []}) == pytest.approx(60.0)
    assert np.isinf(bottoms(rows_of({0: [(2, 60.0, 66.0)], 6: []}), 1e-6)[6:]).all()


def test_the_depth_is_the_mean_of_three_lines() -> None:
    """The hole ends at 2, 6 and 13 mm on three lines, and at 30 mm on the other lines."""
    ends = dict(zip(MEASURED, (2.0, 6.0, 13.0), strict=True))
    left = {line: [(0, ends[line], 22.0)] if line in ends else [(1, 30.0, 44.0)] for line in range(len(LINES))}
    solid = {line: [*some, (1, 22.0, 44.0), (2, 44.0, 66.0)] if line in ends else [*some, (2, 44.0, 66.0)]
             for line, some in left.items()}  # fmt: skip
    assert depth_of(solid) == pytest.approx(7.0)


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_state_without_the_tets_of_a_cavity_and_of_a_hole(way: float, ranks: int) -> None:
    """In this test two plates of 4 mm are hit from below or from above. The plates have a hole of 2 mm and, 1 mm
    deeper, a narrow cavity: 2 mm at the rear of the first plate and 2 mm at the front of the second plate. Tets are
    removed if their centres lie in the hole or in the cavity; layers of the mesh are 1 mm thick.
    """
    plate = block((8, 8, 4), MM, shake=0.0)
    meshes = [block((4, 4, 2), MM, shake=0.0), plate, moved(plate, (0.0, 0.0, 4 * MM))]
    meshes[0] = moved(meshes[0], (0.0, 0.0, -3 * MM if way > 0.0 else 9 * MM))
    spec = schema.Reference(quantity="penetration", part="body0", axis="z", value=0.0, tolerance=1.0, source="made up")
    case = meeting_of([{}, {}, {}], end=1.0, reference=(spec,))

    def measured(sim: Simulation) -> tuple[float, float]:
        thick = reference.thicknesses(sim)
        before = reference._measured(sim, spec, Path(), thick[0])
        for b in sim.model.blocks:
            x, y, height = sim.model.nodes.x0[b.tets].mean(axis=1).T / MM
            into, near = height if way > 0.0 else 8.0 - height, np.maximum(x, y) < 2.0
            gone = (b.part > 0) & ((into < 2.0) | (near & (into > 3.0) & (into < 5.0)))
            b.tets[gone] = b.tets[gone, :1]
        return before, reference._measured(sim, spec, Path(), thick[0])

    ready = iter(meshes)
    with patch.object(assembly, "build_mesh", lambda *_, **__: next(ready)):
        found = on_ranks(ranks, lambda comm: measured(simulation.build(case, Path(), comm)))
    for before, after in found:
        assert before == 0.0
        assert after == pytest.approx(2.0 * MM, rel=1e-9)
