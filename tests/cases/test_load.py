"""Reading of cases: all errors are reported at once, each error in one line with the key that the user wrote."""

import json
import os
import time
from pathlib import Path
from typing import get_args

import pytest

from conoid.cases.load import (
    CaseError,
    Problem,
    apply_overrides,
    json_data,
    material,
    parse_case,
    parse_json,
    parse_toml,
    read_case,
    resolved_json,
    shipped,
    shipped_path,
    toml_data,
)
from conoid.cases.model.bodies import Cylinder
from conoid.cases.model.materials import Strength

from .scenes import ROD, messages, problems, rod


def test_reads_si() -> None:
    case = parse_toml(ROD)
    mesh = case.parts[0].mesh
    assert isinstance(mesh, Cylinder)
    assert (mesh.radius, mesh.length) == (3e-3, 30e-3)
    assert case.parts[0].velocity == (0.0, 0.0, -10.0)
    assert (case.reference[0].value, case.reference[0].tolerance) == (30e-3, 1e-3)


def test_the_resolved_case_is_the_case_with_its_materials() -> None:
    case = parse_toml(ROD)
    resolved = parse_json(resolved_json(case))
    assert resolved.materials == {"steel": material(case, "steel")}
    assert resolved.model_copy(update={"materials": {}}) == case
    assert resolved_json(resolved) == resolved_json(case)


def test_the_resolved_case_keeps_what_is_switched_off() -> None:
    case = parse_case(rod("numerics.viscosity=none"))
    assert case.numerics.viscosity is None
    assert parse_json(resolved_json(case)).numerics.viscosity is None


def test_all_errors_at_once() -> None:
    found = messages(
        "parts[0].mesh.radus=1 mm",
        "parts[0].mesh.radius=3 s",
        "parts[0].mesh.sector=third",
        "numerics.presure=nodal",
        "numerics.pressure=nodel",
        "run.end_time=-1 us",
        "run.ranks=2.5",
        "reference[0].value=30 s",
        "extra=1",
    )
    assert found == {
        "parts[0].mesh.radus": "unknown key; did you mean 'radius'?",
        "parts[0].mesh.radius": "has the wrong dimension; expected a length, in a unit such as 'm'",
        "parts[0].mesh.sector": "allowed: 'full', 'half' or 'quarter'",
        "numerics.presure": "unknown key; did you mean 'pressure'?",
        "numerics.pressure": "allowed: 'standard', 'nodal' or 'split'; did you mean 'nodal'?",
        "run.end_time": "allowed: greater than 0",
        "run.ranks": "expected a whole number",
        "reference[0].value": "'30 s' has the wrong dimension; expected a length, in a unit such as 'm'",
        "extra": found["extra"],
    }
    assert found["extra"].startswith("unknown key; known: 'balance', 'bond', 'boundaries', 'contact'")


@pytest.mark.parametrize(
    ("override", "key", "message"),
    [
        (
            "parts[0].mesh.shape=cilinder",
            "parts[0].mesh.shape",
            "'plate', 'cylinder', 'tube', 'sphere', 'cone', 'ogive'",
        ),
        ("boundaries[0].kind=wal", "boundaries[0].kind", "'symmetry', 'wall', 'velocity', 'rotation'"),
        ("probes[0].field=stress", "probes[0].field", "'stress_xx'"),
        ("reference[0].quantity=length", "reference[0].quantity", "'extent'"),
        ("parts[0].name=3rod", "parts[0].name", "a name starts with a letter"),
        ("parts[0].velocity=[1, 2]", "parts[0].velocity[2]", "this key is missing"),
        ("parts[0].velocity[1]=true", "parts[0].velocity[1]", "expected a quantity in m/s"),
        ("parts[0].velocity[1]=nan", "parts[0].velocity[1]", "is not finite"),
        ("boundaries[0].normal=[0, 0, inf]", "boundaries[0].normal[2]", "finite"),
        ("parts=3", "parts", "each one begins with [[parts]]"),
        ("parts=[]", "parts", "at least one is needed"),
        ("parts[0].mesh=3", "parts[0].mesh", "table of keys"),
        ("run=3", "run", "expected a table of keys"),
        ("run.ranks=true", "run.ranks", "expected a whole number"),
        ("run.ranks=5000", "run.ranks", "less than or equal to 4096"),
        ("numerics.viscosity=off", "numerics.viscosity", 'expected a table of keys or "none"'),
        ("contact=False", "contact", 'expected a table of keys or "none"'),
        ("parts[0].rigid=True", "parts[0].rigid", "expected a table of keys, true or false"),
        ("title=1", "title", "expected a text; in TOML a text is in quotes"),
    ],
)
def test_one_line_gives_the_allowed_values(override: str, key: str, message: str) -> None:
    found = [problem for problem in problems(override) if problem.key == key]
    assert len(found) == 1
    assert message in found[0].message


def test_a_material_is_read_through_its_model() -> None:
    found = messages("materials.foo.density=-1", "materials.foo.strength.model=jc", "materials.foo.elastic.youn=1 GPa")
    laws = [get_args(law.model_fields["model"].annotation)[0] for law in get_args(get_args(Strength)[0])]
    assert found["materials.foo.strength.model"] == f"allowed: {', '.join(map(repr, laws))}"
    assert found["materials.foo.elastic.youn"] == "unknown key; did you mean 'young'?"
    assert found["materials.foo.elastic.poisson"] == "this key is missing"
    assert found["materials.foo.density"] == "allowed: greater than 0"
    found = messages("materials.density.density=1", "materials.density.elasticity=1")
    assert found["materials.density.elasticity"] == "unknown key; did you mean 'elastic'?"


def test_missing_discriminators_and_keys_are_named() -> None:
    data = rod()
    del data["parts"][0]["mesh"]["shape"], data["boundaries"][1]["kind"], data["run"]
    with pytest.raises(CaseError) as caught:
        parse_case(data)
    assert [problem.key for problem in caught.value.problems] == ["parts[0].mesh.shape", "boundaries[1].kind", "run"]
    assert all("this key is missing" in problem.message for problem in caught.value.problems)


def test_a_reference_unit_follows_the_field_of_its_probe() -> None:
    probed = 'reference[0]={quantity="probe_mean", probe="middle", value="-2 GPa", tolerance="1 MPa", source="s"}'
    case = parse_case(rod(probed))
    assert (case.reference[0].value, case.reference[0].tolerance) == (-2e9, 1e6)
    found = messages(probed, "reference[0].value=2 m")
    assert found == {"reference[0].value": "'2 m' has the wrong dimension; expected a stress, in a unit such as 'Pa'"}
    found = messages(probed, "reference[0].probe=midle")
    assert "did you mean 'middle'?" in found["reference[0].value"]
    assert "did you mean 'middle'?" in found["reference[0].probe"]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("name = 'a'\n[run\n", "line 2 = '[run': broken TOML: Expected ']' at the end of a table declaration"),
        ("a = 1\na = 2\n", "line 2 = 'a = 2': broken TOML: Cannot overwrite a value"),
        ("a = ", "broken TOML: Invalid value (at end of document)"),
    ],
)
def test_broken_toml_names_the_line(text: str, line: str) -> None:
    with pytest.raises(CaseError) as caught:
        parse_toml(text)
    assert str(caught.value) == line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('{"name": 1,\n "run" 2}', "line 2 = '\"run\" 2}': broken JSON: Expecting ':' delimiter"),
        ('{"a": 1, "a": 2}', "broken JSON: the key 'a' is given twice"),
        ("[1]", "a list: a case is an object of keys"),
        ("7", "7: a case is an object of keys"),
        ("", "line 1: broken JSON: Expecting value"),
        ('{"a": ' + "1" * 5000 + "}", "broken JSON: a whole number has too many digits"),
        ("[" * 100_000, "this JSON is nested too deeply"),
        (b"\xff\xfe\x00", "this JSON is not UTF-8 text"),
    ],
)
def test_broken_json_is_one_line(text: str | bytes, line: str) -> None:
    with pytest.raises(CaseError) as caught:
        parse_json(text)
    assert str(caught.value) == line


def test_json_nan_is_refused() -> None:
    data = rod("parts[0].mesh.radius=1 mm")
    data["parts"][0]["mesh"]["radius"] = float("nan")
    with pytest.raises(CaseError, match=r"parts\[0\]\.mesh\.radius = nan: is not finite|nan is not finite"):
        parse_json(json.dumps(data))


def test_files(tmp_path: Path) -> None:
    good = tmp_path / "case.toml"
    good.write_text(ROD, encoding="utf-8")
    assert read_case(good) == parse_toml(ROD)
    (tmp_path / "bad.toml").write_bytes(b"\xff")
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "endless.toml").symlink_to("/dev/zero")
    for name, message in (
        ("bad.toml", "this file is not UTF-8 text"),
        ("none.toml", "cannot read this file: No such file or directory"),
        ("pipe.toml", "cannot read this file: is not a regular file"),
        ("endless.toml", "cannot read this file: is not a regular file"),
        ("case.yaml", "a case file ends in .toml or .json"),
    ):
        with pytest.raises(CaseError) as caught:
            read_case(tmp_path / name)
        assert caught.value.problems[0].message == message


def test_overrides_read_toml_or_text() -> None:
    changed = rod(
        "run.ranks=2", "parts[0].mesh.element_size=0.5 mm", "parts[0].velocity[2]=-20", "numerics.dt_safety=0.5"
    )
    case = parse_case(changed)
    assert (case.run.ranks, case.numerics.dt_safety, case.parts[0].velocity[2]) == (2, 0.5, -20.0)
    assert isinstance(case.parts[0].mesh, Cylinder)
    assert case.parts[0].mesh.element_size == 0.5e-3


def test_overrides_leave_their_source_alone() -> None:
    data = rod()
    apply_overrides(data, ["run.ranks=2", "parts[0].name=bar"])
    assert data == rod()


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("run.ranks", "write an assignment"),
        ("=2", "write an assignment"),
        ("run..ranks=2", "write an assignment"),
        ("parts[1].name=a", "[1] is outside the list, which has 1 items"),
        ("parts[0][0]=a", "the value that contains it is not a list"),
        ("name.x=a", "the value that contains it is not a table"),
        ("nothing[0].x=a", "there is no list 'nothing'"),
    ],
)
def test_overrides_that_cannot_be_made(override: str, message: str) -> None:
    with pytest.raises(CaseError) as caught:
        apply_overrides(rod(), [override, override])
    assert len(caught.value.problems) == 2
    assert message in caught.value.problems[0].message


def test_a_title_is_no_document() -> None:
    with pytest.raises(CaseError) as caught:
        parse_case(rod() | {"title": "x" * 900_000})
    assert caught.value.problems == (Problem("title", "", "900000 characters are too many; allowed: up to 200"),)


def test_a_list_has_its_length() -> None:
    with pytest.raises(CaseError) as caught:
        parse_case(apply_overrides(rod(), ["parts[0].velocity=10 m/s"]))
    assert str(caught.value) == "parts[0].velocity = '10 m/s': expected a list of 3"


def test_too_many_parts_are_counted_and_not_compared() -> None:
    data = rod()
    one = data["parts"][0]
    data["parts"] = [{**one, "name": f"rod{i}", "mesh": {**one["mesh"], "base": [i, 0, 0]}} for i in range(3000)]
    began = time.process_time()
    with pytest.raises(CaseError) as caught:
        parse_case(data)
    assert caught.value.problems[0] == Problem("parts", "", "3000 are too many; allowed: up to 256")
    assert time.process_time() - began < 3.0, "each with each of 3000 are 4.5 million pairs"


def test_a_byte_order_mark_is_no_part_of_a_case() -> None:
    for mark in ("", "\ufeff"):
        assert toml_data(f'{mark}name = "rod"') == json_data(f'{mark}{{"name": "rod"}}') == {"name": "rod"}
    assert json_data(b'\xef\xbb\xbf{"name": "rod"}') == {"name": "rod"}


def test_a_key_is_overridden_once() -> None:
    given: list[dict[str, object] | list[str]] = [
        ["run.ranks=2", "run.ranks = 2"], {"run.ranks": 2, "run": {"ranks": 3}},
        ["parts[0].name=a", "parts[00].name=b"],
    ]  # fmt: skip
    for each in given:
        with pytest.raises(CaseError, match="this key is set more than once") as caught:
            apply_overrides(rod(), each)
        assert len(caught.value.problems) == 1
    assert apply_overrides(rod(), ["parts[0].velocity=[0, 0, 1]", "parts[0].velocity[2]=2"])


def test_an_override_cannot_smuggle_in_other_keys() -> None:
    changed = rod("title=1\nname = 'other'")
    assert changed["name"] == "rod"
    assert changed["title"] == "1\nname = 'other'"


def test_materials_come_from_the_case_first() -> None:
    own = "materials.steel={density=1, elastic={young=1, poisson=0}}"
    assert material(parse_case(rod(own)), "steel").density == 1.0
    assert material(parse_case(rod()), "steel").density == 7850.0
    with pytest.raises(CaseError, match="unknown material; did you mean 'steel'"):
        material(parse_case(rod()), "steeel")


def test_shipped_cases_are_found_by_name() -> None:
    assert shipped_path("demo") == shipped()["demo"]
    with pytest.raises(CaseError, match="no shipped case of this name; did you mean 'taylor_copper'"):
        shipped_path("taylor_coper")


def test_a_message_never_shows_a_long_value() -> None:
    found = problems("parts[0].material=" + "x" * 5000, "title=[" + "1," * 5000 + "]")
    assert all(len(str(problem)) < 400 for problem in found)


def test_overrides_by_key_are_those_that_are_written() -> None:
    data = {"run": {"end_time": 1.0}, "parts": [{"velocity": [0, 0, 1]}]}
    written = apply_overrides(data, ["run.ranks=2", "run.end_time='80 us'", "parts[0].velocity[2]=-200"])
    assert apply_overrides(data, {"run.ranks": 2, "run.end_time": "80 us", "parts[0].velocity[2]": -200}) == written
    assert apply_overrides(data, {"run": {"ranks": 2, "end_time": "80 us"}, "parts[0].velocity[2]": -200}) == written
    with pytest.raises(CaseError, match=r"parts\[3\]\.name = 'x'"):
        apply_overrides(data, {"parts[3].name": "x"})
