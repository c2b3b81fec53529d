"""A full disk at the start of a server and during its commands: possible actions are done, other actions are refused in
one line.
"""

import asyncio
import errno
import os
import resource
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx2
import pytest

from conoid.server import serve
from conoid.server.__main__ import main
from conoid.server.database import engine
from conoid.server.database.store import Store
from conoid.server.requests.tokens import create_token
from conoid.server.settings import Settings

from .faulty import Plan, faults
from .running import PATIENCE, TOML, case_text

FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """A folder that a server has used."""
    assert main(["--runs", str(tmp_path / "runs"), "token", "add", "ann"]) == 0
    assert main(["--runs", str(tmp_path / "runs"), "adopt"]) == 0
    return tmp_path / "runs"


def no_room() -> None:
    """Context in which no file of this process can grow."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def test_a_server_starts_on_a_full_disk_and_answers(runs: Path) -> None:
    (runs / "server.secret").write_bytes(bytes(range(32)))
    (runs / "server.secret").chmod(0o600)
    kept = Store(Settings(runs=runs).database_url)  # an open database has a log file
    token = create_token(kept, "ann", frozenset({"read", "submit"}))
    command = [sys.executable, "-m", "conoid.server", "--runs", str(runs), "--port", "0", "--zenoh-port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=no_room) as child:
        try:
            assert child.stdout is not None
            url = child.stdout.readline().decode().split()[1]
            with httpx2.Client(headers={"Authorization": f"Bearer {token}"}, timeout=PATIENCE) as http:
                assert http.get(f"{url}/v1/runs").json() == {"runs": [], "next": None}
                assert http.get(f"{url}/readyz").json()["checks"]["runs"] is False
                answer = http.post(f"{url}/v1/runs", content=case_text(), headers=TOML)
                assert (answer.status_code, answer.json()["retryable"]) == (507, True)
        finally:
            child.terminate()
        printed = child.communicate(timeout=PATIENCE)[1].decode()
    kept.close()
    assert child.returncode == 0
    assert "Traceback" not in printed
    assert f"{runs}/server.json: not written, and tried again in 5 s: File too large" in printed


def test_an_address_is_written_when_there_is_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serve, "_AGAIN", 0.0)
    service: Any = SimpleNamespace(_service=SimpleNamespace(settings=SimpleNamespace(runs=tmp_path)))
    with faults(Plan(tmp_path, 0, FULL, times=3)):
        asyncio.run(serve._Server._write(service, b"{}"))
    assert (tmp_path / "server.json").read_bytes() == b"{}"


def test_a_token_on_a_full_disk(
    runs: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    tuned = engine._tune

    def full(connection: Any, record: object) -> None:
        tuned(connection, record)
        pages = connection.execute("pragma page_count").fetchone()[0]
        connection.execute(f"pragma max_page_count={pages}").close()

    monkeypatch.setattr(engine, "_tune", full)
    codes = [main(["--runs", str(runs), "token", "add", f"user{n}"]) for n in range(60)]
    assert set(codes) == {0, 1}
    printed = capsys.readouterr().err.splitlines()
    place = f"{runs}/server.sqlite: (sqlite3.OperationalError) database or disk is full"
    assert printed == [f"conoid.server: the database cannot be used: {place}"] * codes.count(1)


@pytest.mark.parametrize(("place", "named"), [(0, "server.identity"), (1, "")])
def test_a_command_names_the_file_that_it_cannot_write(
    place: int, named: str, runs: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The error of fsync(2) does not name a file."""
    left = [place]

    def fsync(_: int) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", fsync)
    capsys.readouterr()
    assert main(["--runs", str(runs), "adopt"]) == 1
    assert capsys.readouterr().err == f"conoid.server: {runs / named}: No space left on device\n"
