"""Decks of three codes in the styles of their pre-processors become cases; each keyword is in the account."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.load import shipped_path
from conoid.client.decks.importing import Imported, lines, read_deck, report
from conoid.client.decks.toml import bare
from conoid.client.errors import UsageError

from .deck_texts import DECKS, FOLDER, abaqus, lsdyna, r20, radioss, read, row
from .taylor_deck import abaqus_text

UNITS = {"cae_taylor.inp": "mm,s,t"}
STEEL = ("*MAT_ELASTIC", row(1, "7.85E-9", 210000.0, 0.3))


def imported(name: str) -> Imported:
    return read_deck(FOLDER / name, UNITS.get(name))


def keyword_lines(path: Path) -> list[tuple[str, int]]:
    """Returns the lines of a deck that begin a keyword or an option, found without the code of the importer."""
    sign = r"/[A-Z]" if path.suffix == ".rad" else r"\*[A-Za-z]"
    text = path.read_text(encoding="utf-8").splitlines()
    return [(line, number) for number, line in enumerate(text, 1) if re.match(sign, line)]


@pytest.mark.parametrize("name", DECKS)
def test_every_keyword_of_a_deck_is_listed_once(name: str) -> None:
    found = imported(name)
    files = {
        "": FOLDER / name,
        **{file: FOLDER / file for file in {each.file for each in found.account.entries} if file},
    }
    there = sorted((file, number) for file, path in files.items() for _, number in keyword_lines(path))
    assert sorted((each.file, each.line) for each in found.account.entries) == there
    assert all(each.decided for each in found.account.entries)
    listed = [line for line in lines(found, "case.toml") if re.match(r"  line \d+", line)]
    assert len(listed) == len(there)
    assert len(report(found, "case.toml")["keywords"]) == len(there)


@pytest.mark.parametrize("name", DECKS)
def test_the_case_is_equal_as_text_and_as_data(name: str) -> None:
    found = imported(name)
    assert tomllib.loads(found.toml) == bare(found.data)
    assert found.refusals == []


SI: dict[str, dict[str, Any]] = {
    "lspp_taylor.k": {
        "units": "mm, t, s", "materials.steel.strength.hardening": f"{206000.0 * 1000.0 / 205000.0!r} MPa",
        "parts.0.velocity": ["0 mm/s", "0 mm/s", "-190000 mm/s"], "parts.0.erosion.plastic_strain": 1.5,
        "boundaries.1": {"kind": "symmetry", "axis": "x", "at": "0 mm"}, "numerics.dt_safety": 0.67, "run.frames": 40,
    },
    "lspp_plate.k": {
        "units": "cm, g, us", "parts.1.velocity": ["0 cm/us", "0 cm/us", "-0.12 cm/us"], "contact": {"friction": 0.1},
        "parts.0.erosion": {"damage": 1.0}, "run.end_time": "40 us", "materials.cube.spall": "0.02 Mbar",
    },
    "lspp_ceramic.k": {
        "units": "mm, kg, ms", "parts.1.velocity": ["0 m/s", "0 m/s", "-300 m/s"], "contact.friction": 0.2,
        "materials.alumina_tile.strength.tension": "0.262 GPa",
        "contact.self_contact": ["alumina_tile", "steel_backing"],
    },
    "hypermesh_bar.k": {
        "units": "m, kg, s", "materials.bar.strength.hardening": "500000000 Pa", "parts.0.erosion.plastic_strain": 0.45,
        "boundaries.1.course": [["0 s", 0.0], ["2e-05 s", 1.0], ["1 s", 1.0]], "boundaries.1.z": "5 m/s",
    },
    "ansa_drop.k": {
        "units": "mm, t, s", "bond": [{"kind": "tied", "parts": ["base", "cover"]}], "boundaries.1.friction": 0.15,
        "boundaries.0.acceleration": ["0 mm/s^2", "0 mm/s^2", "-9810 mm/s^2"], "run.end_time": "0.002 s",
    },
    "hypermesh_rod_0000.rad": {
        "units": "mm, kg, ms", "name": "hypermesh_rod", "boundaries.0.friction": 0.1, "run.end_time": "0.05 ms",
        "boundaries.2": {"kind": "symmetry", "axis": "y", "at": "0 mm"}, "numerics.dt_safety": 0.8, "run.frames": 50,
    },
    "ansa_punch_0000.rad": {
        "units": "mm, t, s", "contact": {"friction": 0.12}, "boundaries.2.z": "-8000 mm/s",
        "materials.copper.strength.damage.D3": -3.03, "materials.copper.eos.c0": "3940000 mm/s",
    },
    "cae_taylor.inp": {
        "units": "mm, t, s", "parts.0.mesh.group": "Bar-1.Set-1", "materials.Copper.strength.hardening": "100 MPa",
        "boundaries.2": {"kind": "symmetry", "axis": "z", "at": "10 mm"},
    },
    "cae_impact.inp": {
        "units": "mm, t, s", "parts.0.name": "Cube-1", "materials.OFHC.strength.damage.D3": -3.03,
        "materials.OFHC.strength.reference_temperature": "298.15 K", "parts.0.temperature": "298.15 K",
        "contact": {"self_contact": ["Cube-1", "Plate-1"], "friction": 0.1}, "boundaries.0.parts": ["Plate-1"],
    },
    "hypermesh_sandwich.inp": {
        "units": "m, kg, s", "bond": [{"kind": "tied", "parts": ["base", "cover"]}], "contact.friction": 0.25,
        "contact.parts": ["cover", "ram"], "parts.1.erosion.plastic_strain": 0.35, "run.frames": 10,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", DECKS)
def test_the_imported_case_has_the_values_of_the_deck(name: str) -> None:
    found = imported(name)
    data = bare(found.data)
    for key, value in SI[name].items():
        if key == "units":
            assert str(found.system) == value
            continue
        at: Any = data
        for word in key.split("."):
            at = at[int(word)] if isinstance(at, list) else at[word]
        assert at == value, key


# Units ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("density", "young", "system"),
    [
        ("7850", "2.1E11", "m, kg, s"), ("7.8E-9", "2.1E5", "mm, t, s"), ("7.83E-6", "207", "mm, kg, ms"),
        ("7.85E-3", "2.1E5", "mm, g, ms"), ("7.85E-6", "2.1E8", "mm, kg, s"), ("7.85", "2.1", "cm, g, us"),
        ("7.85", "210", "mm, mg, us"), ("7.85", "2.1E12", "cm, g, s"), ("7.34E-4", "3.0E7", "in, lbf*s^2/in, s"),
    ],
)  # fmt: skip
def test_units_are_detected_from_steel(tmp_path: Path, density: str, young: str, system: str) -> None:
    found = read(tmp_path, "a.k", lsdyna("*MAT_ELASTIC", row(1, density, young, 0.3)), None)
    assert str(found.system) == system
    assert "steel" in found.why


@pytest.mark.parametrize(("density", "young"), [("8.96E-9", "1.2E5"), ("7.85E-9", "7.0E4"), ("0.001", "1.0")])
def test_units_are_asked_for_where_nothing_is_steel(tmp_path: Path, density: str, young: str) -> None:
    with pytest.raises(UsageError, match="--units is needed: no material has the density of steel"):
        read(tmp_path, "a.k", lsdyna("*MAT_ELASTIC", row(1, density, young, 0.3)), None)


def test_units_are_asked_for_where_two_systems_have_steel(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="may be steel in mm, t, s or in mm, kg, ms"):
        read(tmp_path, "a.k", lsdyna(
            "*MAT_ELASTIC", row(1, "7.85E-9", 2.1e5, 0.3), "*MAT_ELASTIC", row(2, "7.85E-6", 210.0, 0.3)
        ), None)  # fmt: skip


@pytest.mark.parametrize("text", ["mm,ms", "mm,ms,kg,s", "mm,ms,m", "", "mm,ms,stone"])
def test_units_that_are_no_system_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(UsageError, match="expected a length, a mass and a time"):
        read(tmp_path, "a.k", lsdyna(*STEEL), text)


def test_a_radioss_deck_names_its_units_itself(tmp_path: Path) -> None:
    deck = radioss("/MAT/ELAST/1", "steel", "7.85E-9", r20(2.1e5, 0.3))
    assert str(read(tmp_path, "a_0000.rad", deck, None).system) == "mm, t, s"
    with pytest.raises(UsageError, match="the deck is in mm, t, s"):
        read(tmp_path, "a_0000.rad", deck, "m,kg,s")


# What refuses ---------------------------------------------------------------------------------------------------------

REFUSED = {
    "a law that Conoid lacks": (("*MAT_HONEYCOMB", row(1, "7.85E-9", 1.0)), "MAT_HONEYCOMB: Conoid has no such"),
    "a keyword that is not known": ((*STEEL, "*MAGIC_FORCE", row(1)), "MAGIC_FORCE: unknown keyword, which may change"),
    "kinematic hardening": (
        ("*MAT_PLASTIC_KINEMATIC", row(1, "7.85E-9", 2.1e5, 0.3, 350.0, 1000.0, 0.0)), "BETA = 0: kinematic hardening"
    ),
    "half of a rate": (
        ("*MAT_PLASTIC_KINEMATIC", row(1, "7.85E-9", 2.1e5, 0.3, 350.0, 0.0, 1.0), row(40.0, 0.0)),
        "SRC = 40 and SRP = 0 are not both above 0",
    ),
    "a curve of rates": (
        ("*MAT_024", row(1, "7.85E-9", 2.1e5, 0.3, 350.0), row(0, 0, 0, 7)), "LCSR = 7: curve of the flow stress"
    ),
    "a rate that is added": (
        ("*MAT_024", row(1, "7.85E-9", 2.1e5, 0.3, 350.0, 1000.0), row(40.0, 5.0, 0, 0, 1)), "VP = 1: in LS-DYNA"
    ),
    "an unread field": (("*MAT_ELASTIC", row(1, "7.85E-9", 2.1e5, 0.3, 0, 0, 7.0)), "K = 7.0: not translated"),
    "a velocity of a part of a part": (
        (*STEEL, "*SET_NODE_LIST", row(3), row(1, 2), "*INITIAL_VELOCITY", row(3), row(0, 0, -5.0)),
        "node set 3 has only some nodes of body",
    ),
    "a set that is not there": ((*STEEL, "*BOUNDARY_SPC_SET", row(8, 0, 1, 1, 1)), "the node set 8 is not defined"),
    "two ends of a curve": (
        (*STEEL, "*DEFINE_CURVE", row(1), r20(0.0, 0.0), r20(0.001, 5.0), "*BOUNDARY_PRESCRIBED_MOTION_RIGID",
         row(1, 3, 0, 1, 1.0)),
        "the curve ends at 0.001, before the end of the run at 0.01",
    ),
    "shells": ((*STEEL, "*ELEMENT_SHELL", row(9, 2)), "ELEMENT_SHELL: shells"),
    "a thermal analysis": ((*STEEL, "*CONTROL_SOLUTION", row(2)), "SOLN = 2: a thermal analysis"),
    "a relaxation": (
        (*STEEL, "*CONTROL_DYNAMIC_RELAXATION", row(250, 0.001, 0.995, 0, 0, 0, 0.04, 1)), "IDRFLG = 1: a relaxation"
    ),
    "material that flows through the mesh": (
        (*STEEL, "*SECTION_SOLID_TITLE", "air", row(2, 11)), "ELFORM = 11: the material flows through the mesh"
    ),
    "no equation of state": (
        ("*MAT_JOHNSON_COOK", row(1, "7.85E-9", 8e4), row(300, 400, 0.3, 0.01, 1, 1800, 293, 1), row(4.6e8), row(0)),
        "*PART names no equation of state",
    ),
    "what no case can have": (("*MAT_ELASTIC", row(1, "7.85E-9", 2.1e5, 0.5)), "the case would not be valid"),
    "a number that is none": (("*MAT_ELASTIC", row(1, "7.85E-9", "abc", 0.3)), "E = 'abc' is not a number"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_a_keyword_that_would_change_the_answer_refuses_the_import(tmp_path: Path, what: str) -> None:
    cards, message = REFUSED[what]
    found = read(tmp_path, "a.k", lsdyna(*cards))
    assert any(message in line for line in found.refusals), found.refusals
    assert all("\n" not in line for line in found.refusals)


WITHOUT_EFFECT = {
    "CONTROL_SOLUTION": row(0, 0, 1, 100), "CONTROL_IMPLICIT_GENERAL": row(0, 0.1), "CONTROL_IMPLICIT_AUTO": row(1),
    "CONTROL_DYNAMIC_RELAXATION": row(250, 0.001, 0.995), "CONTROL_THERMAL_SOLVER": row(1), "CONTROL_RIGID": row(1),
    "SECTION_SOLID": row(3, -1),
}  # fmt: skip


@pytest.mark.parametrize("name", WITHOUT_EFFECT)
def test_control_cards_without_effect_do_not_refuse(tmp_path: Path, name: str) -> None:
    found = read(tmp_path, "a.k", lsdyna(*STEEL, f"*{name}", WITHOUT_EFFECT[name]))
    assert found.refusals == []
    entry = next(each for each in reversed(found.account.entries) if each.keyword == f"*{name}")
    assert entry.fate == "left"


def test_walls_and_sliding_nodes_off_a_plane_are_reported(tmp_path: Path) -> None:
    """A set of sliding nodes on no plane of symmetry is refused, because walls do not stop driven nodes, which would
    move through the wall.
    """
    deck = abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3", model="*Nset, nset=some\n1, 2\n*Boundary\nsome, 1, 1")
    assert read(tmp_path, "a.inp", deck).data["boundaries"][0]["on"] == "some"
    cards = ("*SET_NODE_LIST", row(3), row(1, 2), "*BOUNDARY_SPC_SET", row(3, 0, 1), "*RIGIDWALL_PLANAR", "",
             row(0, 0, 0, 0, 0, 1))  # fmt: skip
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *cards))
    assert any("walls do not stop nodes with prescribed motion" in line for line in found.refusals)


def test_the_list_of_a_deck_is_data_as_well() -> None:
    listed = json.loads(json.dumps(report(imported("ansa_drop.k"), "ansa_drop.toml")))
    assert listed["units"] == "mm, t, s"
    assert listed["refused"] == []
    assert {each["fate"] for each in listed["keywords"]} == {"taken", "left"}
    step = next(each for each in listed["keywords"] if each["keyword"] == "*CONTROL_TIMESTEP")
    assert [each["kind"] for each in step["details"]] == ["differs", "left"]


# Features of public decks ---------------------------------------------------------------------------------------------

PUBLIC: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "nodes that hold themselves": (
        "a.k", lsdyna(*STEEL).replace("           0.000\n", "           0.000       3\n"), ()
    ),
    "a mesh that is generated": ("a.inp", abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3").replace(
        "*Element,", "*Ngen\n1, 2, 1\n*Nfill\n1, 2\n*Element,"
    ), ("*NGEN: generates or moves nodes", "*NFILL: generates or moves nodes")),
    "units of single options, groups of groups": ("a_0000.rad", radioss(
        "/UNIT/3", "other", r20("kg", "mm", "ms"), "/MAT/ELAST/1/3", "steel", "7.85E-6", r20(2.1e2, 0.3),
    ), ("an option with its own units (unit_ID) is not translated",)),
}  # fmt: skip


@pytest.mark.parametrize("what", PUBLIC)
def test_features_of_public_decks(tmp_path: Path, what: str) -> None:
    name, text, expected = PUBLIC[what]
    found = read(tmp_path, name, text, None if name.endswith(".rad") else "mm,t,s")
    assert len(found.refusals) == len(expected)
    assert all(any(words in line for line in found.refusals) for words in expected), found.refusals


def test_nodes_that_hold_themselves_are_a_plane_of_symmetry(tmp_path: Path) -> None:
    found = read(tmp_path, *PUBLIC["nodes that hold themselves"][:2])
    assert bare(found.data)["boundaries"] == [{"kind": "symmetry", "axis": "z", "at": "0 mm"}]


@pytest.mark.parametrize(
    ("codes", "held"),
    [((), {}), ((1, 7, 7), {"x": "0 mm/s", "y": "0 mm/s", "z": "0 mm/s"}), ((1, 4, 7), {"x": "0 mm/s", "y": "0 mm/s"})],
)
def test_a_rigid_body_is_held_as_its_material_defines(
    tmp_path: Path, codes: tuple[int, ...], held: dict[str, str]
) -> None:
    found = read(tmp_path, "a.k", lsdyna("*MAT_RIGID", row(1, "7.85E-9", 2.1e5, 0.3), row(*codes)))
    assert found.refusals == []
    data = bare(found.data)
    assert data["parts"][0]["rigid"] is True
    assert [{key: each.get(key) for key in held} for each in data.get("boundaries", [])] == [held] * bool(held)


def test_a_rigid_body_that_turns_about_one_axis_alone_refuses(tmp_path: Path) -> None:
    found = read(tmp_path, "a.k", lsdyna("*MAT_RIGID", row(1, "7.85E-9", 2.1e5, 0.3), row(1, 3, 4)))
    assert any("CON1 = 3" in line for line in found.refusals)


def test_the_shipped_case_is_what_the_import_makes_of_its_deck() -> None:
    case = shipped_path("imported_taylor")
    written = tomllib.loads(case.read_text(encoding="utf-8"))
    found = read_deck(case.with_suffix(".inp"), "mm,t,s")
    assert bare(found.data) == {key: value for key, value in written.items() if key not in ("description", "reference")}
    assert case.with_suffix(".inp").read_text(encoding="utf-8") == abaqus_text(1.08e-3)
