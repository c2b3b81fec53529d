"""The real worker with the real server: from the HTTP request to a result, live over Zenoh."""

import base64
import hashlib
import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from conoid.cases.messages import fragments_from_msgpack, from_msgpack
from conoid.cases.output import snapshot
from conoid.cases.run import State

from .running import PATIENCE, Process, User

COLD = 240.0
"""Time limit of a run whose kernels must be compiled, s."""
BAR = """
name = "bar"

[[parts]]
name = "rod"
material = "steel"
velocity = ["0 m/s", "0 m/s", "-10 m/s"]
[parts.mesh]
shape = "box"
low = ["0 mm", "0 mm", "0 mm"]
high = ["1 mm", "1 mm", "4 mm"]
element_size = "0.5 mm"
generator = "structured"

[materials.steel]
density = "7800 kg/m^3"
elastic = {{ young = "200 GPa", poisson = 0.3 }}

[[boundaries]]
kind = "wall"
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]

[[probes]]
name = "push"
part = "rod"
field = "wall_force_z"

[run]
end_time = "{end_time}"
ranks = 2
frames = 3
"""


@pytest.fixture(scope="module")
def ann(tmp_path_factory: pytest.TempPathFactory) -> Iterator[User]:
    server = Process(tmp_path_factory.mktemp("worker") / "runs", ("--zenoh-port", "0", "--slots", "2"))
    yield server.user(server.start()["url"])
    server.close()


def ended(ann: User, run: str) -> dict[str, Any]:
    deadline = time.monotonic() + COLD
    while not State((seen := ann.show(run))["state"]).final:
        assert time.monotonic() < deadline, seen
        ann.http.get(f"/v1/runs/{run}", params={"wait": 5})
    return seen


def test_from_http_to_a_result_live(ann: User) -> None:
    access = ann.http.get("/v1/me").json()["zenoh"]
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [access["endpoint"]],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/auth/usrpwd": {"user": access["user"], "password": access["password"]},
    }.items():
        config.insert_json5(key, json.dumps(value))
    received: list[Any] = []
    blobs: dict[str, bytes] = {}
    over = threading.Event()

    def hear(sample: zenoh.Sample) -> None:
        received.append(from_msgpack(sample.payload.to_bytes()))
        if str(sample.key_expr).endswith("/fragments"):
            blobs[received[-1].sha256] = fragments_from_msgpack(sample.payload.to_bytes()).blob
        if getattr(received[-1], "state", "") == "succeeded" and type(received[-1]).__name__ == "Status":
            over.set()

    with zenoh.open(config) as session:
        subscriber = session.declare_subscriber(f"{access['prefix']}/**", hear)
        run = ann.submit(BAR.format(end_time="10 us"))
        seen = ended(ann, run)
        assert seen["state"] == "succeeded", seen
        assert over.wait(PATIENCE)
        subscriber.undeclare()  # type: ignore[no-untyped-call]

    events = ann.events(run)
    assert [event["seq"] for event in events] == list(range(1, len(events) + 1))
    assert {"started", "progress", "load", "frame", "finished", "status"} <= {event["type"] for event in events}
    states = ["accepted", "queued", "starting", "running", "succeeded"]
    assert list(dict.fromkeys(ann.states(run))) == states, "a cold start reports its progress more than once"
    assert {message.seq for message in received} <= set(range(1, len(events) + 1))
    assert {type(message).__name__ for message in received} >= {"Started", "Progress", "Load", "Finished"}
    assert len(seen["outcome"]["digest"]) == 64
    assert seen["outcome"]["elements"] == seen["estimate"]["elements"]
    for name in ("frames/000003.vtkhdf", "history.csv", "log/rank-1.log"):
        answer = ann.http.get(f"/v1/runs/{run}/files/{name}")
        digest = base64.b64encode(hashlib.sha256(answer.content).digest()).decode()
        assert answer.headers["repr-digest"] == f"sha-256=:{digest}:"

    listed = ann.http.get(f"/v1/runs/{run}/snapshots").json()["snapshots"]
    assert listed == [event for event in events if event["type"] == "snapshot"]
    assert [listed[0]["cause"], listed[-1]["cause"]] == ["start", "end"]
    for one in listed:
        answer = ann.http.get(f"/v1/runs/{run}/snapshots/{one['n']}")
        assert hashlib.sha256(answer.content).hexdigest() == one["sha256"] == answer.headers["etag"].strip('"')
        assert blobs.get(one["sha256"], answer.content) == answer.content
        assert snapshot.header_of(answer.content).fragments_total == one["fragments"] == 1
    assert listed[-1]["sha256"] in blobs
    course = ann.http.get(f"/v1/runs/{run}/history").json()
    assert course["last"] == len(events)
    assert course["snapshots"] == listed
    assert course["series"]["step"][-1] == seen["outcome"]["steps"]
    _are_lines_of_the_history(ann, run, [event for event in events if event["type"] == "progress"])


def _are_lines_of_the_history(ann: User, run: str, messages: list[dict[str, Any]]) -> None:
    """Requires that the probes and the energy of each report are equal to the line of history.csv at the same time."""
    values = ann.http.get(f"/v1/runs/{run}/columns", params={"name": "*", "points": 8192}).json()["values"]
    names = list(messages[-1]["probes"])
    assert names
    assert messages[-1]["sampled"] == values["t"][-1]
    for report in messages:
        at = values["t"].index(report["sampled"])
        assert report["probes"] == {name: values[name][at] for name in names}
        assert report["energy"]["kinetic"] == values["kinetic"][at]


def test_cancel(ann: User) -> None:
    run = ann.submit(BAR.format(end_time="10 s"))
    ann.wait_for(run, State.RUNNING)
    while not ann.show(run)["progress"]:
        time.sleep(0.05)
    ann.http.post(f"/v1/runs/{run}:cancel")
    seen = ended(ann, run)
    assert (seen["state"], seen["cause"], seen["outcome"]["state"]) == ("cancelled", "cancelled", "cancelled")
    assert seen["outcome"]["steps"] > 0
    assert not Path(f"/proc/{json.loads((ann.runs / run / 'worker.json').read_text())['pid']}").exists()


@pytest.mark.slow
def test_a_run_that_was_cancelled_goes_on_as_a_new_one_to_the_same_digest(ann: User) -> None:
    """The new run has another number of ranks than the first run. Files of the first run are in the folder of the new
    run.
    """
    text = BAR.format(end_time="600 us")
    whole = ended(ann, ann.submit(text))
    run = ann.submit(text)
    while not (ann.show(run)["progress"] or {}).get("step", 0) > 50:
        ann.http.get(f"/v1/runs/{run}", params={"wait": 0.1})
    ann.http.post(f"/v1/runs/{run}:cancel")
    assert ended(ann, run)["state"] == "cancelled"
    answer = ann.http.post(f"/v1/runs/{run}:restart", params={"ranks": 1})
    assert answer.status_code == 202, answer.text
    last = ended(ann, answer.json()["id"])
    assert (last["state"], last["outcome"]["ranks"]) == ("succeeded", 1), last["message"]
    assert last["outcome"]["digest"] == whole["outcome"]["digest"]
    first, second = (ann.runs / one["id"] for one in (whole, last))
    assert (first / "history.csv").read_text().count("\n") == (second / "history.csv").read_text().count("\n")
    assert sorted(p.name for p in (first / "frames").iterdir()) == sorted(p.name for p in (second / "frames").iterdir())
