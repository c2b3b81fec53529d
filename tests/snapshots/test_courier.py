"""A separate process makes a snapshot of the state of a rank; failures of this process do not delay the solver."""

import hashlib
import io
import json
import os
import resource
import shutil
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from conoid.cases import messages
from conoid.cases.output import layout, snapshot
from conoid.worker.output.telemetry import Telemetry
from conoid.worker.snapshots import packer, share
from conoid.worker.snapshots.courier import Courier

from .shattered import PARTS, shattered

PATIENCE = 60.0


def task(n: int, ranks: int = 1) -> dict[str, Any]:
    return {
        "n": n, "step": 10 * n, "t": 1e-6 * n, "ranks": ranks, "parts": PARTS, "end": 1.0, "frames": 0, "cause": "end",
        "dropped": 0, "walls": [],
    }  # fmt: skip


@pytest.fixture
def courier(tmp_path: Path) -> Iterator[Courier]:
    (tmp_path / layout.SNAPSHOTS).mkdir()
    made = Courier(tmp_path, 0)
    yield made
    made.close()


def answer(courier: Courier) -> tuple[dict[str, Any], bytes]:
    limit = time.monotonic() + PATIENCE
    while not courier.answers:
        assert time.monotonic() < limit
        time.sleep(0.01)
    return courier.answers.popleft()


def test_shares_of_two_ranks_become_one_snapshot(courier: Courier, tmp_path: Path) -> None:
    mine, theirs = shattered(3, 4).shares(2)
    share.write(layout.share(tmp_path, 5, 1), theirs)
    courier.send(task(5, ranks=2), mine)
    message, data = answer(courier)
    assert (message["n"], message["step"], message["cause"]) == (5, 50, "end")
    assert hashlib.sha256(data).hexdigest() == message["sha256"]
    assert snapshot.header_of(data).fragments_total == message["fragments"]
    names = sorted(path.name for path in (tmp_path / layout.SNAPSHOTS).iterdir())
    assert names == ["000005.snap", "000005.tets"]


def test_a_share_that_cannot_be_read_costs_one_snapshot(courier: Courier, tmp_path: Path) -> None:
    (mine,) = shattered(2, 2).shares(1)
    layout.share(tmp_path, 0, 1).write_bytes(b"[]\nhalf")
    courier.send(task(0, ranks=2), mine)
    assert "error" in answer(courier)[0]
    assert not list((tmp_path / layout.SNAPSHOTS).iterdir())
    courier.send(task(1), mine)
    assert answer(courier)[0]["bytes"] > 0


def test_a_folder_that_is_removed_costs_one_snapshot(courier: Courier, tmp_path: Path) -> None:
    (mine,) = shattered(2, 2).shares(1)
    courier.send(task(0), mine)
    assert "error" not in answer(courier)[0]
    shutil.rmtree(tmp_path / layout.SNAPSHOTS)
    courier.send(task(1), mine)
    assert answer(courier)[0]["bytes"] > 0
    began = time.monotonic()
    with pytest.raises(FileNotFoundError, match="snapshots was removed"):
        packer._awaited(tmp_path / "none" / layout.SNAPSHOTS / "share")
    assert time.monotonic() - began < 1.0


def test_a_disk_that_fills_under_the_packer_costs_one_snapshot(courier: Courier, tmp_path: Path) -> None:
    """No file of the process can grow: a warning names the snapshot and the reason, and no part of the snapshot remains
    on the disk."""
    (mine,) = shattered(2, 2).shares(1)
    courier.send(task(0), mine)
    answer(courier)
    assert courier.packer is not None
    limits = resource.prlimit(courier.packer, resource.RLIMIT_FSIZE, (64, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    courier.send(task(1), mine)
    assert "File too large: '" in answer(courier)[0]["error"]
    names = sorted(path.name for path in (tmp_path / layout.SNAPSHOTS).iterdir())
    assert names == ["000000.snap", "000000.tets"]
    resource.prlimit(courier.packer, resource.RLIMIT_FSIZE, limits)
    courier.send(task(2), mine)
    assert answer(courier)[0]["bytes"] > 0


def test_a_packer_that_dies_costs_one_snapshot(courier: Courier) -> None:
    (mine,) = shattered(2, 2).shares(1)
    courier.send(task(0), mine)
    answer(courier)
    assert courier.packer is not None
    os.kill(courier.packer, signal.SIGKILL)
    courier.send(task(1), mine)
    courier.send(task(2), mine)
    messages_sent = [answer(courier)[0] for _ in range(2)]
    assert "error" not in messages_sent[1]


def test_a_request_to_stop_the_run_leaves_the_packer_for_the_last_snapshot(courier: Courier) -> None:
    """A launcher sends the stop request to every process of a rank."""
    (mine,) = shattered(2, 2).shares(1)
    courier.send(task(0), mine)
    answer(courier)
    assert courier.packer is not None
    for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT):
        os.kill(courier.packer, number)
    courier.send(task(1), mine)
    assert "error" not in answer(courier)[0]


def test_a_packer_that_hangs_does_not_delay_the_run(courier: Courier) -> None:
    (mine,) = shattered(2, 2).shares(1)
    courier.send(task(0), mine)
    answer(courier)
    assert courier.packer is not None
    os.kill(courier.packer, signal.SIGSTOP)
    began = time.monotonic()
    courier.send(task(1), mine)
    assert time.monotonic() - began < 0.1
    assert courier.under_way == 2
    os.kill(courier.packer, signal.SIGCONT)
    assert answer(courier)[0]["n"] == 1


def test_the_last_snapshot_does_not_wait_for_what_others_leave(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def made(*_: object) -> dict[str, Any]:
        return {"priority": os.getpriority(os.PRIO_PROCESS, threading.get_native_id())}

    lines = [json.dumps({**task(n), "cause": cause}) for n, cause in enumerate(("start", "run.snapshots", "end"))]
    monkeypatch.setattr(packer, "_made", made)
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines)))
    packer.main(tmp_path)
    first, second, last = (json.loads(line)["priority"] for line in capsys.readouterr().out.splitlines())
    assert last == os.getpriority(os.PRIO_PROCESS, 0)
    assert first == second == min(last + 10, 19)


def test_messages_that_wait_for_the_network_are_bounded_and_counted() -> None:
    """No program listens at the endpoint."""
    telemetry = Telemetry("tcp/127.0.0.1:1", "conoid/v1/ann/run")
    began = time.monotonic()
    for n in range(5):
        message = messages.Snapshot(
            run="run", seq=n, n=n, path="p", bytes=4, triangles=1, fragments=1, sha256="0" * 64
        )  # fmt: skip
        telemetry.tell(message, b"blob")
    for n in range(1100):
        telemetry.tell(messages.Log(run="run", seq=n, level="info", text="x"))
    assert time.monotonic() - began < 1.0
    assert telemetry.bare == 3
    assert telemetry.dropped == 1105 - 1024
    telemetry.close()
