"""Programs of a team: ranges are read when their stage begins, and kernels choose the next stage."""

import numpy as np
import pytest

from conoid.worker.kernels.jit import njit, types
from conoid.worker.parallel.arguments import Arguments, reader
from conoid.worker.parallel.program import Program, Span
from conoid.worker.parallel.projecting import Costs, Projecting
from conoid.worker.parallel.team import TASK, Stage, Team, team

KINDS = types.int64[::1], types.int64[::1], types.int64[::1]
_words = reader(*KINDS)
SIZE, END = 7, 5


@njit(TASK, cache=False)
def count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Kernel that adds 1 to each number of the range."""
    done, _, _ = _words(table)
    for k in range(first, stop):
        done[k] += 1


@njit(TASK, cache=False)
def extend(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Kernel that makes the range 13 longer; it repeats the counting until the range is 130 long, then ends the
    program.
    """
    _, lengths, control = _words(table)
    lengths[1] += 13
    control[0] = 0 if lengths[1] <= 130 else END


@njit(TASK, cache=False)
def never(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Kernel that overwrites the counts."""
    done, _, _ = _words(table)
    done[0] = -1000


def made(threads: Team) -> tuple[Program, np.ndarray, np.ndarray]:
    done, lengths, control = np.zeros(200, np.int64), np.array([1, 0, 0]), np.zeros(1, np.int64)
    table = Arguments(*KINDS)
    address = table.set(done, lengths, control)
    stages: list[Stage | Span] = [
        Span(count, address, lengths, 1, SIZE),
        Stage(count, address, np.array([[150, 151], [151, 152]]), np.array([0, 1, 1, 2])),
        Span(never, address, lengths, 2, SIZE),
        Span(extend, address, lengths, 0, 1),
        Span(never, address, lengths, 0, 1),
    ]
    program = Program(threads, stages, control)
    program.kept = table, done, lengths  # type: ignore[attr-defined]
    return program, done, lengths


def expected(rounds: int) -> np.ndarray:
    done = np.zeros(200, np.int64)
    for k in range(rounds):
        done[: 13 * k] += 1
        done[150:152] += 1
    return done


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_a_range_is_read_when_its_stage_begins_and_a_kernel_ends_the_program(threads: int) -> None:
    program, done, lengths = made(team(threads))
    for _ in range(200):
        done[:], lengths[1] = 0, 0
        assert program.run() == END
        assert (done == expected(11)).all()


@njit(TASK, cache=False)
def gather(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Adds to each number of its range the next number of the first half; ends the program after ten rounds."""
    done, _, control = _words(table)
    for k in range(first, stop):
        done[100 + k] += done[(k + 1) % 100]
    if first == 0 and done[1] % 10 == 0:
        control[0] = END


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_stages_of_a_program_come_one_after_the_other_in_every_round(threads: int) -> None:
    done, lengths, control = np.zeros(200, np.int64), np.array([100]), np.zeros(1, np.int64)
    table, tasks = Arguments(*KINDS), np.column_stack([np.arange(0, 100, 6), np.minimum(np.arange(6, 106, 6), 100)])
    address = table.set(done, lengths, control)
    one_by_one = Stage(count, address, tasks, np.array([0, 1, 9, 9, len(tasks)]))
    program = Program(team(threads), [one_by_one, Span(gather, address, lengths, 0, SIZE)], control)
    for _ in range(20):
        program.repeat()
    assert (done[:100] == 200).all()
    assert (done[100:] == 200 * 201 // 2).all()  # each has the counts of the first stage only
    assert (program.spent[:, 1] > 0).all()


@pytest.mark.parametrize("threads", [1, 2])
def test_a_program_is_run_in_parts(threads: int) -> None:
    program, done, lengths = made(team(threads))
    assert program.run(0, 3) == 3
    lengths[1] = 13
    assert program.run(0, 2) == 2
    assert (done == expected(2)).all()
    assert program.run(3) == END
    assert (done == expected(11)).all()


def test_a_range_of_one_task_is_no_time_in_regions() -> None:
    alone = Team(1)
    program, _, lengths = made(alone)
    before = alone.within
    program.run(2, 3)
    lengths[1] = SIZE
    program.run(0, 1)
    assert alone.within == before
    lengths[1] = SIZE + 1
    program.run(0, 1)
    assert alone.within > before


def test_timed_tasks_of_a_program_are_done_once(monkeypatch: pytest.MonkeyPatch) -> None:
    timed = Team(2)
    timed.projecting = Projecting(2, Costs(0, 0, 0))
    program, done, _ = made(timed)
    assert program.run() == END
    assert (done == expected(11)).all()
