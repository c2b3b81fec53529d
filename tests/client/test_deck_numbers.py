"""Numbers in decks: sets of sets, numbers that two objects have, numbers of missing objects."""

from pathlib import Path

import pytest

from conoid.cases.model.bodies import MeshFile
from conoid.client.decks.toml import bare
from conoid.worker.mesh.read import read as read_mesh

from .deck_texts import INSTANCES, STEEL, abaqus, lsdyna, r20, radioss, read, row

HELD = "*BOUNDARY_SPC_SET"
OTHER = "".join(f"{n:8}" for n in (2, 7, 1, 2, 3, 4, 4, 4, 4, 4))


def test_a_set_of_sets_has_their_nodes(tmp_path: Path) -> None:
    """The members of the set 9 are the sets 51 and 52: the deck has no nodes with these numbers."""
    sets = ("*SET_NODE_LIST", row(51), row(1, 2), "*SET_NODE", row(52), row(3, 4), "*SET_NODE_ADD", row(9), row(51, 52))
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *sets, HELD, row(9, 0, 1, 1, 1)))
    assert found.refusals == []
    (held,) = bare(found.data["boundaries"])
    assert held == {"kind": "velocity", "x": "0 mm/s", "y": "0 mm/s", "z": "0 mm/s"}
    again = ("*SET_NODE_ADD", row(9), row(9))
    (refusal,) = read(tmp_path, "b.k", lsdyna(*STEEL, *again, HELD, row(9, 0, 1, 1, 1))).refusals
    assert "the node set 9 has itself among its members" in refusal


@pytest.mark.parametrize("code", ["lsdyna", "abaqus", "radioss"])
def test_a_set_of_nodes_is_distinguished_from_a_surface_of_its_name(tmp_path: Path, code: str) -> None:
    if code == "lsdyna":
        sets = ("*SET_NODE_LIST", row(5), row(1, 2), "*SET_SEGMENT", row(5), row(1, 2, 3, 3))
        found = read(tmp_path, "a.k", lsdyna(*STEEL, *sets, HELD, row(5, 0, 1, 1, 1)))
    elif code == "abaqus":
        model = "*Nset, nset=five\n1, 2\n*Surface, name=Five\nbody, S1\n*Boundary\nfive, 1, 3"
        found = read(tmp_path, "a.inp", abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3", model=model))
    else:
        groups = (
            "/GRNOD/NODE/5",
            "some",
            row(1, 2),
            "/SURF/PART/5",
            "skin",
            row(1),
            "/BCS/1",
            "held",
            row("111 000", 0, 5),
        )
        law = ("/MAT/ELAST/1", "steel", "7.85E-9", r20(2.1e5, 0.3))
        found = read(tmp_path, "a_0000.rad", radioss(*law, *groups), None)
    assert found.refusals == []
    (held,) = bare(found.data["boundaries"])
    assert held["on"] == ("nodes:five" if code == "abaqus" else "nodes:5")


TWICE = {
    "material 1": (*STEEL, *STEEL),
    "node set 3": (*STEEL, "*SET_NODE", row(3), row(1), "*SET_NODE_LIST", row(3), row(2)),
    "curve 4": (*STEEL, *("*DEFINE_CURVE", row(4), r20(0.0, 1.0)) * 2),
    "part 1": (*STEEL, "*PART", "again", row(1, 1, 1)),
}  # fmt: skip


@pytest.mark.parametrize("what", TWICE)
def test_a_number_that_two_have_refuses(tmp_path: Path, what: str) -> None:
    refusals = read(tmp_path, "a.k", lsdyna(*TWICE[what])).refusals
    assert any(f"the {what} is defined twice" in line for line in refusals), refusals


def test_solids_of_a_part_that_is_not_defined_refuse(tmp_path: Path) -> None:
    found = read(tmp_path, "a.k", lsdyna(*STEEL, "*ELEMENT_SOLID", OTHER))
    assert found.refusals == ["solids of the part 7 would be lost: the deck does not define the part"]


def test_the_cards_of_the_option_mpp_are_not_those_of_the_contact(tmp_path: Path) -> None:
    cards = (row(0, 0, 5, 5), row(0.3, 0.3), row(1.0, 1.0))
    for more in ((row(0, 200, 0, 3, 2, 1.0005),), (row(0, 200), "&        0         0         0")):
        found = read(tmp_path, "a.k", lsdyna(*STEEL, "*CONTACT_AUTOMATIC_SINGLE_SURFACE_MPP", *more, *cards))
        assert found.refusals == []
        assert found.data["contact"]["friction"] == 0.3


def test_a_curve_that_ends_early_refuses_where_it_is_constant_as_well(tmp_path: Path) -> None:
    curve = ("*DEFINE_CURVE", row(1), r20(0.0, 5.0), r20(0.001, 5.0))
    refusals = read(
        tmp_path, "a.k", lsdyna(*STEEL, *curve, "*BOUNDARY_PRESCRIBED_MOTION_RIGID", row(1, 3, 0, 1))
    ).refusals
    assert any("the curve ends at 0.001" in line for line in refusals)


def test_a_second_velocity_of_a_body_that_turns_refuses(tmp_path: Path) -> None:
    turn = ("*INITIAL_VELOCITY_GENERATION", row(1, 2, 100.0), row(0, 0, 0, 0, 0, 1))
    push = ("*INITIAL_VELOCITY_GENERATION", row(1, 2, 0.0, 5.0), row(0))
    for cards in ((*turn, *push), (*push, *turn)):
        assert any(
            "already has an initial velocity" in line for line in read(tmp_path, "a.k", lsdyna(*STEEL, *cards)).refusals
        )


def test_a_velocity_that_replaces_another_one_is_in_the_account(tmp_path: Path) -> None:
    """Two loads of one body are more often a mistake than the intention of a user."""
    push = ["*INITIAL_VELOCITY_GENERATION", row(1, 2, 0.0, 5.0), row(0)]
    for speed, expected in ((7.0, ["replaces the velocity that another keyword gives to body"]), (5.0, [])):
        again = ["*INITIAL_VELOCITY_GENERATION", row(1, 2, 0.0, speed), row(0)]
        found = read(tmp_path, "a.k", lsdyna(*STEEL, *push, *again))
        assert found.refusals == []
        assert found.data["parts"][0]["velocity"][0] == f"{speed:g} mm/s"
        details = [each for entry in found.account.entries for each in entry.details if each.kind == "differs"]
        assert [each.why for each in details] == expected


def test_groups_within_themselves_and_that_take_away_refuse(tmp_path: Path) -> None:
    law = ("/MAT/ELAST/1", "steel", "7.85E-9", r20(2.1e5, 0.3))
    for group, message in (
        (("/GRNOD/GRNOD/5", "g", row(5)), "includes itself"),
        (("/GRNOD/NODE/5", "g", row(1, -2)), "negative numbers"),
    ):
        found = read(tmp_path, "a_0000.rad", radioss(*law, *group, "/BCS/1", "held", row("111 000", 0, 5)), None)
        assert any(message in line for line in found.refusals), found.refusals


def starter(points: list[str]) -> str:
    """Returns a Radioss deck of two tets; the part 1 has the title 2, and the part 2 has the title 1."""
    units = r20("kg", "m", "s")
    return "\n".join((
        "#RADIOSS STARTER", "/BEGIN", "b", row(2021, 0), units, units, "/PART/1", "2", row(1, 1), "/PART/2", "1",
        row(1, 1), "/NODE", *points, "/TETRA4/1", row(1, 1, 2, 3, 4), "/TETRA4/2", row(2, 5, 6, 7, 8), "/END", "",
    ))  # fmt: skip


def keywords(points: list[str]) -> str:
    """Returns the model of the Radioss deck as an LS-DYNA keyword deck."""
    first, second = (
        "".join(f"{n:8}" for n in ids) for ids in ((1, 1, 1, 2, 3, 4, *(4,) * 4), (2, 2, 5, 6, 7, 8, *(8,) * 4))
    )
    return "\n".join((
        "*KEYWORD", "*PART", "2", row(1, 1, 1), "*PART", "1", row(2, 1, 1), "*NODE", *points, "*ELEMENT_SOLID", first,
        second, "*END", "",
    ))  # fmt: skip


@pytest.mark.parametrize("ending", ["k", "rad"])
def test_a_number_means_the_part_of_that_number_not_of_that_title(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    points = [*corners, *((2.0 * x + 5.0, 2.0 * y, 2.0 * z) for x, y, z in corners)]
    first, width = (8, 16) if ending == "k" else (10, 20)
    rows = [f"{i:{first}}{x:{width}}{y:{width}}{z:{width}}" for i, (x, y, z) in enumerate(points, 1)]
    path.write_text(keywords(rows) if ending == "k" else starter(rows))
    files = [MeshFile(shape="file", path=path.name, unit=1.0, group=name) for name in ("1", "2")]
    assert [read_mesh(file, path).points.max() for file in files] == [1.0, 7.0]


RIGID = {
    "*Rigid Body, ref node=1, elset=one.All\n": [True, False],
    "*Elset, elset=All, instance=two\n1,\n*Rigid Body, ref node=1, elset=All\n": [False, True],
    "*Elset, elset=both\none.All, two.All\n*Rigid Body, ref node=1, elset=both\n": [True, True],
    "*Rigid Body, ref node=1, elset=three.All\n": None,
}


@pytest.mark.parametrize("sets", RIGID)
def test_the_bodies_of_one_instance_are_rigid_where_the_deck_names_one(tmp_path: Path, sets: str) -> None:
    found = read(tmp_path, "a.inp", INSTANCES.format(sets=sets))
    if RIGID[sets] is None:
        assert any("*RIGID BODY" in line for line in found.refusals)
    else:
        assert found.refusals == []
        assert [bare(part).get("rigid", False) for part in found.data["parts"]] == RIGID[sets]


def test_a_surface_of_a_set_that_is_not_there_refuses(tmp_path: Path) -> None:
    pair = "*Surface, name=S\nnothing, S1\n*Contact Pair, interaction=I\nS, S\n*Surface Interaction, name=I\n"
    refusals = read(tmp_path, "a.inp", abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3", model=pair)).refusals
    assert any("uses the set 'nothing', which has no elements" in line for line in refusals), refusals


def test_a_contact_with_a_part_that_has_no_solids_is_left_out(tmp_path: Path) -> None:
    contact = ("*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE", row(1, 9, 3, 3), row(0.2, 0.2), row(1.0))
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *contact))
    (entry,) = [each for each in found.account.entries if each.keyword.startswith("*CONTACT")]
    assert (entry.fate, found.data.get("contact")) == ("left", "none")
    assert "has no part of the case" in entry.reasons[0]


SINGLE = ("*BOUNDARY_SPC_NODE", *(row(node, 0, 1, 1, 1, 0, 0, 0) for node in (1, 2, 3)))


def test_single_held_nodes_are_one_group(tmp_path: Path) -> None:
    """A boundary of a case selects nodes by the name of a set: a set with the same nodes is used."""
    (refusal,) = read(tmp_path, "a.k", lsdyna(*STEEL, *SINGLE)).refusals
    assert "the group of 3 nodes has only some nodes of a part and is no set of the mesh" in refusal
    found = read(tmp_path, "b.k", lsdyna(*STEEL, *SINGLE, "*SET_NODE_LIST", row(9), row(3, 1, 2)))
    assert found.refusals == []
    (held,) = bare(found.data["boundaries"])
    assert held == {"kind": "velocity", "on": "9", "x": "0 mm/s", "y": "0 mm/s", "z": "0 mm/s"}
    plane = ("*BOUNDARY_SPC_NODE", *(row(node, 0, 0, 0, 1) for node in (1, 2, 3)))
    (mirror,) = bare(read(tmp_path, "c.k", lsdyna(*STEEL, *plane)).data["boundaries"])
    assert mirror == {"kind": "symmetry", "axis": "z", "at": "0 mm"}
