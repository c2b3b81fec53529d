"""Messages, outcome, states and Zenoh keys: the contract between client, server and worker."""

import typing
from pathlib import Path

import msgspec
import pytest

from conoid.cases import messages, outcome
from conoid.cases.output import keys, layout
from conoid.cases.run import FINAL, FOLLOWERS, State

ENERGY = messages.Energy(
    kinetic=1.0, elastic=2.0, plastic=3.0, viscous=4.0, contact=5.0, external=6.0, initial=7.0, residual=1e-17
)
EXAMPLES: list[messages.AnyMessage] = [
    messages.Status(run="r", seq=1, state=State.RUNNING, cause=None, message="all ranks up"),
    messages.Started(run="r", seq=2, ranks=2, elements=6, nodes=8, end_time=1e-3, setup=0.5, parts={"rod": 6}),
    messages.Progress(
        run="r", seq=3, step=7, t=1e-6, end_time=1e-3, dt=1e-9, limiter="tet 3 of rod: sound", eta=3.0, energy=ENERGY,
        updates_per_second=1e7, parts={"rod": messages.PartEnergy(kinetic=1.0, internal=9.0)},
        sampled=9e-7, probes={"push": 1.5, "hole": None},
    ),
    messages.Load(run="r", seq=4, phases={"forces": [0.1, 0.2]}, imbalance=4 / 3),
    messages.Balance(
        run="r", seq=9, step=200, cause="time lost exceeds the cost", before={"elements": [1e-3, 3e-3]},
        predicted=[2e-3, 2e-3], tets=12, nodes=9, cost=0.25, saved=0.5,
    ),
    messages.Groups(
        run="r", seq=11, load=[120, 80], outside=[4, 4], centres=[(0.0, 0.0, 0.25), (0.0, 0.0, 0.75)], tets=[3, 3],
        cost=0.5,
    ),
    messages.Checkpoint(
        run="r", seq=10, step=200, path="checkpoints/000000200", bytes=1024, seconds=0.1, cause="asked for"
    ),
    messages.Counts(run="r", seq=5, elements=6, nodes=8, shared=4, fragments=1, elements_per_rank=[3, 3]),
    messages.Frame(run="r", seq=6, index=12, path="frames/000012.vtkhdf"),
    messages.Snapshot(
        run="r", seq=12, step=200, t=1e-6, n=3, path="snapshots/000003.snap", bytes=1024, triangles=12, fragments=2,
        sha256="0" * 64, cause="asked for", dropped=1, smallest=-14, sizes=[1, 0, 1],
    ),
    messages.Log(run="r", seq=7, level="warning", text="a rank waits", rank=1),
    messages.Finished(run="r", seq=8, state=State.SUCCEEDED, digest="0" * 64, steps=7, elapsed=1.5),
]  # fmt: skip


def test_there_is_an_example_of_every_message() -> None:
    assert {type(example) for example in EXAMPLES} == set(typing.get_args(messages.AnyMessage))


@pytest.mark.parametrize("message", EXAMPLES, ids=lambda message: type(message).__name__)
def test_messages_travel_unchanged(message: messages.AnyMessage) -> None:
    line = messages.to_json(message)
    assert b"\n" not in line
    assert messages.from_json(line) == message
    assert messages.from_msgpack(messages.to_msgpack(message)) == message
    plain = msgspec.json.decode(line)
    assert plain["type"] == type(message).__name__.lower()
    assert plain["v"] == messages.VERSION
    assert message.channel in keys.CLASSES


def test_a_snapshot_travels_with_its_bytes_and_is_read_without() -> None:
    snapshot = next(example for example in EXAMPLES if isinstance(example, messages.Snapshot))
    payload = messages.to_msgpack(messages.with_blob(snapshot, b"CONOSNAP"))
    assert messages.from_msgpack(payload) == snapshot
    both = messages.fragments_from_msgpack(payload)
    assert both.blob == b"CONOSNAP"
    assert messages.without_blob(both) == snapshot


def test_a_reader_ignores_fields_of_later_versions() -> None:
    later = b'{"type": "frame", "run": "r", "seq": 6, "v": 2, "index": 1, "path": "p", "colour": "red"}'
    assert messages.from_json(later) == messages.Frame(run="r", seq=6, v=2, index=1, path="p")


@pytest.mark.parametrize("line", [b'{"type": "gossip", "run": "r"}', b'{"type": "frame", "run": "r"}', b"[]"])
def test_an_invalid_message_is_refused(line: bytes) -> None:
    with pytest.raises(msgspec.ValidationError):
        messages.from_json(line)


def test_an_outcome_travels_unchanged() -> None:
    check = outcome.Check(name="extent rod z", value=1.0, expected=1.1, tolerance=0.2, passed=True, source="paper")
    ended = outcome.Outcome(state=State.SUCCEEDED, steps=3, energy=ENERGY, phases={"forces": [1.0]}, reference=[check])
    text = outcome.to_json(ended)
    assert outcome.from_json(text) == ended
    assert msgspec.json.decode(text)["reference"][0]["pass"] is True


def test_final_states_have_no_followers_and_the_others_reach_one() -> None:
    assert set(FOLLOWERS) == set(State)
    for state in State:
        assert state.final == (state in FINAL) == (not FOLLOWERS[state])
        reached, ahead = {state}, {state}
        while ahead:
            ahead = {follower for one in ahead for follower in FOLLOWERS[one]} - reached
            reached |= ahead
        assert reached & FINAL


def test_keys() -> None:
    prefix = keys.run_prefix("ann", "20260101-1")
    assert prefix == "conoid/v1/ann/20260101-1"
    assert prefix.startswith(keys.owner_prefix("ann") + "/")
    assert keys.message_key(prefix, "event") == "conoid/v1/ann/20260101-1/event"
    assert keys.alive(prefix).startswith(prefix)
    with pytest.raises(ValueError, match="unknown message class 'gossip'; known: state, event"):
        keys.message_key(prefix, "gossip")


@pytest.mark.parametrize("chunk", ["", "a/b", "*", "a b", "$", "@x", "?", "#", "é"])
def test_a_key_cannot_be_broken_out_of(chunk: str) -> None:
    with pytest.raises(ValueError, match="is not allowed in a Zenoh key"):
        keys.run_prefix(chunk, "run")
    with pytest.raises(ValueError, match="is not allowed in a Zenoh key"):
        keys.run_prefix("owner", chunk)


def test_frames_sort_by_name() -> None:
    folder = Path("run")
    assert layout.frame(folder, 12) == folder / "frames" / "000012.vtkhdf"
    assert str(layout.frame(folder, 9)) < str(layout.frame(folder, 10))
    assert layout.rank_log(folder, 0) == folder / "log" / "rank-0.log"
