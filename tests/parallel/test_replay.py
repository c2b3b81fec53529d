"""A recorded run: the records of its groups of tets, and its replay."""

import json
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from conoid.cases.messages import Groups
from conoid.client.result import Result

from .launching import together

CASE = Path(__file__).with_name("breaking.toml")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], Path]:
    """Returns the folder of a run of some dozens of steps by the number of ranks, with a new decomposition every 8
    steps.
    """
    root = tmp_path_factory.mktemp("recorded")

    @cache
    def folder(ranks: int) -> Path:
        found = root / str(ranks) / "run"
        changes = ("run.end_time=0.6 us", "balance.policy=every", "balance.every=8")
        words = [word for change in changes for word in ("--set", change)]
        together(ranks, found.parent, [[str(CASE), "--out", str(found), *words]])
        return found

    return folder


def groups(folder: Path) -> list[Groups]:
    return [m for m in Result.open(folder).messages if isinstance(m, Groups)]


@pytest.mark.slow
def test_a_run_records_equal_groups_on_any_number_of_ranks(run: Callable[[int], Path]) -> None:
    one, two = groups(run(1)), groups(run(2))
    assert (one[0].centres, one[0].tets, one[0].outside) == (two[0].centres, two[0].tets, two[0].outside)
    assert (one[-1].step, one[-1].outside) == (two[-1].step, two[-1].outside)


def test_a_run_begins_and_ends_with_its_groups(moving: Path) -> None:
    before = groups(moving)
    assert [bool(m.centres) for m in before] == [True] + [False] * (len(before) - 1)
    assert (before[0].step, before[0].load) == (0, [0] * 256)
    assert all(map(any, zip(*(m.load for m in before), strict=True))), "each has cost something; some erode to the end"
    assert sum(before[-1].outside) > sum(before[0].outside), "something has broken"


def test_the_replay_of_a_run_has_its_cuts(moving: Path) -> None:
    command = [sys.executable, "-m", "conoid.client.cli", "replay-balance", str(moving), "--json"]
    answer = json.loads(subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout)
    happened, replayed = answer["run"], answer["policies"][0]
    assert (happened["policy"], happened["ranks"]) == ("every:5", 3)
    assert happened["cuts"] == replayed["cuts"] == list(range(5, groups(moving)[-1].step, 5))
    assert len(replayed["cuts"]) > 1
    assert replayed["cost"] == pytest.approx(happened["cost"])
    assert 0.0 < replayed["lost"] < replayed["work"]
    assert [p["policy"] for p in answer["policies"]] == ["every:5", "measured", "outside 1.2", "never"]
