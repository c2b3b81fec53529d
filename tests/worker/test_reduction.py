"""The record of the step's reduction: every field keeps what it is given, and a maximum of words is right for each."""

import math

import numpy as np
import pytest

from conoid.worker.parallel.comm import SerialComm
from conoid.worker.reduction import Fields, Flag, Number, Real, StepReduction

REALS = ("limit", "force", "approach")
NUMBERS = ("stop", "worn", "breaking", "nodes")
FLAGS = ("report", "groups", "opening", "stray", "search", "grown", "checkpoint", "snapshot")


def test_every_field_has_a_word_of_its_own() -> None:
    fields = [each for each in vars(Fields).values() if isinstance(each, Number | Flag | Real)]
    assert sorted(each.place for each in fields) == list(range(Fields.size))
    assert len(fields) == len(REALS + NUMBERS + FLAGS)


@pytest.mark.parametrize("name", REALS + NUMBERS + FLAGS)
def test_a_field_touches_no_other(name: str) -> None:
    record = Fields()
    value = {**dict.fromkeys(REALS, 2.5e7), **dict.fromkeys(NUMBERS, 3), **dict.fromkeys(FLAGS, True)}[name]
    setattr(record, name, value)
    assert getattr(record, name) == value
    assert np.count_nonzero(record.words) == 1


@pytest.mark.parametrize("name", REALS)
def test_bits_of_floats_order_like_floats_and_a_nan_wins(name: str) -> None:
    words = []
    for value in (0.0, 1e-300, 1.0, 1.0 + 2.0**-52, 3e9, math.inf, math.nan):
        record = Fields()
        setattr(record, name, value)
        words.append(int(record.words.max()))
    assert words == sorted(set(words))


def test_what_a_rank_gives_is_kept_apart_from_what_all_agree_on() -> None:
    reduction = StepReduction()
    reduction.own.limit, reduction.own.search, reduction.own.stop = 1e6, True, 2
    assert (reduction.limit, reduction.search, reduction.stop) == (0.0, False, 0)
    reduction.begin(SerialComm()).finish()
    assert (reduction.limit, reduction.search, reduction.stop) == (1e6, True, 2)
    assert StepReduction.limit.word(reduction) == int(np.float64(1e6).view(np.int64))


def test_a_run_that_goes_on_keeps_the_limits_and_forgets_what_was_asked_for() -> None:
    reduction = StepReduction()
    reduction.words[:] = 1
    reduction.begin_again()
    left = {name for name in REALS + NUMBERS + FLAGS if getattr(reduction, name)}
    assert left == {"limit", "force", "approach", "worn", "breaking", "nodes", "opening", "search"}
