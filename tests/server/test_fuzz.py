"""The REST interface against its own description: schemathesis, where it is installed."""

import re
import subprocess
import sys
from collections.abc import Iterator

import pytest

from .running import Process, User, processes

TOLERATED = {"ST202", "ST201"}
"""Checks that compare what is accepted with the schema: a case must make sense beyond its schema (names that exist,
bodies that do not overlap), and :validate answers 200 where it finds a case wrong."""


@pytest.fixture(scope="module")
def ann(tmp_path_factory: pytest.TempPathFactory) -> Iterator[User]:
    with processes(tmp_path_factory.mktemp("fuzz")) as make:
        server: Process = make("--no-zenoh")
        yield server.user(server.start()["url"])


@pytest.mark.slow
def test_no_request_fails_the_server_or_its_schema(ann: User) -> None:
    pytest.importorskip("schemathesis", reason="pip install schemathesis")
    ann.wait_for(ann.submit())
    command = [
        sys.executable, "-c", "from schemathesis.cli import schemathesis; schemathesis()", "run",
        f"{ann.http.base_url}/openapi.json", "--header", f"Authorization: {ann.http.headers['authorization']}",
        "--checks", "all", "--max-examples", "50", "--phases", "examples,coverage,fuzzing", "--no-color",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=1800, check=False)
    summary = done.stdout.rpartition("= SUMMARY =")[2]
    assert "Tested: " in summary, done.stderr + done.stdout[-2000:]
    failed = set(re.findall(r"❌ (ST\d+)", summary))
    assert failed <= TOLERATED, done.stdout[-4000:]
