"""Threads of a rank: each task is done once, colour after colour, and kernels get their arguments from a table."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from conoid.worker.elements.colours import coloured, joined
from conoid.worker.kernels.jit import njit, several, types
from conoid.worker.mesh.structured import structured
from conoid.worker.model.state import CHUNK, Block
from conoid.worker.parallel.arguments import Arguments, Handle, reader, table_of
from conoid.worker.parallel.team import TASK, team
from conoid.worker.run import main
from tests.bench.scene import box

_I1, _F2 = types.int64[::1], types.float64[:, ::1]
KINDS = several(_F2, types.boolean, _I1), types.float64, types.int64
COUNTS = (_I1, _I1)
_arguments, _counts = reader(*KINDS), reader(*COUNTS)
_first, _second = table_of(0, _I1), table_of(1, *KINDS)


@njit("UniTuple(float64, 5)(int64)", cache=False)
def arguments_read(table):  # type: ignore[no-untyped-def]
    (values, flag, numbers), factor, shift = _arguments(table)
    return values[1, 2], 1.0 if flag else 0.0, float(numbers[-1]), factor, float(shift)


@njit(TASK, cache=False)
def count(table, first, end, thread):  # type: ignore[no-untyped-def]
    """Counts each number of the range, and records the thread that has done the range."""
    done, who = _counts(table)
    for k in range(first, end):
        done[k] += 1
        who[k] = thread


def test_a_kernel_gets_what_the_table_was_given_last() -> None:
    table, values = Arguments(*KINDS), np.arange(6.0).reshape(2, 3)
    assert arguments_read(table.set((values, True, np.array([7, 8])), 0.5, -3)) == (5.0, 1.0, 8.0, 0.5, -3.0)
    values[1, 2] = 9.0
    grown = np.array([1, 2, 3])
    last = values, False, grown
    assert arguments_read(table.set(last, 0.25, 4)) == (9.0, 0.0, 3.0, 0.25, 4.0)
    assert arguments_read(table.set(last, 0.5, 4)) == (9.0, 0.0, 3.0, 0.5, 4.0)
    assert arguments_read(table.set((values, True, grown[:2]), 0.5, 4)) == (9.0, 1.0, 2.0, 0.5, 4.0)


@njit("Tuple((int64, float64, int64))(int64)", cache=False)
def read_both(handle):  # type: ignore[no-untyped-def]
    """Values of the two argument tables of a handle."""
    (numbers,), ((values, flag, others), factor, shift) = _first(handle), _second(handle)
    return numbers[0] + others[-1] + shift, values[1, 2] * factor, 1 if flag else 0


def test_the_tables_of_a_handle_are_set_together_and_read_one_by_one() -> None:
    handle, numbers, values = Handle((_I1,), KINDS), np.array([100]), np.arange(6.0).reshape(2, 3)
    handle.set(0, numbers, values, True, np.array([7, 8]), 0.5, -3)
    assert read_both(handle.address) == (105, 2.5, 1)
    handle.set(1, values, False, np.array([7, 8, 9]), 2.0, 5)
    assert read_both(handle.address) == (114, 10.0, 0)
    handle.set(0, np.array([200]))
    assert read_both(handle.address) == (214, 10.0, 0)


def test_arrays_of_a_table_lie_in_c_order() -> None:
    with pytest.raises(ValueError, match="C order"):
        Arguments(*KINDS).set((np.zeros((3, 2)).T, True, np.zeros(1, np.int64)), 1.0, 1)


def test_arrays_of_a_table_are_of_its_types() -> None:
    for values in (np.zeros((2, 3), np.float32), np.zeros(6)):
        with pytest.raises(ValueError, match="instead of"):
            Arguments(*KINDS).set((values, True, np.zeros(1, np.int64)), 1.0, 1)


def test_a_table_takes_arrays_of_subclasses_and_of_equal_types() -> None:
    table, numbers = Arguments(*KINDS), np.array([7, 8])
    values = np.arange(6.0).reshape(2, 3).view(np.recarray)
    assert arguments_read(table.set((values, True, numbers), 0.5, -3)) == (5.0, 1.0, 8.0, 0.5, -3.0)
    assert arguments_read(table.set((values, True, numbers.view(np.longlong)), 0.5, -3)) == (5.0, 1.0, 8.0, 0.5, -3.0)
    assert arguments_read(table.set((values[:, :].base, True, numbers[:1]), 0.5, -3)) == (5.0, 1.0, 7.0, 0.5, -3.0)


def test_a_table_writes_new_arrays_after_a_refused_call() -> None:
    table, flag = Arguments(*KINDS), True
    for k in range(50):  # a new array often gets the memory of the array that was freed
        with pytest.raises(ValueError, match="instead of"):
            table.set((np.full((2, 3), 100.0 + k), flag, np.zeros((1, 1), np.int64)), 1.0, 1)
        assert arguments_read(table.set((np.full((2, 3), float(k)), flag, np.array([k])), 1.0, 1))[0] == k


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_task_is_done_once_in_each_of_many_passes(threads: int) -> None:
    done, who = np.zeros(600, np.int64), np.zeros(600, np.int64)
    tasks = np.column_stack([np.arange(0, 600, 6), np.arange(6, 606, 6)])
    starts = np.array([0, 1, 40, 40, 100])
    table = Arguments(*COUNTS)
    for k in range(2000):
        team(threads).run(count, table.set(done, who), tasks, starts)
        if k % 500 == 0:
            time.sleep(0.01)  # helper threads fall asleep, and wake up for the next pass
    assert (done == 2000).all()
    assert who.min() >= 0
    assert who.max() < threads


def test_helpers_take_part_and_are_there_once() -> None:
    done, who = np.zeros(10**6, np.int64), np.zeros(10**6, np.int64)
    tasks = np.column_stack([np.arange(0, 10**6, 5000), np.arange(5000, 10**6 + 5000, 5000)])
    before, table, there = team(3).helped, Arguments(*COUNTS), threading.active_count()
    began = time.monotonic()
    while len(np.unique(who)) < 3 and time.monotonic() < began + 60.0:
        team(3).run(count, table.set(done, who), tasks, np.array([0, len(tasks)]))
    assert np.unique(who).tolist() == [0, 1, 2]
    assert team(3).helped > before
    assert team(3) is team(3)
    assert threading.active_count() == there


def test_chunks_of_one_colour_share_no_node_and_every_chunk_has_one() -> None:
    mesh = structured(box(20_000, "structured"))
    n = len(mesh.tets)
    block = Block(0, n, mesh.tets.astype(np.uint32), np.arange(n), np.zeros((0, 0, 0)), 0, 0, np.zeros(0))
    for begin, end in ((0, 5), (5, block.chunks)):
        found = coloured(block, begin, end, len(mesh.points))
        assert sorted(map(tuple, found.tasks.tolist())) == [(c, c + 1) for c in range(begin, end)]
        for first, last in zip(found.starts[:-1], found.starts[1:], strict=True):
            owners = np.zeros(len(mesh.points), np.int64)
            for c, _ in found.tasks[first:last]:
                owners[np.unique(mesh.tets[c * CHUNK : (c + 1) * CHUNK])] += 1
            assert owners.max() == 1
    assert len(found.starts) - 1 < block.chunks - 5
    assert len(found.starts) - 1 <= 20


def test_chunks_of_one_colour_share_no_node_over_several_blocks() -> None:
    """The second block shares the nodes of a face with the first one."""
    mesh = structured(box(20_000, "structured"))
    parts = mesh.tets[: 30 * CHUNK + 100], mesh.tets[30 * CHUNK + 100 :]
    none = np.zeros((0, 0, 0)), 0, 0, np.zeros(0)
    blocks = [Block(k, len(each), each.astype(np.uint32), np.arange(len(each)), *none) for k, each in enumerate(parts)]
    found, many = joined(blocks, len(mesh.points)), [block.chunks for block in blocks]
    assert sorted(map(tuple, found.tasks.tolist())) == [(c, c + 1) for c in range(sum(many))]
    tets = [each[c * CHUNK : (c + 1) * CHUNK] for each in parts for c in range(-(-len(each) // CHUNK))]
    for first, last in zip(found.starts[:-1], found.starts[1:], strict=True):
        owners = np.zeros(len(mesh.points), np.int64)
        for c, _ in found.tasks[first:last]:
            owners[np.unique(tets[c])] += 1
        assert owners.max() == 1
    assert len(found.starts) - 1 <= 20


def test_chunks_of_several_blocks_that_share_a_node_have_a_colour_each() -> None:
    n = 40 * CHUNK
    tets = np.column_stack([np.zeros(n), *(np.arange(n) * 3 + k for k in (1, 2, 3))]).astype(np.uint32)
    blocks = [Block(k, n, tets, np.arange(n), np.zeros((0, 0, 0)), 0, 0, np.zeros(0)) for k in range(3)]
    found = joined(blocks, 3 * n + 1)
    assert np.diff(found.starts).max() == 1
    assert found.tasks[:, 0].tolist() == list(range(120))


def test_chunks_that_all_share_a_node_have_a_colour_each() -> None:
    n = 70 * CHUNK
    tets = np.column_stack([np.zeros(n), *(np.arange(n) * 3 + k for k in (1, 2, 3))]).astype(np.uint32)
    block = Block(0, n, tets, np.arange(n), np.zeros((0, 0, 0)), 0, 0, np.zeros(0))
    found = coloured(block, 0, 70, 3 * n + 1)
    assert found.starts.tolist() == list(range(71))
    assert found.tasks[:, 0].tolist() == list(range(70))


def test_the_worker_takes_another_number_of_threads_than_the_case_has(tmp_path: Path) -> None:
    words = ["two_tets", "--out", str(tmp_path), "--set", "run.threads=2"]
    assert main._read(main._parse(words), 3)[0].run.cores == 6
    assert main._read(main._parse([*words, "--threads", "5"]), 3)[0].run.cores == 15
