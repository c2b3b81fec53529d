"""Snapshots of the fragments through the Python API: the snapshots are listed, fetched, and followed over Zenoh and
over SSE.
"""

from pathlib import Path

import numpy as np
import pytest

from conoid.client.errors import ClientError, ServiceError, UnfinishedError
from conoid.client.local.own_server import LocalServer
from conoid.client.remote.session import Session
from conoid.client.remote.stream import SseLink, ZenohLink
from conoid.client.snapshots import read

from .fakes import case_file


@pytest.fixture
def session(server: LocalServer) -> Session:
    return server.session


def test_they_are_listed_fetched_and_read(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path, snapshots=3))
    run.wait()
    assert [snapshot.n for snapshot in run.snapshots()] == [0, 1, 2]
    one = run.snapshot(1)
    assert (one.header.n, one.header.step) == (1, 1)
    assert one.data == Path(run.download(tmp_path, "snapshots/000001.snap")).read_bytes()
    assert one.points.tolist() == [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]
    assert one.array("triangles").tolist() == [[0, 1, 2]]
    assert one.field("speed") == pytest.approx(np.array([1.0]))
    assert one.fragments["mass"].tolist() == [0.5]
    assert run.snapshot().header.n == 2
    assert "step 2" in repr(run.snapshot())
    with pytest.raises(UnfinishedError, match="no snapshot 7"):
        run.snapshot(7)
    with pytest.raises(ClientError, match="no array 'colour'"):
        one.array("colour")
    assert run.history()["snapshots"][2]["n"] == 2


@pytest.mark.parametrize("lose", [0, 2])
def test_zenoh_brings_them_and_what_it_loses_is_fetched(session: Session, tmp_path: Path, lose: int) -> None:
    run = session.submit(case_file(tmp_path, steps=8, snapshots=6, pace=0.05, lose=lose))
    link = run.link()
    assert isinstance(link, ZenohLink)
    seen = list(run.fragments(link=link))
    assert [one.header.n for one in seen] == list(range(6))
    assert len(link.blobs) <= 4
    assert link.blobs


def test_sse_brings_the_same(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path, steps=8, snapshots=6, pace=0.02))
    seen = list(run.fragments(link=SseLink(lambda: session.stream(f"{run.path}/stream"))))
    assert [one.header.n for one in seen] == list(range(6))


def test_watch_reports_a_new_snapshot(session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = session.submit(case_file(tmp_path, steps=4, snapshots=2, pace=0.02))
    known = run.watch(live=False)
    assert "snapshot 1 at t 100 ms: 1 fragment" in capsys.readouterr().out
    assert known.snapshot is not None


def test_one_is_asked_for_while_it_runs_only(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path, steps=400, pace=0.02))
    for message in run.messages():
        if message.step > 1:
            break
    assert run.take_snapshot().id == run.id
    run.cancel()
    run.wait()
    with pytest.raises(ServiceError, match="makes one"):
        run.take_snapshot()


def test_an_invalid_snapshot_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.snap").write_bytes(b"no")
    with pytest.raises(ClientError, match="CONOSNAP"):
        read(tmp_path / "x.snap")
