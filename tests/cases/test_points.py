"""The table of a sweep has numbers, units in the header, every probe and every reference."""

import csv
import io
import math
from typing import Any

import pytest

from conoid.cases.outcome import Check, Measured, Outcome, from_json, to_json
from conoid.cases.output.points import KEY, RESULT, Point, in_one_unit, results, safe, table, to_csv
from conoid.cases.reference.key_units import unit_of_key


@pytest.mark.parametrize(
    ("values", "unit", "numbers"),
    [
        (["-300 m/s", "-500 m/s"], "m/s", [-300, -500]),
        (["0.4 mm", "400 um", 0.001], "mm", [0.4, 0.4, 1.0]),
        ([200, 300.5], "m/s", [200, 300.5]),
        (["1e2 m/s", None], "m/s", [100.0, None]),
        (["1 mm", "1 us"], "", ["1 mm", "1 us"]),
        (["1 mn", "2 m"], "", ["1 mn", "2 m"]),
        (["instant", 2], "", ["instant", "2"]),
        ([True, [0, "1 m/s"]], "", ["true", '[0,"1 m/s"]']),
    ],
)
def test_values_of_a_key_are_numbers_in_one_unit(values: list[Any], unit: str, numbers: list[Any]) -> None:
    assert in_one_unit("parts[0].velocity[2]", values) == (unit, numbers)


def test_the_unit_of_a_bare_number_is_that_of_the_model() -> None:
    keys = ("parts[3].velocity[2]", "run.end_time", "materials.steel.density", "run.ranks", "parts[0].mesh.radius", "x")
    assert [unit_of_key(key) for key in keys] == ["m/s", "s", "kg/m^3", "", "m", ""]
    assert unit_of_key("reference[0].value") == "", "that of its quantity"


def test_every_probe_and_every_reference_has_its_columns() -> None:
    probes = [
        Measured(name="v", value=412.5, unit="m/s", least=-1.0, most=500.0),
        Measured(name="hole", value=math.nan, unit="m"),
    ]
    check = Check(name="probe_mean v", value=2.0, expected=1.0, tolerance=0.1, passed=False, unit="m/s")
    ended = from_json(to_json(Outcome(state="succeeded", probes=probes, reference=[check, check], warnings=["w"])))
    found = {column.title: column.values for column in table([Point(values={"a": 1}, results=results(ended))])}
    assert [found[f"probe.v{which} [m/s]"] for which in ("", ".min", ".max")] == [[412.5], [-1.0], [500.0]]
    assert found["probe.hole [m]"] == found["probe.hole.max [m]"] == [None]
    assert found["reference.probe_mean v [m/s]"] == found["reference.probe_mean v (2) [m/s]"] == [2.0]
    assert (found["reference.probe_mean v.passed"], found["warnings"]) == (["no"], [1])


def test_a_line_of_the_csv_is_a_point_whether_it_has_ended_or_not() -> None:
    ended = Outcome(state="succeeded", steps=3)
    made = table([
        Point(values={"run.end_time": "1 us", "note": "=1+1"}, run="r1", state="running"),
        Point(values={"run.end_time": "2 us"}, run="r2", state="succeeded", results=results(ended)),
    ])  # fmt: skip
    assert [column.kind for column in made][:2] == [KEY, KEY]
    assert made[-1].kind == RESULT
    lines = list(csv.DictReader(io.StringIO(to_csv(made))))
    assert [(line["run.end_time [us]"], line["note"], line["run"], line["steps"]) for line in lines] == [
        ("1", "'=1+1", "r1", ""), ("2", "", "r2", "3"),
    ]  # fmt: skip


@pytest.mark.parametrize("text", ["=1+1", "@SUM(A1)", "+cmd|' /C calc'!A0", "-2+3+cmd|x", "\t=1", "\r=1", "- 1", "+-1"])
def test_a_text_that_a_spreadsheet_would_compute_is_marked_as_text(text: str) -> None:
    assert safe(text) == f"'{text}"


@pytest.mark.parametrize("value", ["-1", "+1.5e-3", "-210 m/s", "-.5 kg/m^3", "-1e6 Pa", "steel", "", 3, -2.5, None])
def test_numbers_and_names_stand_in_a_table_as_they_are(value: int | float | str | None) -> None:
    assert safe(value) == value
