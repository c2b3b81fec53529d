"""Scheduling of waiting runs: shares, priorities, backfill with a reservation, memory. The tested functions are pure
functions without a clock.
"""

import math
import random
from collections.abc import Sequence

import pytest

from conoid.cases.site.policy import Share
from conoid.server.queue.scheduling import Busy, Need, Room, ordered, plan
from conoid.server.queue.usage import Took, Usage
from conoid.server.queue.waitlist import need_of
from conoid.server.runs.folder import Submission

NOW = 1000.0


def need(run: str, owner: str = "ann", ranks: int = 1, **more: float) -> Need:
    return Need(run, owner, ranks, **more)  # type: ignore[arg-type]


def free(need: Need, starts: Sequence[Need]) -> str:
    """Returns no reason to hold a run."""
    return ""


def started(queue: list[Need], busy: list[Busy], room: Room) -> list[str]:
    return plan(queue, busy, room, NOW, free).start


def test_a_hundred_runs_of_one_user_do_not_delay_another_user() -> None:
    queue = [need(f"a{n:03}", seconds=10.0) for n in range(100)] + [need("b000", "bob", seconds=10.0)]
    assert [one.run for one in ordered(queue, {"ann": 20.0}, {})][:2] == ["b000", "a000"]


def test_owners_take_turns_by_what_their_runs_cost() -> None:
    queue = [need(f"a{n}", seconds=30.0) for n in range(3)] + [need(f"b{n}", "bob", seconds=10.0) for n in range(4)]
    assert [one.run for one in ordered(queue, {}, {})] == ["a0", "b0", "b1", "b2", "a1", "b3", "a2"]


def test_a_larger_share_comes_more_often() -> None:
    queue = [need(f"{owner[0]}{n}", owner, seconds=10.0) for owner in ("ann", "bob") for n in range(4)]
    found = [one.run for one in ordered(queue, {}, {"bob": Share(share=3.0)})]
    assert found[:5] == ["a0", "b0", "b1", "b2", "a1"]


def test_the_site_puts_users_first_and_a_user_his_own_runs() -> None:
    queue = [need("1"), need("2", priority=5), need("3", "bob"), need("4", "eve", priority=100)]
    found = ordered(queue, {"bob": 1e9}, {"bob": Share(priority=1)})
    assert [one.run for one in found] == ["3", "2", "4", "1"]


def test_use_counts_half_after_a_half_life() -> None:
    usage = Usage(100.0)
    usage.begin([Took("ann", 2, 0.0, 50.0), Took("ann", 1, 0.0, 150.0)])
    assert usage.of("ann", 150.0) == pytest.approx(50.0 + 150.0)
    assert usage.of("ann", 250.0) == pytest.approx(100.0)
    assert usage.of("ann", 0.0) == pytest.approx(200.0), "a clock that was set back gives nothing back"
    assert usage.of("bob", 250.0) == 0.0


def test_a_run_waits_for_a_core_for_each_thread_of_each_rank() -> None:
    submission = Submission(
        id="r", owner="ann", name="bar", title="", ranks=2, threads=3, submitted=NOW, case_file="case.toml",
        body_sha256="", idempotency_key=None, wall_time=None, estimate={"core_seconds": 60.0},
    )  # fmt: skip
    asked = need_of(submission, 0.0)
    assert (asked.cores, asked.seconds) == (6, 10.0)
    assert plan([asked], [Busy(3)], Room(8), NOW, free).why == {"r": "waiting for 6 of 8 slots; 5 free"}
    assert started([asked], [Busy(2)], Room(8)) == ["r"]


def test_a_small_run_that_ends_in_time_passes_a_large_one() -> None:
    busy = [Busy(3, ends=NOW + 100.0)]
    large = need("large", ranks=4)
    assert started([large, need("short", limit=90.0)], busy, Room(4)) == ["short"]
    assert started([large, need("long", limit=110.0)], busy, Room(4)) == []
    assert started([large, need("for ever")], busy, Room(4)) == []


def test_an_unknown_end_of_a_run_is_not_skipped() -> None:
    large = need("large", ranks=4)
    for ends in (0.0, NOW - 5.0):
        assert started([large, need("short", limit=1.0)], [Busy(3, ends=ends)], Room(4)) == []


def test_a_run_passes_that_leaves_the_large_one_its_room() -> None:
    busy, large = [Busy(4), Busy(2)], need("large", ranks=4)
    assert started([large, need("1", ranks=2), need("2", ranks=2)], busy, Room(8)) == []
    assert started([large, need("1", ranks=2)], [Busy(6)], Room(8)) == ["1"], "6 come free at once, and 4 are asked for"
    assert started([large, need("1", ranks=2), need("2")], [Busy(5)], Room(8)) == ["1", "2"]


def test_memory_is_summed_over_what_runs() -> None:
    queue = [need("1", memory=3e9), need("2", memory=3e9), need("3", memory=1e9)]
    made = plan(queue, [Busy(1, 4e9)], Room(8, 8e9), NOW, free)
    assert made.start == ["1"]
    assert made.why["2"] == "waiting for 3.00 GB of 8.00 GB of memory; 1.00 GB free"
    assert made.why["3"] == "waiting for 1 run before it"


@pytest.mark.parametrize(
    ("dust", "room", "memory"), [(0.0, math.inf, 3e9), (2e9, math.inf, 5e9), (2e9, 4e9, 4e9), (2e9, 1e9, 3e9)]
)
def test_parts_that_may_break_reserve_memory_for_fragments(dust: float, room: float, memory: float) -> None:
    """A run whose memory exceeds that of the server only after all tets separate starts alone. A run whose memory
    exceeds that of the server from the start does not start.
    """
    estimate: dict[str, int | float] = {"memory_bytes": 3e9, **({"dust_bytes": dust} if dust else {})}
    made = Submission(
        id="1", owner="ann", name="", title="", ranks=1, submitted=0.0, case_file="case.toml", body_sha256="",
        idempotency_key=None, wall_time=None, estimate=estimate,
    )  # fmt: skip
    assert need_of(made, 1.0, room).memory == memory


def test_a_held_run_delays_no_other() -> None:
    def blocked(need: Need, starts: Sequence[Need]) -> str:
        return "no more than one" if need.owner == "ann" and any(one.owner == "ann" for one in starts) else ""

    made = plan([need("1"), need("2", ranks=8), need("3", "bob")], [], Room(2), NOW, blocked)
    assert (made.start, made.why) == (["1", "3"], {"2": "no more than one"})


def test_a_run_that_can_never_start_delays_no_other() -> None:
    """The server was started again with fewer slots or less memory."""
    made = plan([need("0", ranks=4), need("1", memory=9e9), need("2")], [], Room(2, 4e9), NOW, free)
    assert made.start == ["2"]
    assert made.why == {
        "0": "the run needs 4 slots, this server has 2: it cannot start here",
        "1": "the run needs 9.00 GB of memory, this server has 4.00 GB: it cannot start here",
    }


def test_no_backfill_ever_delays_the_first_that_waits() -> None:
    """Random queues are simulated with true times of the runs, which differ from the estimates. The large run starts at
    the time at which it would start without the small runs.
    """
    dice = random.Random(4)
    passed = 0
    for _ in range(300):
        room = Room(dice.randint(4, 12))
        ends: list[tuple[int, float]] = []
        ranks = room.cores
        while ranks > 1 and len(ends) < 4:
            one = dice.randint(1, max(1, ranks - 1))
            ends.append((one, dice.uniform(1.0, 50.0)))
            ranks -= one
        large = need("large", ranks=min(room.cores, ranks + dice.randint(1, 3)))
        small = [need(f"s{n}", ranks=dice.randint(1, 2), seconds=0.0) for n in range(3)]
        begins = plan([large, *small], [Busy(ranks_) for ranks_, _ in ends], room, NOW, free).start
        if "large" in begins:
            continue
        taken = sum(one.cores for one in small if one.run in begins)
        passed += bool(taken)
        assert first_fit(large, ends, room.cores) == first_fit(large, ends, room.cores - taken)
    assert passed > 20


def first_fit(large: Need, ends: list[tuple[int, float]], slots: int) -> float:
    """Returns the time at which the given number of ranks is free, from the true ends of the active runs."""
    left = slots - sum(ranks for ranks, _ in ends)
    if left >= large.cores:
        return 0.0
    for ranks, end in sorted(ends, key=lambda one: one[1]):
        left += ranks
        if left >= large.cores:
            return end
    return math.inf
