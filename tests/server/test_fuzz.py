"""The REST interface is compared with its own description by schemathesis, with given cases and runs; the test is
skipped without schemathesis.
"""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.messages import Status
from conoid.cases.output import layout
from conoid.cases.run import State

from .journal_lines import lines_of_run, write
from .running import Process, User, case_text, processes

REJECTED, ACCEPTED = "ST202", "ST201"
"""Codes of schemathesis for two findings: the server refuses a request that satisfies the schema; the server accepts a
request that violates the schema."""
ALLOWED = {
    (REJECTED, "POST /v1/runs"): "a case makes sense beyond its schema; labels have a form",
    (REJECTED, "POST /v1/sweeps"): "as a case, and as many points as are allowed",
    (REJECTED, "POST /v1/runs/{run_id}:restart"): "an Idempotency-Key is of visible ASCII; a number of ranks that fits",
    (REJECTED, "GET /v1/runs"): "a cursor is that of a page, labels have a form",
    (REJECTED, "GET /v1/runs/{run_id}/stream"): "Last-Event-ID 'null' is a header that is there",
    (ACCEPTED, "GET /v1/runs/{run_id}/stream"): "an empty Last-Event-ID is none, as browsers send it",
    (ACCEPTED, "POST /v1/cases:validate"): "it answers 200 where it finds a case wrong",
}
"""Findings of schemathesis that are no faults of the server, each with the reason. A removed run is also answered with
410, which schemathesis does not expect."""
EXAMPLES = 30
"""Number of examples for each route in each phase."""
PHASES = ("examples", "coverage", "fuzzing", "stateful")
TAKE_CASES = ("POST /v1/runs", "POST /v1/cases:validate", "POST /v1/sweeps")
ENDED = 12
"""Number of finished runs, which requests may read and remove."""


@pytest.fixture(scope="module")
def ann(tmp_path_factory: pytest.TempPathFactory) -> Iterator[User]:
    with processes(tmp_path_factory.mktemp("fuzz")) as make:
        server: Process = make("--no-zenoh", "--max-queued", "100000")
        yield server.user(server.start()["url"])


def seeds(ann: User, place: Path) -> dict[str, list[Any]]:
    """Returns values of parameters that name something: finished runs, a running run, a sweep, and files of these
    runs.
    """
    runs = [ann.submit() for _ in range(ENDED)]
    for run in runs:
        ann.wait_for(run)
        speak(ann.runs / run)
    lives = ann.submit(wait=str(place / "never"))
    ann.wait_for(lives, State.RUNNING)
    sweep = ann.http.post("/v1/sweeps", json=wish()).json()["id"]
    return {
        "run_id": [*runs, lives], "sweep_id": [sweep], "path": ["case.toml", "log/rank-0.log", "outcome.json"],
        "rank": ["0", "launcher"], "name": ["bar_on_bar"], "n": [0, 1],
    }  # fmt: skip


def speak(folder: Path) -> None:
    """Adds to the journal messages that the fake worker does not write: reports, a balance event, a snapshot."""
    sent = [message for message in lines_of_run(100) if not isinstance(message, Status)]
    write(folder, iter(sent), after=len((folder / layout.JOURNAL).read_bytes().splitlines()))
    layout.snapshot(folder, 0).parent.mkdir()
    layout.snapshot(folder, 0).write_bytes(b"99")


def wish() -> dict[str, Any]:
    """Returns the request body of a sweep of two points."""
    return {"case": tomllib.loads(case_text()), "points": [{"run.end_time": "1 us"}, {"run.end_time": "2 us"}]}


def seeded(schema: dict[str, Any], known: dict[str, list[Any]]) -> dict[str, Any]:
    """Returns the description of the interface with useful values in place of arbitrary text."""
    bodies = {
        "application/toml": case_text(), "application/json": tomllib.loads(case_text()), "/v1/sweeps": wish(),
    }  # fmt: skip
    for path, operations in schema["paths"].items():
        for operation in operations.values():
            for parameter in operation.get("parameters", []):
                if parameter["in"] == "path" and parameter["name"] in known:
                    parameter["schema"] = {**parameter["schema"], "enum": known[parameter["name"]]}
            for kind, content in operation.get("requestBody", {}).get("content", {}).items():
                content["example"] = bodies.get(path, bodies[kind])
    return schema


def hooked() -> dict[str, str]:
    """Returns environment variables with which schemathesis can write TOML."""
    return {**os.environ, "PYTHONPATH": str(Path(__file__).parent), "SCHEMATHESIS_HOOKS": "fuzz_toml"}


def hold_whole(report: dict[str, Any], schema: str) -> None:
    """Requires that every phase of schemathesis has ended without an error on every route, and that valid cases were
    accepted.
    """
    ended = {name: report["phases"][name]["status"] for name in PHASES}
    assert set(ended.values()) <= {"success", "failure"}, f"{ended}\n{schema[-6000:]}"
    assert report["complete"]
    assert not report["errors"], schema[-6000:]
    operations = report["operations"]
    assert operations["tested"] == operations["total"]
    for route in TAKE_CASES:
        assert report["valid_rates"][route]["examples"]["accepted"] >= 1, f"{route}: {report['valid_rates'][route]}"


def failures(output: str, paths: Iterable[str]) -> list[tuple[str, str, str]]:
    """Returns the findings of schemathesis: the code of the check, the route and the status of the answer.

    The output of schemathesis has a block for each route, and a block for all sequences of requests; in a sequence the
    last request has failed. The argument ``paths`` has the paths of the description.
    """
    text = output.partition("= FAILURES =")[2].rpartition("= SUMMARY =")[0]
    found = []
    for block in re.split(r"^_{3,} (?=[A-Z]+ /|Stateful)", text, flags=re.MULTILINE)[1:]:
        for case in re.split(r"^\d+\. Test Case ID", block, flags=re.MULTILINE)[1:]:
            status = re.search(r"^\[(\d+)\]", case, re.MULTILINE)
            codes = re.findall(r"^- (ST\d+)", case, re.MULTILINE)
            title = block.partition(" _")[0]
            route = last_route(case, paths) if title.startswith("Stateful") else title
            found += [(code, route, status[1] if status else "") for code in codes]
    return found


def last_route(case: str, paths: Iterable[str]) -> str:
    """Returns the route of the last request that reproduces a finding; empty if the description has no such route."""
    asked = re.findall(r"^ *curl -X ([A-Z]+) .*https?://[^/ ]+(/[^\s?']*)", case, re.MULTILINE)
    if not asked:
        return ""
    method, url = asked[-1]
    likely = [path for path in paths if re.fullmatch(re.sub(r"\\{\w+\\}", ".+", re.escape(path)), url)]
    return f"{method} {max(likely, key=lambda path: path.count('/'))}" if likely else ""


def test_a_run_that_did_not_start_is_no_success() -> None:
    """The check must fail for a phase that stopped early, an error, a missing route, or cases that were all refused."""
    rates = {route: {"examples": {"accepted": 1}} for route in TAKE_CASES}
    phases = {name: {"status": "success"} for name in PHASES}
    good = {
        "phases": phases, "complete": True, "errors": [], "operations": {"tested": 31, "total": 31},
        "valid_rates": rates,
    }  # fmt: skip
    hold_whole(good, "")
    for wrong in (
        {"phases": {**phases, "fuzzing": {"status": "error"}}},
        {"phases": {**phases, "examples": {"status": "skip"}}},
        {"complete": False},
        {"errors": [{"title": "Schema Error", "count": 1}]},
        {"operations": {"tested": 30, "total": 31}},
        {"valid_rates": {**rates, "POST /v1/runs": {"examples": {"accepted": 0}}}},
    ):
        with pytest.raises(AssertionError):
            hold_whole({**good, **wrong}, "")


def test_the_result_of_a_row_of_requests_belongs_to_the_last_request() -> None:
    output = """= FAILURES =
____ POST /v1/sweeps ____
1. Test Case ID: a
- ST202 Schema-valid request rejected
[422] Unprocessable Content:
____ Stateful tests ____
1. Test Case ID: b
- ST201 Schema-violating request accepted
[204] No Content:
    curl -X GET http://127.0.0.1:1/v1/runs
    curl -X GET -H 'last-event-id;' 'http://127.0.0.1:1/v1/runs/1k0/stream?after=72'
= SUMMARY ="""
    paths = ["/v1/runs", "/v1/runs/{run_id}", "/v1/runs/{run_id}/stream"]
    found = [("ST202", "POST /v1/sweeps", "422"), ("ST201", "GET /v1/runs/{run_id}/stream", "204")]
    assert failures(output, paths) == found


@pytest.mark.slow
def test_no_request_fails_the_server_or_its_schema(ann: User, tmp_path: Path) -> None:
    pytest.importorskip("schemathesis", reason="pip install schemathesis")
    description = ann.http.get("/openapi.json").json()
    (tmp_path / "openapi.json").write_text(json.dumps(seeded(description, seeds(ann, tmp_path))))
    # The speed of making requests depends on the machine, not on the server.
    command = [
        sys.executable, "-c", "from schemathesis.cli import schemathesis; schemathesis()", "run",
        str(tmp_path / "openapi.json"), "--url", str(ann.http.base_url),
        "--header", f"Authorization: {ann.http.headers['authorization']}", "--checks", "all",
        "--max-examples", str(EXAMPLES), "--phases", ",".join(PHASES), "--continue-on-failure",
        "--seed", "1", "--suppress-health-check", "too_slow", "--request-timeout", "70", "--no-color",
        "--report-json-path", str(tmp_path / "report.json"),
    ]  # fmt: skip
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=3000, check=False, cwd=tmp_path, env=hooked()
    )
    summary = done.stdout.rpartition("= SUMMARY =")[2]
    print(summary)
    assert "Tested: " in summary, done.stderr + done.stdout[-2000:]
    report = json.loads((tmp_path / "report.json").read_bytes())
    hold_whole(report, done.stdout)
    found = failures(done.stdout, description["paths"])
    assert len(found) == sum(kind["count"] for kind in report["failures"]), "each is read"
    wrong = [one for one in found if one[:2] not in ALLOWED and one[2] != "410"]
    assert not wrong, f"{wrong}\n{done.stdout[-6000:]}"
    assert ann.wait_for(ann.submit())["state"] == "succeeded"
