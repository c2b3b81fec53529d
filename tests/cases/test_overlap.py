"""Overlapping primitives are found before meshing, together with all other errors; bodies that only touch are valid."""

from pathlib import Path
from typing import Any

import pytest

from conoid.cases.checks.overlap import grazes
from conoid.cases.load import CaseError, parse_case
from conoid.worker.errors import InputError
from conoid.worker.scene import assembly

BALL = {"shape": "sphere", "radius": 3e-3, "centre": [0, 0, 3e-3], "element_size": 1e-3}
BLOCK = {"shape": "box", "low": [-5e-3, -5e-3, -4e-3], "high": [5e-3, 5e-3, 0], "element_size": 1e-3,
         "generator": "structured"}  # fmt: skip
ROD = {"shape": "cylinder", "radius": 2e-3, "length": 8e-3, "base": [0, 0, 0], "element_size": 1e-3}
TUBE = {"shape": "tube", "inner_radius": 2e-3, "radius": 4e-3, "length": 8e-3, "element_size": 1e-3}


def scene(one: dict[str, Any], other: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Returns a case of two parts of steel."""
    parts = [{"name": name, "material": "steel", "mesh": mesh} for name, mesh in (("one", one), ("other", other))]
    return {"name": "two", "run": {"end_time": "1 us"}, "parts": parts, **more}


def warned(data: dict[str, Any]) -> list[str]:
    """Returns the problems of a case that are about overlap."""
    try:
        parse_case(data)
    except CaseError as error:
        return [str(problem) for problem in error.problems if "overlaps" in problem.message]
    return []


@pytest.mark.parametrize(
    ("one", "other", "depth"),
    [
        (BLOCK, {**BALL, "centre": [0, 0, 2e-3]}, 1e-3),
        (BLOCK, {**BALL, "centre": [0, 0, -2e-3]}, 4e-3),
        (BLOCK, {**BLOCK, "low": [4e-3, -5e-3, -4e-3], "high": [9e-3, 5e-3, 0]}, 1e-3),
        (ROD, {**ROD, "axis": "x", "base": [-4e-3, 0, 4e-3]}, 3.8e-3),
        (TUBE, {**ROD, "radius": 2.5e-3}, 4.8e-3),
    ],
)
def test_bodies_that_overlap(one: dict[str, Any], other: dict[str, Any], depth: float) -> None:
    (line,) = warned(scene(one, other))
    assert line.startswith("parts[1].mesh: 'other' overlaps parts[0], 'one', by about ")
    assert float(line.split("about ")[1].split()[0]) == pytest.approx(depth, rel=0.1)
    assert line.endswith(" m or more; move them apart, or set contact.overlap = 'push'")


def test_tied_bodies_may_overlap_by_the_gap_of_their_bond() -> None:
    """The default gap of the bond is 0.1 mm for facets of 1 mm. A rod that fills a tube and is bonded to the tube gives
    no warning about contact.
    """
    upper = {**BLOCK, "low": [-5e-3, -5e-3, -5e-5], "high": [5e-3, 5e-3, 4e-3]}
    bond = {"parts": ["other", "one"], "kind": "tied"}
    assert len(warned(scene(BLOCK, upper))) == 1
    assert warned(scene(BLOCK, upper, bond=[bond])) == []
    (line,) = warned(scene(BLOCK, upper, bond=[{**bond, "gap": "0.01 mm"}]))
    assert line.endswith(
        "by about 5e-05 m or more; the gap of their bond, 1e-05 m, is less; move them apart, or raise it"
    )
    assert warned({**scene(BLOCK, upper, bond=[bond, 3, {"parts": 7}]), "run": {}}) == []
    assert len(list(grazes(parse_case(scene(TUBE, ROD))))) == 1
    for kind in ("tied", "shared"):
        assert not list(grazes(parse_case(scene(TUBE, ROD, bond=[{**bond, "kind": kind}]))))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (BLOCK, BALL),
        (BLOCK, {**BLOCK, "low": [5e-3, -5e-3, -4e-3], "high": [9e-3, 5e-3, 0]}),
        (TUBE, ROD),
        (TUBE, {**ROD, "radius": 2.04e-3}),
        (BALL, {**BALL, "centre": [0, 0, 9e-3]}),
        (
            {**BALL, "centre": [0, 0, 0], "sector": "half"},
            {**BLOCK, "low": [-5e-3, -2e-3, -2e-3], "high": [0, 2e-3, 2e-3]},
        ),
    ],
)
def test_bodies_that_touch_or_are_cut_away_do_not(one: dict[str, Any], other: dict[str, Any]) -> None:
    """Facets of 1 mm may cut off 0.06 mm of the tube and of a rod that is 0.04 mm too wide; therefore only the worker
    can decide about the overlap.
    """
    assert warned(scene(one, other)) == []


def test_turned_bodies_are_where_they_are_turned_to() -> None:
    far = {**BLOCK, "low": [6e-3, -1e-3, -4e-3], "high": [9e-3, 1e-3, 0]}
    data = scene(BLOCK, far)
    assert warned(data) == []
    data["parts"][1]["turn"] = {"axis": "z", "angle": "180 deg", "centre": [5e-3, 0, 0]}
    assert len(warned(data)) == 1


@pytest.mark.parametrize("angle", [30, 45, 60, 90, 120, 150])
def test_turned_bodies_that_touch_do_not(angle: int) -> None:
    """At 30 degrees the tested points lie on the common face up to rounding errors."""
    turn = {"axis": "z", "angle": f"{angle} deg", "centre": ["0.7 mm", "0.3 mm", "0.1 mm"]}
    block = {**BLOCK, "low": [0, 0, 0], "high": [2e-3, 2e-3, 2e-3]}
    data = scene(block, {**block, "low": [2e-3, 0, 0], "high": [4e-3, 2e-3, 2e-3]})
    for part in data["parts"]:
        part["turn"] = turn
    assert warned(data) == []
    data["parts"][1]["mesh"]["low"] = [1.7e-3, 0, 0]
    assert len(warned(data)) == 1


@pytest.mark.parametrize("contact", ["none", {"overlap": "push"}, {"parts": ["one"]}])
def test_bodies_that_need_not_be_apart(contact: object) -> None:
    assert warned(scene(BLOCK, {**BALL, "centre": [0, 0, 0]}, contact=contact)) == []


def test_overlap_and_unknown_materials_are_reported_with_all_other_problems() -> None:
    data = scene(BLOCK, {**BALL, "centre": [0, 0, 1e-3]})
    data["parts"][0]["material"] = "stel"
    data["parts"].append({"name": "third", "material": "copper_ofhcc", "mesh": {"shape": "ball"}})
    data["run"]["ranks"] = 0
    with pytest.raises(CaseError) as caught:
        parse_case(data)
    keys = [problem.key for problem in caught.value.problems]
    assert sorted(keys) == [
        "parts[0].material",
        "parts[1].mesh",
        "parts[2].material",
        "parts[2].mesh.shape",
        "run.ranks",
    ]


@pytest.mark.parametrize("parts", [3, [], [3], [{}], [{"material": ["steel"]}], {"material": "steel"}])
def test_unknown_parts_are_reported_once(parts: object) -> None:
    with pytest.raises(CaseError) as caught:
        parse_case({"name": "a", "run": {"end_time": "1 us"}, "parts": parts, "contact": 7, "materials": []})
    keys = [problem.key for problem in caught.value.problems]
    assert len(keys) == len(set(keys))


def test_problems_of_the_reader_are_refused_by_the_worker_too() -> None:
    data = scene(BLOCK, {**BLOCK, "low": [4e-3, -3e-3, -3e-3], "high": [9e-3, 3e-3, -1e-3]})
    assert warned(data)
    pushed = parse_case({**data, "contact": {"overlap": "push"}})
    assert pushed.contact is not None
    refused = pushed.model_copy(update={"contact": pushed.contact.model_copy(update={"overlap": "refuse"})})
    with pytest.raises(InputError, match="overlaps"):
        assembly.assemble(refused, Path())


def test_many_bodies_cost_little_time() -> None:
    """Two hundred tubes are inside of each other: of 20,000 pairs of tubes only the first pairs are tested."""
    shells = [{**TUBE, "inner_radius": 1e-3 * k + 1e-3, "radius": 1e-3 * k + 2e-3} for k in range(200)]
    parts = [{"name": f"shell_{k}", "material": "steel", "mesh": shell} for k, shell in enumerate(shells)]
    assert warned({"name": "shells", "run": {"end_time": "1 us"}, "parts": parts}) == []


@pytest.mark.parametrize(
    ("one", "other", "close"),
    [
        (TUBE, ROD, True),
        (ROD, TUBE, True),
        (TUBE, {**ROD, "radius": 1.9e-3, "base": [0.09e-3, 0, 0]}, True),
        (TUBE, {**TUBE, "inner_radius": 1e-3, "radius": 1.97e-3, "element_size": 0.9e-3}, True),
        (TUBE, {**ROD, "radius": 1.9e-3}, False),
        (TUBE, {**ROD, "base": [0, 0, 8e-3]}, False),
        (TUBE, {**ROD, "base": [9e-3, 0, 0]}, False),
        (TUBE, {**ROD, "axis": "x", "radius": 1e-3, "base": [-9e-3, 0, 9e-3]}, False),
        (ROD, {**ROD, "base": [0, 0, 8e-3]}, False),
    ],
)
def test_a_rod_that_fills_a_tube_gets_a_warning(one: dict[str, Any], other: dict[str, Any], close: bool) -> None:
    """Facets cut 0.06 mm off the hole of the tube."""
    data = scene(one, other, contact={})
    case = parse_case(data)
    found = [str(doubt) for doubt in grazes(case)]
    assert len(found) == close
    assert all("may overlap; contact.overlap = 'push' moves them apart" in line for line in found)
    pushed = parse_case({**data, "contact": {"overlap": "push"}})
    assert list(grazes(pushed)) == []
