"""Sets of mesh files that a case selects with ``on``: their content before a run, and errors of one line."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from conoid.cases.load import parse_case
from conoid.cases.reading.problems import CaseError
from conoid.cases.reading.survey import Survey
from conoid.worker.scene.survey import surveyed

from ..mesh.bars import bar

BOX = {"shape": "box", "low": [0, "9 mm", 0], "high": ["1 mm", "10 mm", "1 mm"], "element_size": "1 mm"}
PULL = {"kind": "traction", "stress": ["1 MPa", 0, 0]}
HOLD = {"kind": "velocity", "x": 0.0}


def survey(
    place: Path, *boundaries: Mapping[str, object], probes: tuple[Mapping[str, object], ...] = (), more: str = ""
) -> Survey:
    bar(place / "bar.inp", more=more)
    bar(place / "other.inp", (3, 2, 2))
    file = {"shape": "file", "unit": "1 mm"}
    parts = [
        {"name": "bar", "material": "steel", "mesh": {**file, "path": "bar.inp"}},
        {
            "name": "stub",
            "material": "steel",
            "mesh": {**file, "path": "other.inp"},
            "turn": {"axis": "z", "angle": "90 deg", "centre": ["-9 mm", 0, 0]},
        },
        {"name": "box", "material": "steel", "mesh": {**BOX, "generator": "structured"}},
    ]
    case = {
        "name": "held",
        "run": {"end_time": "1 us"},
        "parts": parts,
        "boundaries": list(boundaries),
        "probes": list(probes),
    }
    return surveyed(parse_case(case), place, compiled=False)


def test_sets_are_counted_before_a_run(tmp_path: Path) -> None:
    found = survey(
        tmp_path,
        {**HOLD, "on": "clamp", "parts": ["bar"]},
        {**PULL, "on": "END", "parts": ["bar"]},
        {**PULL, "on": "TIP", "parts": ["bar"], "high": ["99 mm", "1 mm", "2 mm"], "low": [0, 0, 0]},
        {"kind": "traction", "pressure": "1 MPa", "on": "SKIN", "parts": ["stub"]},
    )
    assert found.refused == []
    counts = [(load.nodes, load.faces, load.area and round(1e6 * load.area, 9)) for load in found.loads]
    assert counts == [(9, None, None), (None, 8, 4.0), (None, 4, 2.0), (None, 64, 32.0)]


@pytest.mark.parametrize(
    ("boundary", "more", "message"),
    [
        (
            {"on": "GRIP", "parts": ["bar"]},
            "",
            "'GRIP': the mesh of 'bar' has no set of this name; known: CLAMP, TIP, END",
        ),
        (
            {"on": "END"},
            "",
            "'END': sets of several files have this name, in 'bar', 'stub'; name the parts that are meant",
        ),
        (
            {"on": "CLAMP", "parts": ["bar"]},
            "*SURFACE, NAME=Clamp\nLAST, S4",
            "'CLAMP': means 2 sets that differ; write 'nodes:CLAMP' or 'surface:CLAMP'",
        ),
        ({"on": "NOTHING", "parts": ["bar"]}, "*NSET, NSET=NOTHING", "'NOTHING': no node of 'bar' is in it"),
    ],
)
def test_a_set_of_the_wrong_kind_is_refused_in_one_line(
    boundary: Mapping[str, object], more: str, message: str, tmp_path: Path
) -> None:
    (line,) = survey(tmp_path, {**HOLD, **boundary}, more=more).refused
    assert line.startswith(f"boundaries[0].on = {message}")
    probe = {"name": "p", "part": "bar", "field": "velocity_x", "on": boundary["on"]}
    if "parts" in boundary:
        assert survey(tmp_path, probes=(probe,), more=more).refused == [line.replace("boundaries", "probes")]


def test_a_kind_before_a_colon_distinguishes_sets_of_one_name(tmp_path: Path) -> None:
    more = "*SURFACE, NAME=CLAMP\nLAST, S4"
    boundaries = [{**HOLD, "on": f"{kind}:CLAMP", "parts": ["bar"]} for kind in ("nodes", "surface")]
    found = survey(tmp_path, boundaries[0], more=more)
    assert (found.refused, [load.nodes for load in found.loads]) == ([], [9])
    assert [load.nodes for load in survey(tmp_path, boundaries[1], more=more).loads] == [9]


def test_a_set_off_its_plane_of_symmetry_is_refused(tmp_path: Path) -> None:
    plane = {"kind": "symmetry", "axis": "x", "on": "CLAMP", "parts": ["bar"]}
    assert survey(tmp_path, plane).refused == []
    (line,) = survey(tmp_path, {**plane, "axis": "y"}).refused
    assert line.startswith("boundaries[0].on = 'CLAMP': nodes of the set are up to 0.002 m off the plane y = 0 m")


def test_faces_amid_a_body_bear_nothing(tmp_path: Path) -> None:
    found = survey(tmp_path, {**PULL, "on": "INNER", "parts": ["bar"]})
    assert found.refused == ["boundaries[0]: no face of its meshes lies in its region"]


def test_generated_parts_have_no_sets(tmp_path: Path) -> None:
    with pytest.raises(CaseError) as raised:
        survey(
            tmp_path,
            {**HOLD, "on": "CLAMP", "parts": ["box"]},
            probes=({"name": "p", "part": "bar", "field": "contact_force_x", "on": "TIP"},),
        )
    assert str(raised.value).splitlines() == [
        "boundaries[0].on = 'CLAMP': only meshes from files have sets; the mesh of 'box' is generated",
        "probes[0].on = 'TIP': is allowed with means, peaks and sums only; "
        "remove on, or use another field than 'contact_force_x'",
    ]
