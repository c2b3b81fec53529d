"""Damaged files and senseless requests at the routes of the table, of charts and of snapshots."""

from pathlib import Path
from typing import Any

import pytest

from conoid.cases.messages import Snapshot, Status, to_json
from conoid.cases.output import layout

from .running import Running, case_text

ROUTES = ("/v1/table", "/v1/runs/{0}/columns?name=*", "/v1/runs/{0}/history", "/v1/runs/{0}/snapshots/0/tets",
          "/v1/runs/{0}/fragments/1", "/v1/runs/{0}", "/v1/runs/{0}/events")  # fmt: skip
DEEP = b"[" * 100_000 + b"]" * 100_000
SNAPSHOT: dict[str, Any] = {
    "run": "r",
    "seq": 9,
    "step": 1,
    "t": 1.0,
    "n": 0,
    "bytes": 4,
    "triangles": 4,
    "fragments": 7,
    "tets": 9,
}


def answers(server: Running, run: str) -> dict[str, Any]:
    """Returns the answers of the server by route. Each answer is JSON in UTF-8 with the status 200 or 404."""
    found = {}
    for route in ROUTES:
        answer = server.ann.http.get(route.format(run))
        assert answer.status_code in {200, 404}, (route, answer.text[:200])
        found[route] = answer.json()
    return found


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        (b"step,t [s],p [N]\n1,2," + b"9" * 200_000 + b"\n2,3,4\n", {"step", "t", "p"}),
        (b"step,t [s],t [ms],p\n1,2,3,4\n", {"step", "t", "p"}),
        (b",,,\n1,2,3,4\n", {""}),
        (b"", set()),
        (b"step,\xff [s]\n1,2\n\xff,3\n", {"step", "�"}),
        (b'step,t [s]\n1,"2\n3,nan\n5,1e999\n\0,1\n', {"step", "t"}),
    ],
    ids=["long", "twice", "unnamed", "empty", "no UTF-8", "no numbers"],
)
def test_a_damaged_history_is_shown_as_far_as_it_goes(
    ended: tuple[Running, str], text: bytes, columns: set[str]
) -> None:
    server, run = ended
    (server.ann.runs / run / layout.HISTORY).write_bytes(text)
    server.service.histories._known.clear()
    assert set(answers(server, run)[ROUTES[1]]["columns"]) == columns


def test_a_link_in_place_of_a_history_is_not_followed(ended: tuple[Running, str], tmp_path: Path) -> None:
    server, run = ended
    (tmp_path / "other").write_text("secret,t [s]\n1,2\n")
    path = server.ann.runs / run / layout.HISTORY
    path.unlink(missing_ok=True)
    path.symlink_to(tmp_path / "other")
    answer = server.ann.http.get(f"/v1/runs/{run}/columns")
    path.unlink()
    assert "secret" not in answer.text
    assert answer.json()["detail"] == "a file of the run cannot be used: is not a regular file"


@pytest.mark.parametrize("name", [layout.OUTCOME, layout.SUBMISSION, layout.RESOLVED_CASE, layout.JOURNAL])
def test_a_link_in_place_of_a_file_of_a_run_is_not_followed(server: Running, tmp_path: Path, name: str) -> None:
    run = server.ann.submit(steps=1)
    server.ann.wait_for(run)
    path, other = server.ann.runs / run / name, tmp_path / "other"
    other.write_bytes(path.read_bytes().replace(b"bar", b"secret").replace(b"A bar", b"secret").replace(b":3", b":77"))
    path.unlink()
    path.symlink_to(other)
    for route in (*ROUTES, "/v1/runs/{0}:restart", f"/v1/runs/{{0}}/files/{name}"):
        send = server.ann.http.post if route.endswith(":restart") else server.ann.http.get
        text = send(route.format(run)).text
        assert "secret" not in text, route
        assert '"fragments":77' not in text, route


@pytest.mark.parametrize(
    "line",
    [
        b'{"type":"balance","x":"\xff"}',
        b'{"type":"log","run":"r","seq":1,"wall":1.0,"level":"info","text":"a","more":"\xff"}',
        *(b'{"type":"%s","x":' % kind + DEEP + b"}" for kind in (b"balance", b"load", b"log", b"snapshot", b"status")),
        *(to_json(Snapshot(**SNAPSHOT, path=path, sha256="a" * 64)) for path in ("", ".", "/", "../x", "a\0b")),
        to_json(Snapshot(**SNAPSHOT, path="a.snap", sha256="€\r\nX: y")),
    ],
)
def test_a_damaged_journal_is_skipped(ended: tuple[Running, str], line: bytes) -> None:
    server, run = ended
    path = server.ann.runs / run / layout.JOURNAL
    before = path.read_bytes()
    path.write_bytes(before + line + b"\n")
    server.service.histories._known.clear()
    try:
        assert answers(server, run)["/v1/table"]["runs"][0]["id"] == run
    finally:
        path.write_bytes(before)


def test_a_long_message_of_a_state_is_cut(ended: tuple[Running, str]) -> None:
    server, run = ended
    path = server.ann.runs / run / layout.JOURNAL
    before = path.read_bytes()
    path.write_bytes(before + to_json(Status(run="r", wall=1.0, state="failed", message="m" * 10**6)) + b"\n")
    server.service.histories._known.clear()
    assert len(server.ann.http.get(f"/v1/runs/{run}/history").content) < 50_000
    path.write_bytes(before)


@pytest.mark.parametrize("name", [layout.OUTCOME, layout.RESOLVED_CASE, layout.SUBMISSION])
@pytest.mark.parametrize("more", [b'"\xff"', DEEP, b"9" * 400], ids=["no UTF-8", "deep", "large"])
def test_damaged_files_of_a_run_leave_its_row(server: Running, name: str, more: bytes) -> None:
    run = server.ann.submit(steps=1)
    server.ann.wait_for(run)
    path = server.ann.runs / run / name
    path.write_bytes(path.read_bytes().replace(b"{", b'{"more":' + more + b",", 1))
    assert [row["id"] for row in answers(server, run)["/v1/table"]["runs"]] == [run]


@pytest.mark.parametrize(("name", "value"), [("since", "nan"), ("until", "inf"), ("changed", "-inf"), ("text", "a\0"),
                                             ("case", "\0"), ("label", "a=\0")])  # fmt: skip
def test_an_invalid_request_is_refused_in_one_line(ended: tuple[Running, str], name: str, value: str) -> None:
    server, _ = ended
    answer = server.ann.http.get("/v1/table", params={name: value})
    assert answer.status_code in {400, 422}
    assert name in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]


def test_words_are_found_whatever_the_case_of_their_letters(server: Running) -> None:
    server.ann.submit(case_text().replace("A bar", "ÜBUNG Ätna"))
    for text in ("ÜBUNG", "übung", "ätna", "Übung ÄTNA"):
        assert len(server.ann.http.get("/v1/runs", params={"text": text}).json()["runs"]) == 1
    assert server.bob.http.get("/v1/runs", params={"text": "übung"}).json()["runs"] == []
