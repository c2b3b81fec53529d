"""Submitted cases that name files: the tests check which user may use a file, and the copy of the file in the run's
folder.
"""

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.output import layout
from conoid.cases.reading import survey
from conoid.cases.reading.survey import Survey, Surveyed
from conoid.server.intake import submission, uploads
from conoid.server.keeping import disk_usage
from conoid.server.requests import limits
from conoid.server.settings import Caps, Settings

from .checkpointed import with_checkpoint
from .running import Running, User, case_text

MESH = b"""*NODE
1, 0, 0, 0
2, 10, 0, 0
3, 0, 10, 0
4, 0, 0, 10
*ELEMENT, TYPE=C3D4, ELSET=All
1, 1, 2, 3, 4
"""
HASH = hashlib.sha256(MESH).hexdigest()
JSON = {"Content-Type": "application/json"}


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Replaces the program that reads mesh files; returns the folders for which the program was called."""
    asked = []

    def surveyed(case: Any, folder: Path) -> bytes:
        assert all(path.stat().st_size for path in (folder / layout.FILES).iterdir())
        asked.append(folder)
        return b""

    monkeypatch.setattr(submission, "surveyed", surveyed)
    return asked


def case(path: str = "/etc/passwd", sha256: str | None = HASH, **mesh: Any) -> dict[str, Any]:
    """Returns a case in which the mesh of the rod is in a file."""
    import tomllib

    data = tomllib.loads(case_text())
    named = {} if sha256 is None else {"sha256": sha256}
    data["parts"][0]["mesh"] = {"shape": "file", "path": path, "unit": "1 mm", **named, **mesh}
    return data


def send(user: User, data: bytes = MESH) -> str:
    sha256 = hashlib.sha256(data).hexdigest()
    assert user.http.put(f"/v1/files/{sha256}", content=data).status_code in {200, 201}
    return sha256


def hand_in(user: User, data: dict[str, Any], status: int = 202, key: str = "") -> dict[str, Any]:
    answer = user.http.post(
        "/v1/runs", content=json.dumps(data), headers={**JSON, **({"Idempotency-Key": key} if key else {})}
    )
    assert answer.status_code == status, answer.text
    submitted: dict[str, Any] = answer.json()
    return submitted


def test_a_run_has_its_own_copy_and_reads_no_path(server: Running, quick: list[Path]) -> None:
    send(server.ann)
    submitted = hand_in(server.ann, case("/etc/rod.INP"))
    assert submitted["files"] == [{"path": "/etc/rod.INP", "sha256": HASH}]
    folder = server.ann.runs / submitted["id"]
    copy = folder / layout.FILES / f"{HASH}.inp"
    assert copy.read_bytes() == MESH
    assert copy.stat().st_ino == (server.ann.runs / uploads.FOLDER / "ann" / HASH).stat().st_ino, "it takes no room"
    assert json.loads((folder / layout.SUBMISSION).read_bytes())["files"] == submitted["files"]
    assert HASH in (folder / layout.RESOLVED_CASE).read_text()
    assert not list(server.ann.runs.glob(".new*")), "the folder in which it was read is gone"
    assert server.ann.wait_for(submitted["id"])["state"] == "succeeded"
    assert server.ann.http.get(f"/v1/runs/{submitted['id']}/files/files/{HASH}.inp").content == MESH
    assert server.ann.http.delete(f"/v1/files/{HASH}").status_code == 204
    assert copy.read_bytes() == MESH, "the run keeps its own"


def test_a_file_is_used_by_those_who_have_sent_it(server: Running, quick: list[Path]) -> None:
    """A user gets the same answer for a file of another user and for a file that does not exist."""
    send(server.ann)
    nobodys = hashlib.sha256(b"nobody's").hexdigest()
    for hand in (hand_in, validated):
        refusals = [hand(server.bob, case(sha256=each), 422) for each in (HASH, nobodys)]
        assert json.dumps(refusals[0]).replace(HASH, "?") == json.dumps(refusals[1]).replace(nobodys, "?")
        (entry,) = refusals[0]["errors"] if "errors" in refusals[0] else refusals[0]["problems"]
        assert (entry["key"], entry["message"][:25]) == ("parts[0].mesh.sha256", "you have uploaded no such")
    assert not quick, "nothing was read"
    assert not list(server.ann.runs.glob(".new*"))
    send(server.bob)
    hand_in(server.bob, case())
    for user in (server.ann, server.bob):
        assert (user.runs / uploads.FOLDER / user.name / HASH).exists(), "each has his own"


def validated(user: User, data: dict[str, Any], status: int) -> dict[str, Any]:
    checked: dict[str, Any] = user.http.post("/v1/cases:validate", content=json.dumps(data), headers=JSON).json()
    return checked


def test_a_check_names_the_files_of_any_wrong_case(server: Running, quick: list[Path]) -> None:
    def verdict(made: dict[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = server.ann.http.post(
            "/v1/cases:validate", content=json.dumps(made), headers=JSON
        ).json()
        return answer

    named = {"key": "parts[0].mesh", "path": "a.inp", "sha256": HASH}
    without, lacking = verdict(case("a.inp", None)), verdict({**case("a.inp"), "wrong": 1})
    assert (without["valid"], without["files"]) == (False, [{**named, "sha256": ""}])
    assert (lacking["valid"], lacking["files"]) == (False, [named])
    unsent = verdict(case("a.inp"))
    assert (unsent["problems"][0]["key"], unsent["files"]) == ("parts[0].mesh.sha256", [named])
    send(server.ann)
    found = verdict(case("a.inp"))
    assert (found["valid"], found["files"]) == (True, [named])


def test_the_hash_is_of_the_run_and_of_its_key(server: Running, quick: list[Path]) -> None:
    """A repeated idempotency key with another file is another case."""
    other = send(server.ann, MESH + b"** another\n")
    send(server.ann)
    first = hand_in(server.ann, case(), key="k")
    assert hand_in(server.ann, case(), key="k") == first
    assert hand_in(server.ann, case(sha256=other), 422, key="k")["code"] == "key_reused"


def test_a_file_that_is_removed_at_the_last_moment_makes_no_run(
    server: Running, quick: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    send(server.ann)
    real = server.service.desk._check_room

    def removed(owner: str, more: int = 1) -> None:
        server.service.uploads.remove("ann", HASH)
        real(owner, more)

    monkeypatch.setattr(server.service.desk, "_check_room", removed)
    assert "you have uploaded no such file" in hand_in(server.ann, case(), 422)["detail"]
    assert server.ann.http.get("/v1/runs").json()["runs"] == []
    assert not list(server.ann.runs.glob(".new*"))


def test_where_the_disk_has_no_second_names_a_run_gets_a_copy(
    server: Running, quick: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: Any, **__: Any) -> None:
        raise OSError(1, "Operation not permitted")

    send(server.ann)
    monkeypatch.setattr(os, "link", none)
    submitted = hand_in(server.ann, case("rod.inp"))
    copy = server.ann.runs / submitted["id"] / layout.FILES / f"{HASH}.inp"
    assert (copy.read_bytes(), copy.stat().st_nlink) == (MESH, 1)


def test_a_restart_takes_the_copy_of_its_run(server: Running, quick: list[Path], tmp_path: Path) -> None:
    send(server.ann)
    plan = {"description": json.dumps({"end": "crash"})}
    run = hand_in(server.ann, {**case("rod.inp"), **plan})["id"]
    server.ann.wait_for(run)
    with_checkpoint(server, run, 7)
    server.ann.http.delete(f"/v1/files/{HASH}")
    fresh = server.ann.http.post(f"/v1/runs/{run}:restart").json()
    assert (server.ann.runs / fresh["id"] / layout.FILES / f"{HASH}.inp").read_bytes() == MESH
    (server.ann.runs / run / layout.FILES / f"{HASH}.inp").unlink()
    answer = server.ann.http.post(f"/v1/runs/{run}:restart")
    assert (answer.status_code, answer.json()["detail"]) == (409, f"run {run}: its copy of 'rod.inp' is gone")


def test_points_of_a_sweep_have_files_of_their_own(server: Running, quick: list[Path]) -> None:
    """The files are read once for all points of the sweep with the same bodies."""
    other = send(server.ann, MESH + b"** another\n")
    send(server.ann)
    speeds: list[dict[str, Any]] = [{"parts[0].velocity[2]": v} for v in (1.0, 2.0)]
    points = [*speeds, {"parts[0].mesh.path": "b.inp", "parts[0].mesh.sha256": other}]
    swept = case("a.inp")
    swept["parts"][0]["velocity"] = [0.0, 0.0, 0.0]
    wish = {"case": swept, "points": points}
    answer = server.ann.http.post("/v1/sweeps", content=json.dumps(wish), headers=JSON)
    assert answer.status_code == 202, answer.text
    runs = [point["run"]["id"] for point in answer.json()["points"]]
    names = [[path.name for path in (server.ann.runs / run / layout.FILES).iterdir()] for run in runs]
    assert names == [[f"{HASH}.inp"], [f"{HASH}.inp"], [f"{other}.inp"]]
    assert len(quick) == 2
    points[1]["parts[0].mesh.sha256"] = "0" * 64
    sweep = server.ann.http.post("/v1/sweeps", content=json.dumps(wish), headers=JSON).json()
    assert "you have uploaded no such file" in sweep["detail"]
    assert sweep["detail"].endswith("(point 1)")


def test_a_sweep_that_is_being_handed_in_needs_its_files(server: Running, quick: list[Path]) -> None:
    plan = server.service.sweeps._new("ann", submission_wish(), None, "")
    server.service.sweeps.plans.put(plan)
    assert server.service.sweeps.needed() == {HASH, "0" * 64}
    server.service.sweeps.plans._all.clear()


def submission_wish() -> Any:
    from conoid.server.intake.sweep_request import Wish

    return Wish(case=case(), points=[{"parts[0].mesh.sha256": "0" * 64}])


def test_the_keeper_removes_unused_files_without_a_request(server: Running, quick: list[Path]) -> None:
    """A site without rules also removes sent files. A sent file stays as long as a run needs the file."""
    other = send(server.ann, b"nobody's")
    send(server.ann)
    run = hand_in(server.ann, case())["id"]
    server.ann.wait_for(run)
    folder = server.ann.runs / uploads.FOLDER / "ann"
    for path in folder.iterdir():
        os.utime(path, (0, 0))
    server.service.removal.look()
    assert [path.name for path in folder.iterdir()] == [HASH]
    assert server.ann.http.get(f"/v1/files/{other}").status_code == 404
    server.ann.http.delete(f"/v1/runs/{run}")
    server.service.removal.look()
    assert not folder.exists()


def test_a_file_counts_once_for_each_user(server: Running, quick: list[Path]) -> None:
    """A sent file counts once, for any number of runs with this file. The limit of a run's output does not include the
    sent files of the run.
    """
    data = MESH + b"**" + b" " * 100_000
    sha256 = send(server.ann, data)
    runs = [hand_in(server.ann, case(sha256=sha256))["id"] for _ in range(3)]
    for run in runs:
        server.ann.wait_for(run)
        assert disk_usage.size(server.ann.runs / run) < 50_000
    kept = server.service.removal.kept_now("ann")
    assert len(data) < kept < 2 * len(data)
    assert server.ann.http.get("/v1/me").json()["used"]["output_bytes"] == kept
    assert server.service.removal.kept_now("bob") == 0


def test_a_file_is_gone_with_the_last_run_that_has_it() -> None:
    known = disk_usage.DiskUsage()
    for n, run in enumerate(("a", "b", "c")):
        known.note(run, "ann", 10, {(1, n % 2): 100})
    known.keep({"a", "b", "c"}, {"bob": {(1, 7): 5}})
    assert known.by_owner() == {"ann": 230, "bob": 5}
    left = disk_usage.Left(known)
    totals = [left.total]
    for run in ("a", "b", "c", "c"):
        left.drop(run)
        totals.append(left.total)
    assert totals == [235, 225, 115, 5, 5]


@pytest.mark.parametrize("read", [True, False])
def test_what_files_hold_is_measured_by_the_caps(
    settings: Settings, server: Running, monkeypatch: pytest.MonkeyPatch, read: bool
) -> None:
    """The content that the worker has read is compared with the limits; without the worker, an estimate by the size of
    the file is compared.
    """
    part = Surveyed(
        part=0, elements=5000, nodes=2000, faces=100, step_length=1e-3, altitude=1e-3, mass=1.0, low=(0.0, 0.0, 0.0),
        high=(1.0, 1.0, 1.0), momentum=(0.0, 0.0, 0.0), energy=0.0, speed=0.0, notes=[],
    )  # fmt: skip
    data = survey.to_json(Survey(parts=[part])) if read else b""
    monkeypatch.setattr(submission, "surveyed", lambda case, folder: data)
    server.service.desk._limits = limits.of(
        Settings(runs=settings.runs, slots=2, caps=Caps(elements=1000, free_disk=0))
    )
    sha256 = send(server.ann, MESH + b"**" + b" " * 200_000)
    line = hand_in(server.ann, case("rod.inp", sha256), 422)["detail"]
    assert line.startswith("parts: the case needs about ")
    assert line.endswith("elements; this server allows 1 000")
    assert ("5 000" in line) is read


def test_the_worker_reads_files_before_a_run_is_accepted(
    server: Running, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The real worker reads the files in a separate process. The estimate uses the content of the files, and a refusal
    has the worker's message.
    """
    monkeypatch.setenv("CONOID_CACHE_DIR", str(tmp_path / "cache"))
    send(server.ann)
    answer = server.ann.http.post("/v1/cases:validate", content=json.dumps(case("rod.inp", group="All")), headers=JSON)
    assert answer.json()["estimate"]["elements"] == 1
    (part,) = answer.json()["survey"]["parts"]
    assert part["mass"] == pytest.approx(7800.0 * 1e-6 / 6.0)
    line = hand_in(server.ann, case("rod.inp", group="ice"), 422)["detail"]
    assert line == "parts[0].mesh.group = 'ice': no such element set, instance or part; known: All"
    line = hand_in(server.ann, case("rod.txt"), 422)["detail"]
    assert line.startswith("parts[0].mesh.path = 'rod.txt': expected a file name that ends in ")
