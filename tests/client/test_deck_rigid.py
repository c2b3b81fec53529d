"""Motions of rigid bodies in decks, and initial velocities that a deck gives twice."""

from pathlib import Path
from typing import Any

import pytest

from conoid.client.decks.importing import Imported

from .deck_texts import INSTANCES, STEEL, abaqus, lsdyna, read, row

BODY = "*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3"
REFERENCE = "*Node, nset=REF\n99, 0.3, 0.3, 0.3\n*Rigid Body, ref node=REF, elset=body\n"


RIGID = ("*MAT_RIGID", row(2, "7.85E-9", 2.1e5, 0.3), "*PART", "punch", row(2, 1, 2))
APART = ("*NODE", "\n".join(f"{i:8}{x:16.3f}{y:16.3f}{z:16.3f}" for i, x, y, z in (
    (11, 0, 0, 0), (12, 1, 0, 0), (13, 0, 1, 0), (14, 0, 0, -1),
)), "*ELEMENT_SOLID", "".join(f"{n:8}" for n in (2, 2, 11, 13, 12, 14, 14, 14, 14, 14)))  # fmt: skip
SHARED = (
    "*NODE", f"{14:8}{0.0:16.3f}{0.0:16.3f}{-1.0:16.3f}", "*ELEMENT_SOLID",
    "".join(f"{n:8}" for n in (2, 2, 1, 3, 2, 14, 14, 14, 14, 14)),
)  # fmt: skip


def test_a_rigid_body_in_a_contact_of_one_surface_has_no_self_contact(tmp_path: Path) -> None:
    contact = ("*CONTACT_AUTOMATIC_SINGLE_SURFACE", row(0, 0, 5), row(0.2), row(0))
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *RIGID, *APART, *contact))
    assert found.refusals == []
    assert found.data["contact"] == {"self_contact": ["body"], "friction": 0.2}


def test_a_rigid_body_that_shares_nodes_is_tied(tmp_path: Path) -> None:
    erosion = ("*MAT_PLASTIC_KINEMATIC", row(1, "7.85E-9", 2.1e5, 0.3, 300.0), row(0, 0, 0.4))
    found = read(tmp_path, "a.k", lsdyna(*erosion, *RIGID, *SHARED))
    assert found.refusals == []
    assert found.data["bond"] == [{"kind": "tied", "parts": ["body", "punch"]}]


def test_a_rigid_body_of_a_material_that_fails_does_not_erode(tmp_path: Path) -> None:
    fails = "*Shear Failure\n0.4\n"
    found = read(tmp_path, "a.inp", abaqus(f"{BODY}\n*Plastic\n300.\n{fails}", model=REFERENCE))
    assert found.refusals == []
    (part,) = found.data["parts"]
    assert part["rigid"] is True
    assert "erosion" not in part


def turning(found: Imported) -> list[str]:
    """Returns the remarks about the rotation of rigid bodies."""
    return [each.why for entry in found.account.entries for each in entry.details if each.what == "rotation"]


def held(found: Imported) -> dict[str, Any]:
    """Returns the prescribed components of the only boundary."""
    (made,) = found.data["boundaries"]
    assert made["kind"] == "velocity"
    return {axis: made[axis] for axis in "xyz" if axis in made}


LINES = {
    "REF, ENCASTRE": ("xyz", []),
    "99, 1, 6": ("xyz", []),
    "REF, 1, 3": ("xyz", ["body turns about any axis in the deck, about no axis in Conoid"]),
    "REF, 3\nREF, 4, 5": ("z", []),
    "REF, 3": ("z", ["body turns about any axis in the deck, about z in Conoid"]),
    "REF, ZSYMM": ("z", []),
    "all, 1, 6": ("xyz", []),
}


@pytest.mark.parametrize("lines", LINES)
def test_a_reference_node_holds_its_rigid_body(tmp_path: Path, lines: str) -> None:
    found = read(tmp_path, "a.inp", abaqus(BODY, model=f"{REFERENCE}*Boundary\n{lines}\n"))
    axes, remarks = LINES[lines]
    assert found.refusals == []
    assert held(found) == dict.fromkeys(axes, "0 mm/s")
    assert turning(found) == remarks


def test_a_reference_node_drives_its_rigid_body(tmp_path: Path) -> None:
    driven = "*Boundary, type=VELOCITY\nREF, 3, 3, -1e5\nREF, 1, 2\nREF, 4, 6\n"
    found = read(tmp_path, "a.inp", abaqus(BODY, driven, REFERENCE))
    assert (found.refusals, turning(found)) == ([], [])
    assert held(found) == {"x": "0 mm/s", "y": "0 mm/s", "z": "-100000 mm/s"}
    started = f"{REFERENCE}*Initial Conditions, type=VELOCITY\nREF, 1, 5e4\n"
    part = read(tmp_path, "a.inp", abaqus(BODY, model=started)).data["parts"][0]
    assert (part["rigid"], part["velocity"]) == (True, ["50000 mm/s", "0 mm/s", "0 mm/s"])


@pytest.mark.parametrize(
    ("lines", "refusal"),
    {
        "REF, 6, 6, 200.": "a prescribed rotation of a rigid body",
        "both, 1, 3": "the node set 'both' has reference nodes of rigid bodies and other nodes",
    }.items(),
)
def test_what_a_rigid_body_cannot_have_is_refused(tmp_path: Path, lines: str, refusal: str) -> None:
    other = "*Node\n98, 5, 5, 5\n*Nset, nset=both\n98, 99\n"
    model = f"{REFERENCE}{other}*Boundary, type=VELOCITY\n{lines}\n"
    refusals = read(tmp_path, "a.inp", abaqus(BODY, model=model)).refusals
    assert any(refusal in line for line in refusals), refusals


def test_the_reference_node_of_a_part_is_that_of_each_instance(tmp_path: Path) -> None:
    text = INSTANCES.format(sets="*Nset, nset=R, instance=two\n1,\n")
    text = text.replace("*End Part", "*Rigid Body, ref node=1, elset=All\n*End Part")
    found = read(tmp_path, "a.inp", text.replace("*Step\n", "*Boundary\nR, ENCASTRE\n*Step\n"))
    assert found.refusals == []
    (made,) = found.data["boundaries"]
    assert made["parts"] == ["two"]


CURVE = ("*DEFINE_CURVE", row(5), "0., -1000.", "1., -1000.")
DRIVEN = ("*BOUNDARY_PRESCRIBED_MOTION_RIGID", row(1, 3, 0, 5, 1.0), *CURVE)
STEEL_CARDS = (row(1, "7.85E-9", "2.1E5", 0.3),)


@pytest.mark.parametrize(
    ("constraint", "remarks"),
    {
        (1.0, 4, 7): [],
        (0.0, 0, 0): ["body turns about any axis in the deck, about z in Conoid"],
    }.items(),
)
def test_a_driven_rigid_part_names_the_rotation_that_it_loses(
    tmp_path: Path, constraint: tuple[float, int, int], remarks: list[str]
) -> None:
    law = ("*MAT_RIGID", *STEEL_CARDS, row(*constraint), "")
    found = read(tmp_path, "a.k", lsdyna(*law, *DRIVEN))
    assert found.refusals == []
    assert turning(found) == remarks


ALL = ("*INITIAL_VELOCITY", "0", "0., 0., -7.")
ONE = {
    "*INITIAL_VELOCITY_NODE": (STEEL, tuple(row(node, 5.0) for node in (1, 2, 3, 4))),
    "*INITIAL_VELOCITY_RIGID_BODY": (("*MAT_RIGID", *STEEL_CARDS, row(0), ""), (row(1, 5.0),)),
}


@pytest.mark.parametrize("keyword", ONE)
@pytest.mark.parametrize("first", [True, False])
def test_velocities_of_nodes_and_rigid_bodies_replace_those_of_all_in_any_order(
    tmp_path: Path, keyword: str, *, first: bool
) -> None:
    law, cards = ONE[keyword]
    special = (keyword, *cards)
    found = read(tmp_path, "a.k", lsdyna(*law, *((*special, *ALL) if first else (*ALL, *special))))
    assert found.refusals == []
    assert found.data["parts"][0]["velocity"] == ["5 mm/s", "0 mm/s", "0 mm/s"]


def test_words_of_rarer_keywords(tmp_path: Path) -> None:
    """A second end time of the run and mass properties are refused in plain words; measured forces are output."""
    found = read(tmp_path, "a.k", lsdyna(*STEEL, "*CONTROL_TERMINATION", row(0.02)))
    assert any("the end of the run is given twice" in line for line in found.refusals)
    assert found.data["run"]["end_time"] == "0.01 s"
    found = read(tmp_path, "a.k", lsdyna(*STEEL, "*PART_INERTIA", "x", row(2, 1, 1), row(0), row(1), row(0)))
    assert any("parts[].rigid takes a mass, a centre and an inertia" in line for line in found.refusals)
    assert read(tmp_path, "a.k", lsdyna(*STEEL, "*CONTACT_FORCE_TRANSDUCER_PENALTY", row(1, 0, 3))).refusals == []
