"""Tests of the verification catalogue: its rows name existing cases and tests, and failures are red."""

import ast
from pathlib import Path
from typing import Any

from conoid.cases.load import shipped
from conoid.cases.suite import suite

from .book import catalogue
from .pages import GREEN, GREY, RED, book

TESTS = Path(__file__).parents[1]


def functions(path: Path) -> set[str]:
    return {node.name for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)}


def test_the_catalogue_names_tests_and_cases_that_exist() -> None:
    for row in catalogue():
        assert row.get("tests") or row.get("cases") or row.get("open"), row["id"]
        assert set(row.get("cases", ())) <= set(shipped())
        for node in row.get("tests", ()):
            file, _, name = node.partition("::")
            assert not name or name in functions(TESTS / file), node


def test_rows_are_there_once_and_the_hard_suite_has_no_others() -> None:
    ids = [row["id"] for row in catalogue()]
    assert len(ids) == len(set(ids))
    assert {row for hard in suite() for row in hard.rows} <= set(ids)
    assert [f"H{k}" for k in range(1, 28)] == [name for name in ids if name.startswith("H")]


def part(found: Any) -> dict[str, Any]:
    return {"found": found, "wall": 60.0, "quick": True, "machine": {"processor": "a machine"}}


def outcome(value: float, passed: bool) -> dict[str, Any]:
    check = {"name": "extent", "value": value, "expected": 2.0, "tolerance": 0.1, "pass": passed, "unit": "m"}
    return {"state": "succeeded", "message": "", "cpu": 1.5, "elements": 100, "worst_residual": 1e-6, "steps": 9,
            "reference": [{**check, "source": "theory"}]}  # fmt: skip


def test_failed_rows_are_red_and_rows_without_a_run_are_grey() -> None:
    rows: list[dict[str, Any]] = [
        {"id": "V1", "what": "good", "cases": ["a"]}, {"id": "V2", "what": "bad", "cases": ["b"]},
        {"id": "V3", "what": "open", "open": "nothing"}, {"id": "V4", "what": "test", "tests": ["x.py::test_y"]},
        {"id": "H1", "what": "hard"},
    ]  # fmt: skip
    runs = {"a|as it is": outcome(2.05, True), "a|coarser": outcome(3.0, False), "b|as it is": outcome(2.2, False)}
    held = {"held": {"7": ["a < b", "1 < 2"]}, "why": "", "cpu": 0.5, "says": ""}
    recorded = {"tests/x.py::test_y[1]": {"outcome": "failed", **held}}
    hard = {"hard": {"name": "h", "rows": ["H1"]}, "title": "t", "outcome": outcome(2.0, True), "drifted": None,
            "faults": ["hung"]}  # fmt: skip
    text, failed = book(rows, {"shipped": part({"runs": runs}), "tests": part(recorded), "hard": part([hard])})
    marks = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")][2:7]
    assert marks == [GREEN, RED, GREY, RED, RED]
    assert failed == 3
    assert "V2, V4, H1 fail" in text
    assert "+10 %" in text
    assert "- 🔴 h: hung" in text
