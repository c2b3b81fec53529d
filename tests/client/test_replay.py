"""Replay of a run's loads with other policies of load balance, for loads whose result is known."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from typer.testing import CliRunner

from conoid.cases.messages import AnyMessage, Balance, Groups, Load, to_json
from conoid.cases.model.schema import Balance as Spec
from conoid.client.cli import app
from conoid.client.errors import ClientError
from conoid.client.studies import replay
from conoid.worker.parallel import decompose
from conoid.worker.parallel.comm import SerialComm

COST = 12.0
"""Cost of a decomposition, s."""


def spot(window: int) -> int:
    """Returns the number of the loaded group: each of eight groups has the load for two windows of ten steps."""
    return (window - 1) // 2


def wandering() -> list[AnyMessage]:
    """Returns load messages in which one group has the whole load, 1 s per step. Groups that have had the load have 20
    surface nodes, all other groups have 10.
    """
    row = [(float(x), 0.0, 0.0) for x in range(8)]
    sent: list[AnyMessage] = [
        Groups(run="r", seq=1, load=[0] * 8, outside=[10] * 8, centres=row, tets=[5] * 8, cost=COST)
    ]
    for window in range(1, 17):
        load = [10**9 * (group == spot(window)) for group in range(8)]
        outside = [20 if group <= spot(window) else 10 for group in range(8)]
        sent.append(Groups(run="r", seq=1 + window, step=10 * window, load=load, outside=outside))
    return sent


def account(words: str, sent: Sequence[AnyMessage] | None = None, ranks: int = 2) -> replay.Account:
    record = replay.read(sent if sent is not None else wandering())
    return replay.replay(record, replay.chosen(Spec(), words), ranks, record.cost)


def test_never_loses_half_of_the_load_on_two_ranks() -> None:
    """One rank has the whole load, and the mean is half of the load: each of 160 steps loses 0.5 s."""
    never = account("never")
    assert (never.cuts, never.lost, never.work, never.imbalance) == ([], 80.0, 80.0, 2.0)


def test_every_ten_steps_halves_the_load_in_the_second_window_of_each_place() -> None:
    """Each decomposition divides the group that has the load; no decomposition follows the last step."""
    every = account("every:10")
    assert every.cuts == list(range(10, 160, 10))
    assert (every.lost, every.cost, every.total) == (40.0, 15 * COST, 40.0 + 15 * COST)


def test_steps_between_two_moments_are_cut_at_too() -> None:
    """In each window of ten steps there are decompositions at steps 4 and 8, with the loads of all ten steps. The
    loaded group is divided from step 4 on; the decomposition at step 8 changes nothing.
    """
    every = account("every:4")
    assert every.cuts == list(range(4, 160, 4))
    assert every.lost == pytest.approx(8 * 4 * 0.5)


def test_measured_cuts_when_a_cut_has_been_lost() -> None:
    """A window in which the loaded group is not divided loses 5 s; the limit for a decomposition is 12 s. The first
    decomposition is in the third window; later every fourth window has one, because each decomposition divides the
    loaded group for one more window.
    """
    measured = account("measured")
    assert measured.cuts == [30, 70, 110, 150]
    assert (measured.lost, measured.cost) == (60.0, 4 * COST)


def test_outside_cuts_when_a_rank_has_grown() -> None:
    """The surface nodes of the two ranks are 40 and 40 at first, then 30 + 10 and 80 - 10 + 10 after the first
    decomposition.
    """
    outside = account("outside")
    assert outside.cuts == [10, 50, 90, 110, 130, 150]
    assert outside.lost == 50.0


def test_one_rank_has_nothing_to_cut() -> None:
    alone = account("every:10", ranks=1)
    assert (alone.cuts, alone.lost, alone.work) == ([], 0.0, 160.0)


def test_a_constant_cost_of_a_rank_is_not_counted_as_loss() -> None:
    sent = [m if not i else replace(m, rank=10**9) for i, m in enumerate(wandering())]
    never = account("never", sent)
    assert (never.lost, never.work) == (80.0, 80.0 + 160.0)


def cut(step: int, cost: float) -> Balance:
    return Balance(run="r", step=step, cause="", before={}, predicted=[], tets=1, nodes=1, cost=cost, saved=0.0)


def test_the_cost_is_the_mean_of_the_cuts_of_the_run_and_its_own_line_is_what_happened() -> None:
    phases = {"elements": [6.0, 1.0], "nodes": [1.0, 1.0], "contact": [0.0, 1.0], "fracture": [0.0, 0.0]}
    load = Load(run="r", step=30, phases=phases | {"exchange": [9.0, 0.0]}, imbalance=1.4)
    sent = [*wandering(), load, cut(30, 2.0), cut(60, 4.0)]
    record = replay.read(sent, "every:30")
    happened = record.happened
    assert record.cost == 3.0
    assert (happened.ranks, happened.cuts, happened.lost, happened.cost) == (2, [30, 60], 2.0, 6.0)
    assert (happened.work, happened.imbalance, happened.policy) == (5.0, 1.4, "every:30")


def test_a_run_that_goes_on_from_a_checkpoint_is_read_once() -> None:
    sent = wandering()
    again = [sent[0], *sent[9:]]
    resumed = replace(again[0], step=80)
    assert account("measured", [*sent[:12], resumed, *again[1:]]) == account("measured")


def test_a_run_without_load_messages_is_refused() -> None:
    for sent in ([], wandering()[:1], wandering()[1:]):
        with pytest.raises(ClientError, match="has no loads of groups"):
            replay.read(sent)
    with pytest.raises(ClientError, match="ranks = 9: allowed: 1 to 8"):
        account("never", ranks=9)


@pytest.mark.parametrize("words", ["evry:10", "never:3", "every:", "every:0", "every:x", ""])
def test_an_unknown_policy_is_refused(words: str) -> None:
    with pytest.raises(ClientError, match=r"allowed: measured, outside, every, every:N, never"):
        replay.chosen(Spec(), words)


def test_alpha_and_every_go_into_the_policy() -> None:
    assert replay.named(replay.chosen(Spec(), "outside", 1.5)) == "outside 1.5"
    assert replay.named(replay.chosen(Spec(), "every:70")) == "every:70"
    assert replay.named(replay.chosen(Spec(every=30), "every")) == "every:30"
    with pytest.raises(ClientError, match="alpha = 1"):
        replay.chosen(Spec(), "outside", 1.0)


@pytest.mark.parametrize("ranks", [2, 3, 5, 8, 16])
def test_the_division_is_that_of_the_worker(ranks: int) -> None:
    """The replay and the worker differ by at most one point for each cut: the replay divides the point at a cut, and
    the worker gives the whole point to one side. The longest axis of the points is unambiguous.
    """
    random = np.random.default_rng(ranks)
    points = random.uniform(size=(400, 3)) * [16.0, 3.0, 0.5]
    weights = random.uniform(0.1, 1.0, 400)
    held = replay.divide([tuple(p) for p in points.tolist()], weights.tolist(), ranks)
    whole = np.zeros((ranks, 400))
    for rank, shares in enumerate(held):
        whole[rank, [g for g, _ in shares]] = [share for _, share in shares]
    assert whole.sum(axis=0) == pytest.approx(np.ones(400))
    assert whole @ weights == pytest.approx(np.full(ranks, weights.sum() / ranks))
    owner, _ = decompose.bisect(points, np.arange(400), weights, ranks, SerialComm())
    assert (whole.argmax(axis=0) != owner).sum() <= 2 * ranks


def test_groups_without_weight_do_not_stop_a_division() -> None:
    assert replay.divide([(0.0, 0.0, 0.0)] * 3, [0, 0, 0], 2) == [[], [(0, 1.0), (1, 1.0), (2, 1.0)]]
    assert [len(shares) for shares in replay.divide([(0.0, 0.0, 0.0)], [1], 4)] == [1, 1, 1, 1]


def run_folder(folder: Path) -> Path:
    folder.mkdir()
    (folder / "journal.jsonl").write_bytes(b"".join(to_json(m) + b"\n" for m in wandering()) + b'{"type": "gro')
    phases = {name: [1.0, 3.0] for name in ("elements", "nodes", "contact", "fracture")}
    load = Load(run="r", seq=99, step=160, phases=phases, imbalance=1.5)
    with (folder / "journal.jsonl").open("ab") as file:
        file.write(b"\n" + to_json(load) + b"\n")
    case = {"balance": {"policy": "every", "every": 10}, "run": {"cut_scale": [1.0, 1.0, 1.0]}}
    (folder / "case.resolved.json").write_text(json.dumps(case))
    return folder


def test_the_command_compares_all_policies_in_a_folder(tmp_path: Path) -> None:
    folder = str(run_folder(tmp_path / "run"))
    printed = CliRunner().invoke(app, ["replay-balance", folder, "--policy", "measured", "--json"])
    assert printed.exit_code == 0, printed.output
    data = json.loads(printed.stdout)
    assert [(p["policy"], p["total"]) for p in data["policies"]] == [
        ("measured", 108.0), ("outside 1.2", 122.0), ("every:10", 220.0), ("never", 80.0),
    ]  # fmt: skip
    assert (data["run"]["policy"], data["run"]["lost"], data["heaviest_group"]) == ("every:10", 4.0, 1.0)
    shown = CliRunner().invoke(app, ["replay-balance", folder, "--cost", "1", "--ranks", "4"])
    assert shown.exit_code == 0, shown.output
    assert shown.stdout.splitlines()[2].split()[:2] == ["every:10", "15"]
    assert "on 4 ranks, the run had 2; a new decomposition costs 1.00 s; 17 moments, 8 groups" in shown.stdout
    assert "the run: every:10" in shown.stdout
    refused = CliRunner().invoke(app, ["replay-balance", folder, "--policy", "sometimes"])
    assert (refused.exit_code, refused.stderr[:30]) == (2, "conoid: policy = 'sometimes', ")
