"""Generated bodies that touch without a gap: the approximate common area, and a warning if no force acts between the
bodies.
"""

import math
from typing import Any

import pytest

from conoid.cases.load import parse_case, read_case, shipped
from conoid.cases.warnings.touching import apart, touching

PLATE = {"shape": "plate", "width": "20 mm", "height": "20 mm", "thickness": "5 mm", "element_size": "1 mm"}
ROD = {"shape": "cylinder", "radius": "3 mm", "length": "8 mm", "element_size": "1 mm"}
TUBE = {"shape": "tube", "inner_radius": "3 mm", "radius": "5 mm", "length": "8 mm", "element_size": "1 mm"}


def case(*meshes: dict[str, Any], contact: object = "none") -> Any:
    parts = [{"name": f"part{i}", "material": "steel", "mesh": mesh} for i, mesh in enumerate(meshes)]
    return parse_case({"name": "touch", "contact": contact, "run": {"end_time": "1 us"}, "parts": parts})


def above(mesh: dict[str, Any], mm: float) -> dict[str, Any]:
    return {**mesh, "base": [0, 0, f"{mm} mm"]}


@pytest.mark.parametrize(
    ("one", "other", "mm2"),
    [
        (PLATE, above(PLATE, 5.0), 400.0),
        (PLATE, above(ROD, 5.0), 9.0 * math.pi),
        (above(ROD, 5.0), PLATE, 9.0 * math.pi),
        (ROD, TUBE, 48.0 * math.pi),
        (PLATE, above(PLATE, 5.001), 0.0),
        (PLATE, {**above(PLATE, 5.0), "base": ["20 mm", 0, "5 mm"]}, 0.0),
    ],
)
def test_the_area_of_two_bodies_that_touch(one: dict[str, Any], other: dict[str, Any], mm2: float) -> None:
    found = touching(case(one, other))
    assert [1e6 * each.area for each in found] == ([pytest.approx(mm2, rel=0.03)] if mm2 else [])


def test_touching_parts_without_contact_or_bond_get_a_warning() -> None:
    pair = PLATE, above(PLATE, 5.0)
    for contact, doubtful in (("none", True), ({}, False), ({"parts": ["part0"]}, True)):
        made = case(*pair, contact=contact)
        warned = [each.message for each in apart(made, touching(made))]
        assert (
            warned
            == [
                "'part0' and 'part1' touch over about 400 mm^2 without contact or bond: they can pass through each "
                "other; a [[bond]] joins parts"
            ]
            * doubtful
        )


@pytest.mark.parametrize("kind", ["shared", "tied"])
def test_bonded_parts_get_no_warning(kind: str) -> None:
    made = case(PLATE, above(PLATE, 5.0))
    bond = {"parts": ["part1", "part0"], "kind": kind}
    joined = parse_case({**made.model_dump(mode="json"), "bond": [bond], "contact": "none"})
    assert touching(joined) == []


@pytest.mark.parametrize("name", sorted(shipped()))
def test_no_shipped_case_has_parts_that_touch_and_do_not_meet(name: str) -> None:
    made = read_case(shipped()[name])
    assert list(apart(made, touching(made))) == []
