"""Velocity components that a boundary holds: contact, erosion and the start of a run read the held components from the
boundary, for any type of boundary.
"""

import ast
from pathlib import Path

import numpy as np
import pytest

import conoid.worker
from conoid.cases.model.schema import Rotation, Spin
from conoid.worker.boundaries.boundaries import FREE, MIRRORED, PRESCRIBED, Boundary, SymmetryPlane
from conoid.worker.boundaries.course import Course
from conoid.worker.boundaries.drivers import Driver, Gravity, PrescribedRotation, PrescribedVelocity
from conoid.worker.boundaries.mirrors import Mirrors
from conoid.worker.boundaries.moving_axis import MovingAxis
from conoid.worker.boundaries.walls import RigidWalls
from conoid.worker.contact.exterior import mobilities, symmetry_planes
from conoid.worker.model.state import Bits, Floats, Nodes

HOUSE = Path(str(conoid.worker.__file__)).parent
SOME = np.array([1, 3], np.int32)
POINT, NORMAL = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])


def nodes(n: int) -> Nodes:
    x: Floats = np.zeros((n, 3))
    part = np.zeros(n, np.int32)
    owned, force = np.ones(n, bool), np.zeros((n, 3), np.int64)
    return Nodes(np.arange(n), part, part, owned, x, x.copy(), x.copy(), np.full(n, 2.0), force, np.zeros(n))


class Piston(Driver):
    """A boundary that exists only in this test; it sets the velocity along y."""

    def held_components(self) -> Bits:
        held = np.full((len(self.nodes), 3), FREE, np.uint8)
        held[:, 1] = PRESCRIBED
        return held

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        state.v[self.nodes, 1] = 1.0


def test_a_boundary_that_does_not_answer_cannot_be_made() -> None:
    class Silent(Driver):
        def apply(self, state: Nodes, dt: float, t: float) -> None:
            pass

    with pytest.raises(TypeError, match="held_components"):
        Silent(SOME)  # type: ignore[abstract]


AXIS = MovingAxis(Rotation(kind="rotation", spin=Spin(centre=(0.0, 0.0, 0.0), rate=(1.0, 1.0, 1.0))))


@pytest.mark.parametrize(
    ("bound", "held"),
    [
        (Gravity(SOME, np.ones(3), Course()), (FREE, FREE, FREE)),
        (RigidWalls(SOME, POINT, NORMAL, np.ones((2, 1), bool)), (FREE, FREE, FREE)),
        (Mirrors(SOME, np.array([1]), np.zeros(1), np.ones((2, 1))), (FREE, FREE, FREE)),
        (SymmetryPlane(SOME, 2), (FREE, FREE, MIRRORED)),
        (PrescribedVelocity(SOME, np.array([np.nan, 0.0, 3.0]), Course()), (FREE, PRESCRIBED, PRESCRIBED)),
        (PrescribedRotation(SOME, AXIS), (PRESCRIBED, PRESCRIBED, PRESCRIBED)),
        (Piston(SOME), (FREE, PRESCRIBED, FREE)),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Boundary) else "",
)
def test_held_nodes_have_no_mobility_in_contact(bound: Boundary, held: tuple[int, int, int]) -> None:
    assert bound.held_components().tolist() == [list(held)] * 2
    mobility, planes = mobilities(nodes(5), [bound]), symmetry_planes(5, [bound])
    expected = np.full((5, 3), 0.5)
    expected[np.ix_(SOME, np.flatnonzero(np.array(held) != FREE))] = 0.0
    assert np.array_equal(mobility, expected)
    assert np.flatnonzero(planes.any(axis=1)).tolist() == (SOME.tolist() if MIRRORED in held else [])


def test_boundaries_hold_together() -> None:
    bounds = [SymmetryPlane(SOME, 0), Piston(np.array([3], np.int32))]
    mobility, planes = mobilities(nodes(5), bounds), symmetry_planes(5, bounds)
    assert mobility[[1, 3]].tolist() == [[0.0, 0.5, 0.5], [0.0, 0.0, 0.5]]
    assert planes[3].tolist() == [True]


@pytest.mark.parametrize(
    "name", ["simulation.py", "scene/domain.py", "erosion.py", "boundaries/mirrors.py", "step.py", "contact"]
)
def test_no_code_tests_the_type_of_a_boundary(name: str) -> None:
    place = HOUSE / name
    for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
        asked = [
            n.lineno for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Name) and n.id == "isinstance"
        ]
        assert not asked, f"{path.name}: {asked}"
