"""Keys of rigid parts and of walls: errors in one line, and suggestions to make a part rigid."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from conoid.cases.estimates.estimate import estimate
from conoid.cases.load import CaseError, apply_overrides, parse_case
from conoid.cases.model.bonds import SharedBond
from conoid.cases.shapes.placed import bulk
from conoid.cases.warnings.plausible import oddities
from conoid.cases.warnings.unstrained import Strained, could_be_rigid

BALL = {"shape": "sphere", "centre": [0, 0, "5.1 mm"], "radius": "5 mm", "element_size": "1 mm"}
PAD = {"shape": "box", "low": ["-9 mm", "-9 mm", "-9 mm"], "high": ["9 mm", "9 mm", 0], "element_size": "2 mm"}
WALL = "boundaries=[{kind='wall', point=[0, 0, '-9 mm'], normal=[0, 0, 1]}]"


def scene(*overrides: str) -> dict[str, Any]:
    """Returns a case of a rigid ball above a pad of rubber, as plain data."""
    parts = [
        {"name": "ball", "material": "steel", "mesh": BALL, "rigid": True, "velocity": [0, 0, "-5 m/s"]},
        {"name": "pad", "material": "rubber", "mesh": PAD},
    ]
    rubber = {"density": "1100 kg/m^3", "elastic": {"young": "5 MPa", "poisson": 0.45}}
    data = {"name": "pad", "materials": {"rubber": rubber}, "run": {"end_time": "1 ms"}, "parts": parts}
    return apply_overrides(data, overrides)


def test_a_given_mass_is_the_reported_mass() -> None:
    """The printed momentum and energy are computed with the given mass."""
    case = parse_case(scene("parts[0].rigid={mass='2 kg'}"))
    found = bulk(case.parts[0], case.parts[0].mesh, 7850.0)  # type: ignore[arg-type]
    assert (found.mass, found.momentum, found.energy) == (2.0, (0.0, 0.0, -10.0), 25.0)


def test_a_given_inertia_gives_the_reported_energy() -> None:
    """The kinetic energy of the rigid ball is 1/2 M v^2 + 1/2 w . I w about the given centre, 2 mm away from the axis
    of the spin.
    """
    inertia = "[1e-7, 2e-7, 2.5e-7, 0.2e-7, 0.1e-7, -0.3e-7]"
    spin = "parts[0].spin={centre=[0, 0, 0], rate=[100, 200, 300]}"
    given = f"parts[0].rigid={{mass='4 g', centre=['2 mm', 0, 0], inertia={inertia}}}"
    found = bulk((case := parse_case(scene(given, spin))).parts[0], case.parts[0].mesh, 7850.0)  # type: ignore[arg-type]
    w, tensor = np.array([100.0, 200.0, 300.0]), 1e-7 * np.array([[1, -0.3, 0.1], [-0.3, 2, 0.2], [0.1, 0.2, 2.5]])
    v = np.array([0.0, 0.0, -5.0]) + np.cross(w, [2e-3, 0.0, 0.0])
    assert found.momentum == pytest.approx(4e-3 * v)
    assert found.energy == pytest.approx(0.5 * (4e-3 * v @ v + w @ tensor @ w))


INERTIA = "parts[0].rigid={{mass='4 g', inertia=[{}]}}"


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ("parts[0].erosion={}", "parts[0].erosion: a rigid part has no stress"),
        ("parts[0].stretch={rate=[1, 0, 0]}", "parts[0].stretch: a rigid part has no stress"),
        ("parts[0].jitter=1", "parts[0].jitter = 1.0: a rigid part has no jitter"),
        (
            "contact={self_contact=['ball']}",
            "contact.self_contact = 'ball': 'ball' is rigid and cannot have self-contact",
        ),
        ("parts[0].rigid={centre=[0, 0, 0]}", "parts[0].rigid.centre: needs rigid.inertia"),
        ("parts[0].rigid={mass='1 m'}", "a mass"),
        ("parts[0].rigid={mass=0}", "greater than 0"),
        (INERTIA.format("1, 1, -1, 0, 0, 0"), "must be positive definite"),
        (INERTIA.format("1, 1, 1, 0, 0, 1.1"), "must be positive definite"),
        (INERTIA.format("1, 1, 2.1, 0, 0, 0"), "above the sum of the other two"),
        (
            "boundaries=[{kind='traction', pressure=1}]",
            "acts on the rigid part 'ball', on which tractions are not allowed",
        ),
        ("boundaries=[{kind='velocity', x=0, low=[0, 0, 0], high=[1, 1, 1]}]", "drives a box of the rigid part 'ball'"),
        ("bond=[{kind='shared', parts=['ball', 'pad']}]", "bond[0].kind = 'shared': 'ball' is rigid, and its nodes"),
        ("boundaries=[{kind='wall', point=[0, 0, -1]}]", "boundaries[0].normal: this key is missing; a plane needs"),
        ("boundaries=[{kind='wall', shape='sphere', point=[0, 0, -1], normal=[0, 0, 1], radius=1}]", "has no normal"),
        (
            "boundaries=[{kind='wall', shape='cylinder', point=[0, 0, -1], axis=[0, 0, 0], radius=1}]",
            "must not be zero",
        ),
        ("boundaries=[{kind='wall', shape='cylinder', point=[0, 0, -1], radius=1}]", "boundaries[0].axis: this key is"),
        (WALL.replace("}", ", mass=1, velocity=[0, 0, 1], course=[[0, 1]]}"), "remove course or mass"),
        (WALL.replace("}", ", course=[[0, 1]]}"), "multiplies velocity, which is zero"),
        (WALL.replace("}", ", side='inside'}"), "a plane has no inside"),
    ],
)
def test_a_slip_is_one_line(override: str, line: str) -> None:
    with pytest.raises(CaseError) as caught:
        parse_case(scene(override))
    assert line in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_plate_and_its_turned_tensor_are_bodies() -> None:
    """A moment of inertia may be equal to the sum of the other two, and an inertia tensor may have products of
    inertia.
    """
    for six in ("1, 1, 2, 0, 0, 0", "1.5, 1.5, 1, 0, 0, 0.5"):
        assert parse_case(scene(INERTIA.format(six))).parts[0].rigid is not None
    assert parse_case(scene("parts[0].rigid=false")).parts[0].rigid is None


def test_a_rigid_part_costs_no_tets_and_no_steps_before_a_run() -> None:
    rigid, soft = (estimate(parse_case(scene(*how))) for how in ((), ("parts[0].rigid=false",)))
    assert rigid.dt is not None
    assert soft.dt is not None
    assert rigid.dt > 10.0 * soft.dt
    assert rigid.costs["tets"] < soft.costs["tets"]


def test_a_stiff_part_could_be_rigid() -> None:
    """Steel on rubber gives the suggestion to make the steel rigid; steel on steel and rigid parts give no
    suggestion.
    """

    def warned(*overrides: str) -> list[str]:
        case = parse_case(scene(*overrides))
        return [str(each) for each in oddities(case, estimate(case)) if "rigid = true" in str(each)]

    (line,) = warned("parts[0].rigid=false")
    assert line.startswith("parts[0].rigid: the impedance of 'ball' is 318 times that of every other part")
    assert warned() == []
    assert warned("parts[0].rigid=false", "parts[1].material=steel") == []


def test_a_part_that_stayed_elastic_could_have_been_rigid() -> None:
    """The suggestion after the run is not made for a part that has yielded, has a large strain or energy, or has common
    nodes with another part.
    """
    case = parse_case(scene("parts[0].rigid=false"))
    ball, block = Strained(600, 2e-4, 0.01, False), Strained(400, 0.05, 0.99, False)
    (line,) = could_be_rigid(case, [ball, block], "stability: tet 7 of ball")
    assert line == (
        "parts[0].rigid: 'ball' stayed elastic, with strains of 0.0002 or less (root of the mean square) and 1 % of "
        "the energy of deformation; rigid = true would save 60 % of the tets, which limit the time step"
    )
    for other in (replace(ball, plastic=True), replace(ball, strain=2e-3), replace(ball, share=0.1)):
        assert not list(could_be_rigid(case, [other, block], ""))
    assert not list(could_be_rigid(parse_case(scene()), [ball, block], ""))
    bonded = case.model_copy(update={"bond": (SharedBond(parts=("ball", case.parts[1].name), kind="shared"),)})
    assert not list(could_be_rigid(bonded, [ball, block], ""))
