"""Wall time of ranks and threads: the estimate is compared with computed values, and its text names the assumptions."""

import io

import pytest
from rich.console import Console

from conoid.cases.estimates.clock_time import clock_time
from conoid.cases.estimates.estimate import estimate
from conoid.cases.estimates.stages import CONTACT, STEPS, TETS
from conoid.cases.load import apply_overrides, parse_case, read_data, shipped_path
from conoid.cases.model.schema import Case
from conoid.client.commands.validated import estimate_table

COSTS = {TETS: 60.0, CONTACT: 30.0, STEPS: 10.0}


def demo(ranks: int, threads: int) -> Case:
    changes = {"run.ranks": ranks, "run.threads": threads}
    return parse_case(apply_overrides(read_data(shipped_path("demo")), changes))


def test_one_rank_of_one_thread_takes_its_core_time() -> None:
    took = clock_time(demo(1, 1), COSTS, 7.0)
    assert (took.seconds, took.breaking, took.ranks, took.threads) == (100.0, 7.0, 1.0, 1.0)


def test_threads_share_the_tets_and_nothing_else() -> None:
    took = clock_time(demo(1, 4), COSTS, 7.0)
    assert took.shared == 0.6
    assert took.seconds == pytest.approx(40.0 + 60.0 * 1.45 / 4.0)
    assert took.breaking == 7.0


def test_ranks_are_as_efficient_as_they_were_measured() -> None:
    assert [round(clock_time(demo(n, 1), COSTS, 0.0).ranks, 2) for n in (2, 4, 16)] == [0.66, 0.44, 0.19]
    assert clock_time(demo(16, 1), COSTS, 0.0).seconds == pytest.approx(100.0 / 16.0**0.4)


def test_the_assumptions_are_printed_with_the_time() -> None:
    def note(ranks: int, threads: int) -> str:
        case, out = demo(ranks, threads), io.StringIO()
        Console(file=out, width=200).print(estimate_table(case, estimate(case)))
        return next(line for line in out.getvalue().splitlines() if line.startswith("clock time"))

    assert "on 2 ranks x 4 threads; assumed: ranks 66 % efficient, 8" in note(2, 4)
    assert note(1, 1).rstrip().endswith("on 1 rank")
