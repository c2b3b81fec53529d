"""The record of the step reduction: every field returns the value that was set, and the maximum of words is correct for
each field."""

import math
import struct

import numpy as np
import pytest

from conoid.worker.parallel.comm import SerialComm
from conoid.worker.reduction import NAMES, Fields, StepReduction

from ..contact.ranks import on_ranks

REALS = ("limit", "force", "approach")
NUMBERS = ("stop", "worn", "breaking", "nodes")
FLAGS = ("apart", "report", "groups", "opening", "stray", "search", "grown", "checkpoint", "snapshot")


def _words(record: Fields) -> list[int]:
    words = np.zeros(len(NAMES), np.int64)
    record.pack(words)
    return words.tolist()


def test_every_field_is_of_a_kind() -> None:
    assert sorted(NAMES) == sorted(REALS + NUMBERS + FLAGS)


@pytest.mark.parametrize("name", REALS + NUMBERS + FLAGS)
def test_a_field_touches_no_other(name: str) -> None:
    record, read = Fields(), Fields()
    value = {**dict.fromkeys(REALS, 2.5e7), **dict.fromkeys(NUMBERS, 3), **dict.fromkeys(FLAGS, True)}[name]
    setattr(record, name, value)
    words = _words(record)
    assert np.count_nonzero(words) == 1
    read.unpack(np.array(words))
    assert {each: getattr(read, each) for each in NAMES} == {each: getattr(record, each) for each in NAMES}


@pytest.mark.parametrize("name", REALS)
def test_bits_of_floats_order_like_floats_and_a_nan_wins(name: str) -> None:
    words = []
    for value in (0.0, 1e-300, 1.0, 1.0 + 2.0**-52, 3e9, math.inf, math.nan):
        record = Fields()
        setattr(record, name, value)
        words.append(max(_words(record)))
    assert words == sorted(set(words))
    assert words[2] == struct.unpack("q", struct.pack("d", 1.0))[0]


def test_what_a_rank_gives_is_kept_apart_from_what_all_agree_on() -> None:
    reduction = StepReduction()
    reduction.own.limit, reduction.own.search, reduction.own.stop = 1e6, True, 2
    reduction.own.costs[:], reduction.own.unsettled[:] = [1, 2, 3, 4], [5, 6]
    assert (reduction.limit, reduction.search, reduction.stop) == (0.0, False, 0)
    reduction.begin(SerialComm()).finish()
    assert (reduction.limit, reduction.search, reduction.stop) == (1e6, True, 2)
    assert (*reduction.costs, *reduction.unsettled) == (1, 2, 3, 4, 5, 6)
    reduction.own.limit, reduction.own.costs[0] = 1.0, 7
    assert (reduction.limit, reduction.costs[0]) == (1e6, 1)


@pytest.mark.parametrize("fractures", [True, False])
@pytest.mark.parametrize("contact", [True, False])
def test_ranks_agree_on_the_largest_of_fields_and_on_sums(fractures: bool, contact: bool) -> None:
    def agree(comm: object) -> StepReduction:
        rank = comm.rank  # type: ignore[attr-defined]
        made = StepReduction(3, fractures=fractures, contact=contact)
        made.own.limit, made.own.worn, made.own.stray = 1e6 * rank, 2 - rank, rank == 1
        made.own.costs[:], made.own.unsettled[:] = rank, 10 * rank
        made.own.touched[rank] = 1 + rank
        made.begin(comm).finish()  # type: ignore[arg-type]
        return made

    for found in on_ranks(3, agree):
        assert (found.limit, found.worn, found.stray) == (2e6, 2, True)
        assert (*found.costs, *found.unsettled) == ((3, 3, 3, 3, 30, 30) if contact else (0,) * 6)
        assert found.touched.tolist() == ([1, 2, 3] if fractures else [])


def test_a_resumed_run_keeps_the_limits_and_drops_old_requests() -> None:
    reduction = StepReduction()
    reduction.resume(np.ones(len(NAMES), np.int64))
    reduction.begin_again()
    left = {name for name in REALS + NUMBERS + FLAGS if getattr(reduction, name)}
    assert left == {"limit", "force", "approach", "worn", "breaking", "nodes", "opening", "search"}
