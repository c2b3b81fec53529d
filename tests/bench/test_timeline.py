"""Tests of the computed waiting times between ranks, with calls whose times are known."""

import pickle
from pathlib import Path

import pytest

from conoid.client.studies.projection import Network
from conoid.worker.parallel.tags import Tag

from .tape import Player, tape
from .timeline import CALL, MESSAGE, Call, DeadlockError, Timeline

NETWORK = Network(latency=1.0, bandwidth=10.0)


def test_a_message_arrives_a_latency_and_its_bytes_after_it_was_sent() -> None:
    line = Timeline([[Call(3.0, sends=[(1, 7, 20)])], [Call(1.0, receives=[(0, 7)]), Call(2.0)]], NETWORK)
    assert line.run() == pytest.approx(3.0 + 2 * MESSAGE + 2 * CALL + 1.0 + 2.0 + 2.0)
    assert line.waited == pytest.approx([0.0, 2.0 + 1.0 + 2.0 + MESSAGE])


def test_messages_of_a_tag_come_in_the_order_in_which_they_were_sent() -> None:
    sends = [Call(1.0, sends=[(1, 7, 0)]), Call(1.0, sends=[(1, 8, 0), (1, 7, 0)])]
    takes = [Call(0.0, receives=[(0, 7), (0, 7)]), Call(0.0, receives=[(0, 8)])]
    assert Timeline([sends, takes], NETWORK).run() == pytest.approx(3.0, abs=1e-4)


def test_a_collective_ends_for_all_when_the_last_has_come() -> None:
    waits = [Call(1.0, enters=True), Call(2.0, leaves=1)]
    late = [Call(7.0, enters=True), Call(0.0, leaves=1)]
    line = Timeline([waits, late, waits, waits], NETWORK)
    assert line.run() == pytest.approx(7.0 + 2 * 2 * 1.0, abs=1e-4)
    assert line.waited[0] == pytest.approx(7.0 + 4.0 - 3.0, abs=1e-4)
    assert line.waited[1] == pytest.approx(4.0, abs=1e-4)


def test_mismatched_collective_calls_are_reported() -> None:
    with pytest.raises(DeadlockError, match=r"ranks \[0, 1\]"):
        Timeline([[Call(0.0, receives=[(1, 7)])], [Call(0.0, receives=[(0, 7)])]], NETWORK).run()


def test_a_replayed_rank_receives_the_recorded_data_and_counts_from_the_first_step(tmp_path: Path) -> None:
    sent = [5, {1: b"", 3: b""}, [1, 2]]
    tape(tmp_path, 0).write_bytes(b"".join(map(pickle.dumps, sent)))
    player = Player(tmp_path, 0, 4)
    assert player.broadcast(None) == 5
    player.sent.since_last()
    assert player.swap({}) == sent[1]
    assert player.share(None) == sent[2]
    player.close()
    assert [(call.enters, call.leaves, call.receives) for call in player.calls] == [
        (True, 1, [(1, Tag.SWAP), (3, Tag.SWAP)]), (True, 2, []),
    ]  # fmt: skip
    assert all(0.0 <= call.work < 0.1 for call in player.calls)
