"""The history of a run and the snapshots of a run over HTTP."""

import struct
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.cases.output.snapshot import Column, Header, pack
from conoid.cases.run import State
from conoid.server.answers import history
from conoid.server.answers.history import History

from .journal_lines import lines_of_run, snapshot, write
from .running import Running


def shown(server: Running, run: str, **query: int) -> dict[str, Any]:
    answer = server.ann.http.get(f"/v1/runs/{run}/history", params=query)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


@pytest.fixture
def run(server: Running) -> str:
    """A finished run whose journal a test may replace."""
    made = server.ann.submit(steps=1)
    server.ann.wait_for(made)
    return made


def test_short_runs_are_reported_completely(server: Running, run: str) -> None:
    last = write(server.ann.runs / run, lines_of_run(200))
    found = shown(server, run)
    series = found["series"]
    assert found["last"] == last
    assert found["state"] == "running"
    assert series["step"] == [10 * k for k in range(200)]
    assert series["t"] == [1e-9 * k for k in range(200)]
    assert series["elapsed"] == [0.25 * k for k in range(200)]
    assert series["imbalance"] == [1.0 + 1e-3 * k for k in range(200)]
    assert series["nodes"] == [50 + k // 3 * 3 for k in range(200)]
    assert series["facets"] == [2 * (k // 3 * 3) for k in range(200)]
    assert series["fragments"][99:103] == [100, 7, 7, 103]
    assert series["residual"] == [1e-6 * k for k in range(200)]
    assert series["kinetic"] == [3.0] * 200
    assert series["share_elements"] == [0.75] * 200
    assert found["parts"]["rod"] == {
        "kinetic": [None, *[2.0] * 199],
        "internal": [None, *(0.5 * k for k in range(1, 200))],
    }
    assert list(found["parts"]) == ["rod", "ball"]
    assert found["ranks"]["contact"] == [[1.0, 1.0]] * 200
    assert [event["cause"] for event in found["balance"]] == ["time lost"] * 2
    assert [event["n"] for event in found["snapshots"]] == [0, 1]


def test_long_runs_are_thinned_evenly_and_end_with_the_newest(server: Running, run: str) -> None:
    write(server.ann.runs / run, lines_of_run(20_000))
    found = shown(server, run, points=500)
    steps = found["series"]["step"]
    assert len(steps) == 500
    assert steps[-1] == 199_990
    gaps = [b - a for a, b in pairwise(steps)]
    assert max(gaps) <= 3 * 200_000 / 500
    assert steps == sorted(set(steps))
    assert len(found["snapshots"]) == len(found["balance"]) == 200


def test_later_lines_are_read_from_the_last_position(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    last = write(folder, lines_of_run(50))
    assert shown(server, run)["last"] == last
    status = messages.Status(run="r", wall=2000.0, state=State.SUCCEEDED)
    with (folder / layout.JOURNAL).open("ab") as file:
        line = messages.to_json(messages.Status(run="r", seq=last + 1, wall=2000.0, state=status.state))
        file.write(line)
        file.flush()
        assert shown(server, run)["last"] == last
        file.write(b"\n")
    found = shown(server, run)
    assert (found["last"], found["state"], found["elapsed"]) == (last + 1, "succeeded", 990.0)


def test_the_course_of_a_resumed_run_is_read_once(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    last = write(folder, lines_of_run(50))
    write(folder, (message for message in lines_of_run(80) if message.step >= 300), last)
    steps = shown(server, run)["series"]["step"]
    assert steps == [10 * k for k in range(80)]


def test_memory_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, lines_of_run(3000, ranks=200))
    monkeypatch.setattr(history, "_BYTES", 500_000)
    found = History(tmp_path / layout.JOURNAL)
    found.catch_up()
    assert 10 < len(found.samples) < 200
    assert sum(sample.size for sample in found.samples) <= 500_000
    assert found.newest is not None


def test_the_log_of_the_whole_run_is_bounded_and_a_warning_is_there_once(server: Running, run: str) -> None:
    def spoken() -> Iterator[messages.AnyMessage]:
        yield messages.Status(run="r", wall=1.0, state=State.RUNNING)
        for k in range(5000):
            level = "warning" if k % 50 == 7 else "info"
            yield messages.Log(run="r", wall=2.0, level=level, text=f"line {k % 100}" if level == "warning" else f"{k}")
        yield messages.Log(run="r", wall=3.0, level="error", text="long " * 10_000)

    write(server.ann.runs / run, spoken())
    found = shown(server, run)
    texts = [line.get("text", line.get("state")) for line in found["log"]]
    assert texts[:3] == ["running", "0", "1"]
    assert texts[-2] == "4999"
    assert len(texts[-1]) < 2100
    assert found["log_left_out"] == 5002 - len(texts) == 4002
    assert [line["text"][:8] for line in found["warnings"]] == ["line 7", "line 57", "long lon"]


def test_invalid_lines_of_the_journal_are_skipped(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    write(folder, lines_of_run(20))
    with (folder / layout.JOURNAL).open("ab") as file:
        file.write(b'{"type":"balance","run":"half\n{"type":"snapshot"}\n{"type":"status","state":"odd"}\n\xff\n\n')
        file.write(b'{"type":"progress","seq":90,"run":\n{"type":"counts","seq":91,"fragments":"many"}\n')
        file.write(b'{"type":"load","seq":92,"run":"half\n{"type":"load","seq":93,"t":"\xff"}\n')
    found = shown(server, run)
    assert (len(found["series"]["t"]), found["balance"], found["snapshots"]) == (20, [], [])


def test_a_run_without_reports_has_a_history(server: Running, run: str) -> None:
    found = shown(server, run)
    assert found["state"] == "succeeded"
    assert found["series"]["t"] == found["balance"] == found["snapshots"] == []


# Snapshots ------------------------------------------------------------------------------------------------------------


def test_snapshots_are_listed_and_fetched_once(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    write(folder, lines_of_run(200))
    (folder / layout.SNAPSHOTS).mkdir()
    layout.snapshot(folder, 0).write_bytes(b"99")
    place = f"/v1/runs/{run}/snapshots"
    answer = server.ann.http.get(place)
    listed = answer.json()["snapshots"]
    assert [one["n"] for one in listed] == [0, 1]
    assert server.ann.http.get(place, headers={"If-None-Match": answer.headers["ETag"]}).status_code == 304
    got = server.ann.http.get(f"{place}/0")
    assert got.content == b"99"
    assert got.headers["content-type"] == "application/octet-stream"
    assert got.headers["etag"] == f'"{listed[0]["sha256"]}"'
    assert "immutable" in got.headers["cache-control"]
    again = server.ann.http.get(f"{place}/0", headers={"If-None-Match": got.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert server.ann.http.get(f"{place}/0", headers={"If-None-Match": '"other"'}).status_code == 200


def test_a_snapshot_that_is_damaged_is_not_sent_to_be_kept(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    write(folder, lines_of_run(200))
    (folder / layout.SNAPSHOTS).mkdir()
    place = f"/v1/runs/{run}/snapshots/0"
    for damaged in (b"9", b"", b"999"):
        layout.snapshot(folder, 0).write_bytes(damaged)
        answer = server.ann.http.get(place)
        assert (answer.status_code, answer.json()["code"]) == (404, "damaged")
        assert "immutable" not in answer.headers.get("cache-control", "")
    layout.snapshot(folder, 0).write_bytes(b"99")
    assert server.ann.http.get(place).content == b"99"


def test_a_snapshot_that_the_journal_lacks_is_not_found(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    write(folder, lines_of_run(150))
    (folder / layout.SNAPSHOTS).mkdir()
    layout.snapshot(folder, 7).write_bytes(b"never announced")
    layout.snapshot(folder, 1).with_suffix(".part").write_bytes(b"half")
    place = f"/v1/runs/{run}/snapshots"
    assert [one["n"] for one in server.ann.http.get(place).json()["snapshots"]] == [0]
    assert server.ann.http.get(f"{place}/7").status_code == 404
    assert server.ann.http.get(f"{place}/0").status_code == 404


def test_all_tets_are_fetched_where_there_are_any(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    at: dict[str, Any] = {"run": run, "step": 0, "t": 0.0, "wall": 0.0}
    write(folder, iter([snapshot(0, "0", tets=4, **at), snapshot(1, "1", **at)]))
    (folder / layout.SNAPSHOTS).mkdir()
    layout.snapshot_tets(folder, 0).write_bytes(b"tets")
    place = f"/v1/runs/{run}/snapshots"
    got = server.ann.http.get(f"{place}/0/tets")
    assert (got.status_code, got.content) == (200, b"tets")
    again = server.ann.http.get(f"{place}/0/tets", headers={"If-None-Match": got.headers["ETag"]})
    assert again.status_code == 304
    assert [server.ann.http.get(f"{place}/{n}/tets").status_code for n in (1, 2)] == [404, 404]
    assert server.bob.http.get(f"{place}/0/tets").status_code == 404


def test_the_course_of_a_fragment_is_that_of_the_snapshots_that_have_it(server: Running, run: str) -> None:
    folder = server.ann.runs / run
    (folder / layout.SNAPSHOTS).mkdir()
    made = []
    for n in range(5):
        data = tabled({1: 3.0 + n, 7: 2.0} if n else {7: 2.0})
        layout.snapshot(folder, n).write_bytes(data if n < 4 else data[:200])  # the last snapshot is damaged
        made.append(snapshot(n, data, run=run, step=n, t=1e-6 * n, wall=0.0))
    write(folder, iter(made))
    found = server.ann.http.get(f"/v1/runs/{run}/fragments/1")
    assert found.json() == {
        "n": [1, 2, 3], "t": [1e-6, 2e-6, 3e-6], "mass": [4.0, 5.0, 6.0], "speed": [5.0] * 3, "size": [0.5] * 3,
        "tets": [10] * 3,
    }  # fmt: skip
    known = {"If-None-Match": found.headers["ETag"]}
    assert server.ann.http.get(f"/v1/runs/{run}/fragments/1", headers=known).status_code == 304
    assert server.ann.http.get(f"/v1/runs/{run}/fragments/2").json()["t"] == []
    assert server.ann.http.get(f"/v1/runs/{run}/fragments/-1").status_code in {400, 422}
    assert server.bob.http.get(f"/v1/runs/{run}/fragments/1").status_code == 404


def tabled(masses: dict[int, float]) -> bytes:
    """Returns a snapshot with fragments of the given masses by number, all at 5 m/s, and without triangles."""
    n = len(masses)
    header = Header(
        n=0, step=0, t=0.0, box=((0.0,) * 3, (0.0,) * 3), ranks=1, parts=[], tets=0, surface_triangles=0,
        fragments_total=n, fragments_listed=n, fields={},
    )  # fmt: skip
    columns: dict[str, tuple[str, str, list[Any]]] = {
        "fragment_id": ("int64", "q", list(masses)), "fragment_mass": ("float64", "d", list(masses.values())),
        "fragment_velocity": ("float32", "f", [3.0, 0.0, -4.0] * n), "fragment_size": ("float32", "f", [0.5] * n),
        "fragment_tets": ("uint32", "I", [10] * n),
    }  # fmt: skip
    packed = {
        name: Column(kind, (len(values),), struct.pack(f"<{len(values)}{letter}", *values))
        for name, (kind, letter, values) in columns.items()
    }
    return pack(header, packed)


def test_one_is_asked_for_while_it_runs(server: Running, tmp_path: Path) -> None:
    first = server.ann.submit(ranks=2, wait=str(tmp_path / "go"))
    server.ann.wait_for(first, State.RUNNING)
    assert server.ann.http.post(f"/v1/runs/{first}:snapshot").status_code == 202
    assert (server.ann.runs / first / layout.SNAPSHOT_REQUEST).exists()
    assert server.bob.http.post(f"/v1/runs/{first}:snapshot").status_code == 404
    (tmp_path / "go").touch()
    assert server.ann.wait_for(first)["state"] == "succeeded"
    refused = server.ann.http.post(f"/v1/runs/{first}:snapshot")
    assert (refused.status_code, refused.json()["code"]) == (409, "not_running")


@pytest.mark.slow
def test_a_million_events_open_in_two_seconds(server: Running, run: str) -> None:
    last = write(server.ann.runs / run, lines_of_run(430_000))
    assert last >= 10**6
    began = time.monotonic()
    found = shown(server, run)
    first = time.monotonic() - began
    assert found["last"] == last
    assert shown(server, run)["last"] == last
    assert first <= 2.0
    assert time.monotonic() - began - first <= 0.5


def test_sizes_are_those_of_the_latest_state_that_was_counted(server: Running, run: str) -> None:
    at: dict[str, Any] = {
        "run": "r",
        "t": 1e-6,
        "wall": 1011.0,
        "elements": 9,
        "nodes": 9,
        "shared": 0,
        "elements_per_rank": [9],
    }
    load = messages.Load(run="r", step=30, phases={"elements": [1.0]}, imbalance=1.0)
    journal: list[messages.AnyMessage] = [
        messages.Status(run="r", wall=1010.0, state=State.RUNNING),
        messages.Counts(**at, step=20, fragments=3, smallest=-9, sizes=[1, 2], counted=18),
    ]
    last = write(server.ann.runs / run, iter([*journal, load]))
    assert shown(server, run)["sizes"] == {"t": 1e-6, "smallest": -9, "sizes": [1, 2]}
    made = msgspec.structs.replace(snapshot(0, "x", run="r", step=25), smallest=-8, sizes=[4])
    late = messages.Counts(**at, step=40, fragments=3, smallest=-9, sizes=[1, 2], counted=18)
    last = write(server.ann.runs / run, iter([made, late, msgspec.structs.replace(load, step=40)]), last)
    answer = shown(server, run)
    assert answer["sizes"]["sizes"] == [4]
    assert answer["series"]["fragments"] == [3, 7]
    newer = msgspec.structs.replace(late, step=50, counted=45, fragments=9, sizes=[9])
    write(server.ann.runs / run, iter([newer, msgspec.structs.replace(load, step=50)]), last)
    assert shown(server, run)["sizes"]["sizes"] == [9]
