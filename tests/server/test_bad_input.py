"""Bad input to a real server gets one line with the key, the value and the allowed values; the next run succeeds."""

from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from .running import TOML, Process, User, case_text, processes

BEFORE, AFTER = case_text().split("[parts.mesh]")
MESH = f"""{BEFORE}[parts.mesh]
shape = "file"
path = "rod.msh"
unit = "1 mm"
{AFTER.partition('generator = "structured"')[2]}"""
STEEL = 'material = "steel"'


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    with processes(tmp_path_factory.mktemp("bad")) as make:
        yield make()


@pytest.fixture(scope="module")
def users(server: Process) -> tuple[User, User]:
    url = server.start()["url"]
    return server.user(url, "ann"), server.user(url, "bob")


def line(answer: httpx2.Response, status: int) -> str:
    """Returns the one line of the error message."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = answer.json()
    assert "Traceback" not in answer.text
    assert "\n" not in problem["detail"]
    return str(problem["detail"])


def changed(old: str, new: str) -> str:
    """Returns the valid case with a change."""
    assert old in case_text()
    return case_text().replace(old, new)


@pytest.mark.parametrize(
    ("text", "key", "value", "allowed"),
    [
        (case_text(extra="sampels = 30"), "run.sampels", "", "samples"),
        (changed('"1 us"', '"1 mm"'), "run.end_time", "1 mm", "time"),
        (changed('"1 us"', "nan"), "run.end_time", "nan", "finite"),
        (changed(STEEL, 'material = "steal"'), "parts[0].material", "steal", "steel"),
        (case_text(ranks=3), "run.ranks", "3", "1 to 2"),
        (changed('"4 mm"]', '"0 mm"]'), "parts[0].mesh", "", "low"),
        (MESH, "parts[0].mesh.sha256", "", "a server finds a file by its hash"),
    ],
)  # fmt: skip
def test_a_bad_case(users: tuple[User, User], text: str, key: str, value: str, allowed: str) -> None:
    ann, _ = users
    message = line(ann.http.post("/v1/runs", content=text, headers=TOML), 422)
    assert key in message
    assert value in message
    assert allowed in message


def test_a_body_of_two_mebibytes(users: tuple[User, User]) -> None:
    message = line(users[0].http.post("/v1/runs", content=b"#" * (2 << 20), headers=TOML), 413)
    assert str(1 << 20) in message


def test_no_token(users: tuple[User, User]) -> None:
    with httpx2.Client(base_url=users[0].http.base_url) as stranger:
        assert "token" in line(stranger.post("/v1/runs", content=case_text(), headers=TOML), 401)


def test_another_users_run_and_no_run_is_lost(users: tuple[User, User]) -> None:
    """After all bad inputs the server runs a valid case, and the user bob does not see this run."""
    ann, bob = users
    run = ann.submit()
    assert ann.wait_for(run)["state"] == "succeeded"
    for answer in (bob.http.get(f"/v1/runs/{run}"), bob.http.post(f"/v1/runs/{run}:cancel")):
        assert run in line(answer, 404)
    assert [found["id"] for found in ann.http.get("/v1/runs").json()["runs"]] == [run]
