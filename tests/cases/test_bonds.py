"""Keys of bonds: valid cases, and one line for each error."""

from typing import Any

import pytest

from conoid.cases.load import CaseError, apply_overrides, parse_case
from conoid.cases.model.joined import wearing

PLATE = {"shape": "plate", "width": "20 mm", "height": "20 mm", "thickness": "5 mm", "element_size": "1 mm"}
FILE = {"shape": "file", "path": "joint.inp", "unit": "1 mm"}


def joint(bond: dict[str, Any], *overrides: str) -> dict[str, Any]:
    """Returns a case of a tile that is bonded to its backing, as plain data."""
    parts = [
        {"name": "tile", "material": "alumina", "mesh": {**PLATE, "base": [0, 0, "5 mm"]}},
        {"name": "backing", "material": "steel", "mesh": PLATE},
    ]
    bond = {"parts": ["tile", "backing"], "kind": "shared", **bond}
    data = {"name": "joint", "run": {"end_time": "1 us"}, "parts": parts, "bond": [bond]}
    return apply_overrides(data, overrides)


def problems_of(bond: dict[str, Any], *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as caught:
        parse_case(joint(bond, *overrides))
    return str(caught.value).splitlines()


def test_a_bond_has_one_strength_and_one_energy_in_both_modes_by_default() -> None:
    made = parse_case(joint({"strength": "30 MPa", "energy": "100 J/m^2"})).bond[0]
    assert (made.strengths, made.energies, made.cohesive) == ((30e6, 30e6), (100.0, 100.0), True)
    made = parse_case(joint({"strength": "30 MPa", "shear_strength": "20 MPa", "kind": "tied"})).bond[0]
    assert (made.strengths, made.energies, made.cohesive) == ((30e6, 20e6), (0.0, 0.0), False)
    assert not parse_case(joint({})).bond[0].breaks


@pytest.mark.parametrize(
    ("bond", "overrides", "line"),
    [
        ({"parts": ["tile", "baking"]}, [], "bond[0].parts[1] = 'baking': no part of this name; did you mean"),
        ({"parts": ["tile", "tile"]}, [], "bond[0].parts = 'tile, tile': a part cannot be bonded to itself; name two"),
        ({}, ['bond=[{parts=["tile", "backing"], kind="tied"}, {parts=["backing", "tile"], kind="shared"}]'],
         "bond[1].parts = 'backing, tile': bond[0] joins the same parts; keep one of the two"),
        ({"kind": "glued"}, [], "bond[0].kind = 'glued': "),
        ({"strength": -1}, [], "bond[0].strength = -1: "),
        ({"strength": "3 J"}, [], "bond[0].strength = '3 J': "),
        ({"energy": "3 J/m^2"}, [], "bond[0].energy = 3.0: a bond without strength never breaks; give strength too"),
        ({"shear_strength": "3 MPa"}, [], "bond[0].shear_strength = 3000000.0: a bond without strength never breaks"),
        ({"strength": 1, "energy": 2, "shear_energy": 0}, [], "bond[0].shear_energy = 0.0: give energy and shear"),
        ({"strength": 1, "shear_energy": 2}, [], "bond[0].energy = 0.0: give energy and shear_energy both"),
        ({"parts": ["tile"]}, [], "bond[0].parts"),
        ({"gluing": 1}, [], "bond[0].gluing: unknown key; known: 'energy'"),
        ({}, ['parts[1].turn={axis="x", angle="1 deg", centre=[0, 0, "5 mm"]}', "contact=none"],
         "bond[0].parts = 'tile, backing': the two parts are turned differently"),
        ({}, ["parts[1].mesh.generator=structured"], "bond[0].parts = 'tile, backing': the two meshes have different"),
        ({}, ["parts[1].mesh={shape=\"file\", path=\"a.inp\", unit=1}"],
         "bond[0].parts = 'tile, backing': a mesh from a file and a generated mesh have no nodes in common"),
        ({}, ["parts[1].mesh={shape='two_tets', element_size=1}"],
         "bond[0].parts = 'tile, backing': 'backing': single tets have no nodes in common with other parts"),
        ({}, ['boundaries=[{kind="gravity", acceleration=[0, 0, -10], parts=["tile"]}]'],
         "boundaries[0].parts = 'tile': these parts and 'backing' are one body with common nodes; name all"),
    ],
)  # fmt: skip
def test_a_slip_is_one_line(bond: dict[str, Any], overrides: list[str], line: str) -> None:
    found = problems_of(bond, *overrides)
    assert len(found) == 1
    assert found[0].startswith(line)


def test_erosion_of_a_body_that_breaks_is_known_from_the_case() -> None:
    wears = "parts[1].erosion={volume=[0.5, 2]}"
    assert not wearing(parse_case(joint({}, wears)))
    assert not wearing(parse_case(joint({"kind": "tied", "strength": "30 MPa"}, wears)))
    assert wearing(parse_case(joint({"strength": "30 MPa"}, wears)))
    assert wearing(parse_case(joint({}, wears, "parts[0].fracture={model='cohesive'}")))


def test_gravity_acts_on_one_of_two_tied_parts() -> None:
    pulled = 'boundaries=[{kind="gravity", acceleration=[0, 0, -10], parts=["tile"]}]'
    assert parse_case(joint({"kind": "tied"}, pulled)).boundaries


def test_groups_of_a_file_can_be_bonded() -> None:
    files = [
        f"parts[{i}].mesh={{shape='file', path='joint.inp', unit='1 mm', group='{name}'}}"
        for i, name in enumerate("ab")
    ]
    assert parse_case(joint({}, *files)).bond[0].kind == "shared"
