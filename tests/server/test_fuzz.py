"""The REST interface against its own description: schemathesis, where it is installed, seeded with cases and runs."""

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.run import State

from .running import Process, User, case_text, processes

TOLERATED = {"ST202", "ST201"}
"""Checks that compare what is accepted with the schema: a case must make sense beyond its schema (names that exist,
bodies that do not overlap), and :validate answers 200 where it finds a case wrong."""
EXAMPLES = 30
"""Of each route in each phase."""
ENDED = 12
"""Runs that may be asked for, and removed."""


@pytest.fixture(scope="module")
def ann(tmp_path_factory: pytest.TempPathFactory) -> Iterator[User]:
    with processes(tmp_path_factory.mktemp("fuzz")) as make:
        server: Process = make("--no-zenoh", "--max-queued", "100000")
        yield server.user(server.start()["url"])


def seeds(ann: User, place: Path) -> dict[str, list[Any]]:
    """Values of the parameters that name something: runs that have ended, one that runs, a sweep, their files."""
    runs = [ann.submit() for _ in range(ENDED)]
    for run in runs:
        ann.wait_for(run)
    lives = ann.submit(wait=str(place / "never"))
    ann.wait_for(lives, State.RUNNING)
    sweep = ann.http.post("/v1/sweeps", json=wish()).json()["id"]
    return {
        "run_id": [*runs, lives], "sweep_id": [sweep], "path": ["case.toml", "log/rank-0.log", "outcome.json"],
        "rank": [0], "name": ["bar_on_bar"],
    }  # fmt: skip


def wish() -> dict[str, Any]:
    """A sweep of two points."""
    return {"case": tomllib.loads(case_text()), "points": [{"run.end_time": "1 us"}, {"run.end_time": "2 us"}]}


def seeded(schema: dict[str, Any], known: dict[str, list[Any]]) -> dict[str, Any]:
    """The description with values that mean something in the places where any text would do."""
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


@pytest.mark.slow
def test_no_request_fails_the_server_or_its_schema(ann: User, tmp_path: Path) -> None:
    pytest.importorskip("schemathesis", reason="pip install schemathesis")
    description = ann.http.get("/openapi.json").json()
    (tmp_path / "openapi.json").write_text(json.dumps(seeded(description, seeds(ann, tmp_path))))
    command = [
        sys.executable, "-c", "from schemathesis.cli import schemathesis; schemathesis()", "run",
        str(tmp_path / "openapi.json"), "--url", str(ann.http.base_url),
        "--header", f"Authorization: {ann.http.headers['authorization']}", "--checks", "all",
        "--max-examples", str(EXAMPLES), "--phases", "examples,coverage,fuzzing,stateful", "--continue-on-failure",
        "--seed", "1", "--request-timeout", "70", "--no-color",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=3000, check=False, cwd=tmp_path)
    summary = done.stdout.rpartition("= SUMMARY =")[2]
    print(summary)
    assert "Tested: " in summary, done.stderr + done.stdout[-2000:]
    failed = set(re.findall(r"❌ (ST\d+)", summary))
    assert failed <= TOLERATED, done.stdout[-6000:]
    assert ann.wait_for(ann.submit())["state"] == "succeeded"
