"""A missing or changed file of the server is reported or made again."""

import os
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy.exc import SQLAlchemyError

from conoid.cases.run import Cause, State
from conoid.server.database.store import Store
from conoid.server.launch import memory
from conoid.server.runs.events import Broken, Kill, Run
from conoid.server.runs.lifecycle import advance
from conoid.server.telemetry import TelemetryError, _read_secret


def replaced(path: Path) -> None:
    shutil.copy2(path, path.with_name("copy"))
    os.replace(path.with_name("copy"), path)


@pytest.mark.parametrize("deed", [Path.unlink, replaced, lambda path: path.unlink() or path.mkdir()])
def test_a_database_that_is_gone_is_not_ready(tmp_path: Path, deed: Callable[[Path], None]) -> None:
    store = Store(f"sqlite:///{tmp_path / 'server.sqlite'}")
    store.probe()
    deed(tmp_path / "server.sqlite")
    with pytest.raises(SQLAlchemyError, match="removed or replaced"):
        store.probe()
    store.close()


@pytest.mark.parametrize(
    ("content", "mode", "why"),
    [
        (b"", 0o600, "has 0 bytes"),
        (b"12345678" * 3, 0o600, "has 24 bytes"),
        (b"\0" * 32, 0o600, "can be guessed"),
        (bytes(range(32)), 0o644, "has the mode 644, allowed is 600"),
        (bytes(range(32)), 0o640, "has the mode 640"),
    ],
)
def test_an_invalid_secret_is_refused(tmp_path: Path, content: bytes, mode: int, why: str) -> None:
    path = tmp_path / "server.secret"
    path.write_bytes(content)
    path.chmod(mode)
    with pytest.raises(TelemetryError, match=why) as raised:
        _read_secret(tmp_path)
    assert "\n" not in str(raised.value)


def test_a_secret_that_is_not_a_file_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "server.secret", 0o600)
    with pytest.raises(TelemetryError, match="is not a regular file"):
        _read_secret(tmp_path)


def test_a_secret_is_made_once(tmp_path: Path) -> None:
    first = _read_secret(tmp_path)
    assert len(first) == 32
    assert _read_secret(tmp_path) == first


def test_a_run_that_was_to_be_cancelled_is_cancelled_where_its_folder_cannot_be_written() -> None:
    run = replace(Run("r", "ann", "bar", 1, 1.0), state=State.STOPPING, stopping_for=Cause.CANCELLED)
    ended, actions = advance(run, Broken("the folder cannot be used"), 9.0)
    assert (ended.state, ended.cause) == (State.CANCELLED, Cause.CANCELLED)
    assert actions == (Kill(),)
    assert advance(replace(run, stopping_for=Cause.WALLTIME), Broken("no"), 9.0)[0].state is State.LOST


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Replaces the kernel's counter with a value of the test."""
    counts = {"kills": 4}
    monkeypatch.setattr(memory, "kills", lambda: counts["kills"])
    return counts


def test_a_kill_is_out_of_memory_only_if_the_kernel_reports_it(
    counted: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = memory.Kills()
    monkeypatch.setattr(memory, "logged", lambda: {11})
    assert not seen.ended(11), "the kernel has killed no process since"
    counted["kills"] += 1
    assert seen.ended(11)
    assert not seen.ended(12), "another one"
    monkeypatch.setattr(memory, "logged", lambda: None)
    assert seen.ended(12), "its log cannot be read, and somebody was ended in these seconds"


def test_a_kill_long_after_an_out_of_memory_kill_has_another_cause(
    counted: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(memory, "logged", lambda: None)
    seen = memory.Kills()
    counted["kills"] += 1
    for _ in range(40):
        now[0] += 0.2
        seen.count()
    assert not seen.ended(12)
