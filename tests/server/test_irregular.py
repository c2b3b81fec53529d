"""Irregular or endless files in place of a run's files: no request hangs, and the memory is bounded."""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.messages import Status
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import State
from conoid.server.keeping.removed_runs import RemovedRuns
from conoid.server.runs import ends, folder, journal, launcher_log, pins, restarts
from conoid.worker.output import hdf5, storage
from conoid.worker.output.journal import Journal

from .running import Running


def in_place(path: Path, kind: str) -> None:
    """Replaces a file by a folder, a pipe or another irregular file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "huge":
        path.touch()
        os.truncate(path, 1 << 40)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as made:
            here = os.getcwd()
            os.chdir(path.parent)
            made.bind(path.name)
            os.chdir(here)
    else:
        path.symlink_to(kind)


KINDS = ("pipe", "socket", "folder", "/dev/zero", "/dev/full", "loop", "huge")
READERS: dict[str, Callable[[Path], Any]] = {
    layout.SUBMISSION: folder.submission,
    layout.OUTCOME: lambda path: (folder.outcome(path), folder.outcome_error(path), ends.when(path)),
    layout.WORKER: folder.process,
    layout.STOP_REQUEST: folder.stop_asked,
    ".keep": pins.last_request,
    layout.RESOLVED_CASE: restarts._every,
    f"{layout.LOGS}/{layout.LAUNCHER_LOG}": lambda path: (launcher_log.exit_code(path), launcher_log.rank_killed(path)),
    "case.toml": lambda path: restarts.body(path / "case.toml", None),
}


@pytest.fixture(autouse=True)
def _in_time() -> Iterator[None]:
    """Makes a test that hangs fail at once."""
    signal.alarm(20)
    yield
    signal.alarm(0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", READERS)
def test_no_reader_waits(tmp_path: Path, name: str, kind: str) -> None:
    in_place(tmp_path / name, "loop" if kind == "loop" else kind)
    if kind == "loop":
        (tmp_path / name).unlink()
        (tmp_path / name).symlink_to(tmp_path / name)
    with suppress(*folder.DAMAGED):
        READERS[name](tmp_path)


@pytest.mark.parametrize("kind", ["pipe", "socket", "folder", "/dev/zero", "/dev/full"])
def test_no_writer_waits_and_none_writes_to_a_device(tmp_path: Path, kind: str) -> None:
    in_place(tmp_path / layout.JOURNAL, kind)
    with pytest.raises(IsADirectoryError):
        journal.append(tmp_path / layout.JOURNAL, Status(run="r", state=State.QUEUED))
    with pytest.raises(IsADirectoryError):
        Journal(tmp_path, "r")
    with pytest.raises(IsADirectoryError):
        journal.Tail(tmp_path / layout.JOURNAL).read()
    in_place(tmp_path / "purged.jsonl", kind)
    with pytest.raises(IsADirectoryError):
        RemovedRuns(tmp_path)


def test_an_outcome_that_is_a_pipe_keeps_no_request_waiting(server: Running) -> None:
    run = server.ann.submit()
    server.ann.wait_for(run)
    in_place(server.ann.runs / run / layout.OUTCOME, "pipe")
    for _ in range(45):
        assert server.ann.show(run)["state"] == "succeeded"
    assert server.ann.http.get("/healthz").status_code == 200


@pytest.mark.parametrize("kind", ["pipe", "/dev/full", "/dev/null"])
def test_a_frame_that_cannot_be_written_is_a_disk_error(tmp_path: Path, kind: str) -> None:
    in_place(tmp_path / "frames" / "000001.vtkhdf", kind)
    refused = pytest.raises(OSError, match="is not a regular file, and keeps nothing")
    with refused as raised, hdf5.created(tmp_path / "frames" / "000001.vtkhdf"):
        raise AssertionError("opened")
    assert storage.failed(raised.value)
    assert storage.gone(raised.value, tmp_path), "by the place of its name, not by that of what it leads to"


def test_a_file_that_is_read_as_a_whole_has_a_limit(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"12345")
    assert whole.read(tmp_path / "file", 5) == b"12345"
    with pytest.raises(IsADirectoryError, match="has more than 4 bytes"):
        whole.read(tmp_path / "file", 4)


GARBAGE = (
    b"\n\n\n\n",
    b"\0" * 5000,
    b"garbage\n" * 9,
    b"{}\n" * 5 + b"\xff\xfe\n" * 3,
    b"\r\n" * 8,
    b'{"seq":"9"}\n' * 4,
)


@pytest.mark.parametrize("garbage", GARBAGE)
@pytest.mark.parametrize("end", [b"", b"\n", b'{"type":"sta'])
def test_garbage_at_the_end_of_a_journal_does_not_make_numbers_begin_again(
    tmp_path: Path, garbage: bytes, end: bytes
) -> None:
    path = tmp_path / layout.JOURNAL
    for _ in range(3):
        journal.append(path, Status(run="r", state=State.QUEUED))
    with path.open("ab") as file:
        file.write(garbage + end)
    assert journal.append(path, Status(run="r", state=State.QUEUED)).seq == 4
    with path.open("ab") as file:
        file.write(garbage + end)
    made = Journal(tmp_path, "r")
    made.starting("the next one")
    made.close()
    assert [line.seq for line in journal.lines(path)] == [1, 2, 3, 4, 5]
