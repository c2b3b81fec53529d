"""Sums that do not depend on the order of their terms, and the quantum of the forces: its choice, its overflow, and the
repetition of a sum."""

import math
from fractions import Fraction

import numpy as np
import pytest

from conoid.worker.elements.forces import quanta
from conoid.worker.model.rows import WORK
from conoid.worker.parallel import fixed_point
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.fixed_point import (
    CONTRIBUTION_BITS,
    HEADROOM_BITS,
    Ragged,
    Tally,
    exact_sums,
    exact_totals,
    outgrown,
    scale_for,
    totals_and_words,
)
from conoid.worker.parallel.grouped import Grouped
from conoid.worker.parallel.team import team
from conoid.worker.simulation import Simulation

from .kernels import COPPER, FORMS, Form, build, run, scene
from .meshes import Floats, block


def values(n: int, seed: int) -> Floats:
    """Returns columns of numbers of equal size, of sizes over 30 decades, of numbers that nearly cancel, and of
    zeros.
    """
    random = np.random.default_rng(seed)
    even = random.normal(size=n)
    mixed = random.normal(size=n) * 10.0 ** random.uniform(-20.0, 10.0, n)
    half = random.normal(size=n // 2) * 1e6
    cancel = np.concatenate([half, -half * (1.0 + 1e-12)])
    return np.column_stack([even, mixed, cancel, np.zeros(n)])


def grouped(columns: Floats, group: "np.ndarray", groups: int) -> Grouped:
    """Returns ``columns`` (n, k) whose row i belongs to ``group`` i, summed by two threads."""
    return Grouped(team(2), groups).of(np.ascontiguousarray(columns.T), group)


def test_sums_are_within_the_stated_error() -> None:
    columns = values(10_000, 1)
    found = exact_sums(SerialComm(), columns)
    for j in range(4):
        exact = sum(map(Fraction, columns[:, j].tolist()), Fraction(0))
        quantum = math.ldexp(1.0, math.frexp(np.abs(columns[:, j]).max())[1] - 60)
        assert abs(Fraction(float(found[j])) - exact) <= 10_000 * Fraction(quantum) + Fraction(
            abs(float(found[j])) * 2.0**-53
        )


def test_sums_do_not_depend_on_the_order() -> None:
    columns = values(5000, 2)
    first = exact_sums(SerialComm(), columns)
    for seed in range(5):
        shuffled = columns[np.random.default_rng(seed).permutation(5000)]
        assert exact_sums(SerialComm(), shuffled).tobytes() == first.tobytes()


def test_plain_sums_do_depend_on_it() -> None:
    """Control of the test: plain sums of the shuffled terms differ in their bit patterns."""
    columns = values(5000, 2)
    sums = {columns[np.random.default_rng(seed).permutation(5000), 1].cumsum()[-1] for seed in range(5)}
    assert len(sums) > 1


def test_sums_of_nothing_and_of_one() -> None:
    assert exact_sums(SerialComm(), np.zeros((0, 2))).tolist() == [0.0, 0.0]
    assert exact_sums(SerialComm(), np.array([[-3.25, 1e-200]])).tolist() == [-3.25, 1e-200]


@pytest.mark.parametrize("largest", [1e-9, 0.75, 1.0, 3.0, 1e5, 2.0**40, 1e300])
def test_scale_leaves_the_stated_headroom(largest: float) -> None:
    """The scale of a sum is a power of two. The largest contribution to the sum uses all bits except the headroom, so
    it may grow 32-fold."""
    scale = scale_for(largest)
    assert math.frexp(scale)[0] == 0.5
    bits = CONTRIBUTION_BITS - HEADROOM_BITS
    assert 2.0 ** (bits - 1) <= largest * scale <= 2.0**bits
    assert not outgrown(largest * 31.0, scale)
    assert outgrown(largest * 65.0, scale)
    assert outgrown(math.nan, scale)
    assert outgrown(math.inf, scale)


def test_contributions_are_rounded_to_the_nearest_even_integer() -> None:
    """The rounding is checked up to the last bit of the largest contribution: halves, their neighbours, and numbers
    of all sizes."""
    edge = 2.0**CONTRIBUTION_BITS
    halves = np.concatenate([np.arange(-9.5, 10.0), [0.0, edge - 0.5, edge - 1.0, 0.5 - edge, 1.0 - edge]])
    sizes = np.random.default_rng(2).normal(size=999) * 2.0 ** np.linspace(-60.0, CONTRIBUTION_BITS - 3.0, 999)
    every = np.concatenate([halves, np.nextafter(halves, np.inf), np.nextafter(halves, -np.inf), sizes])
    every = every[abs(every) < edge]
    found = [quanta(value / 8.0, -value / 8.0, 0.0, 8.0) for value in every]
    assert found == [(round(value), -round(value), 0) for value in every]


def collision(form: Form, floor: float) -> tuple[Simulation, int]:
    """Returns the number of repeated sums and a copper cube without stress that flies against a wall. The argument
    ``floor`` is the force, N, below which the quantum is not refined.
    """
    wall = {"kind": "wall", "point": (0.0, 0.0, -1e-4), "normal": (0.0, 0.0, 1.0)}
    case = scene(COPPER, form, end=1.5e-6, velocity=(0.0, 0.0, -200.0), boundaries=(wall,))
    sim = build(case, [block((3, 3, 3), 1e-3, seed=4)])
    sim.floor = max(sim.floor, floor)
    repeats: list[float] = []
    again = sim.elements.again

    def counted(scale: float) -> None:
        repeats.append(scale)
        again(scale)

    def look(sim: Simulation, before: Floats) -> None:
        assert (sim.model.nodes.force.sum(axis=0) == 0).all()

    sim.elements.again = counted  # type: ignore[method-assign]
    run(sim, look)
    return sim, len(repeats)


@pytest.mark.parametrize("form", FORMS)
def test_a_sum_that_outgrows_its_quantum_is_repeated(form: Form) -> None:
    """Forces of the copper cube grow more than 64-fold at the impact. Repeated sums are equal to sums with a coarse
    quantum from the start."""
    fine, repeats = collision(form, 0.0)
    coarse, none = collision(form, 1e4)
    assert 1 <= repeats <= 4
    assert none == 0
    assert fine.clock.step == coarse.clock.step
    assert np.abs(fine.model.nodes.x - coarse.model.nodes.x).max() < 1e-12
    assert np.abs(fine.model.nodes.v - coarse.model.nodes.v).max() < 1e-6
    work = [sim.model.blocks[0].row(WORK).sum() for sim in (fine, coarse)]
    assert math.isclose(work[0], work[1], rel_tol=1e-9)
    assert fine.ledger.close(fine.model.nodes.v).residual < 0.02


def test_groups_have_their_own_sums_and_do_not_change_those_of_all() -> None:
    columns = values(5000, 3)
    group = np.random.default_rng(4).integers(0, 3, 5000).astype(np.int32)
    total, each = exact_totals(SerialComm(), grouped(columns, group, 4))
    assert total.tobytes() == exact_sums(SerialComm(), columns).tobytes()
    for k in range(4):
        assert each[k] == pytest.approx([math.fsum(column[group == k]) for column in columns.T], rel=1e-12, abs=1e-3)
    assert each[3].tolist() == [0.0] * 4


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
def test_a_sum_with_a_value_that_is_not_finite_is_not_a_number(odd: float) -> None:
    """Only the sum of one column is not a number, in the whole and in each group, for a value at the beginning or at
    the end."""
    for row in (0, 4999):
        columns = values(5000, 5)
        whole = exact_sums(SerialComm(), columns)
        columns[row, 1] = odd
        group = (np.arange(5000, dtype=np.int32) > 2500).astype(np.int32)
        total, each = exact_totals(SerialComm(), grouped(columns, group, 2))
        assert np.isnan(total).tolist() == [False, True, False, False]
        assert np.isnan(each).tolist() == [[False, True, False, False]] * 2
        assert total[[0, 2, 3]].tobytes() == whole[[0, 2, 3]].tobytes()


@pytest.mark.parametrize("share", [0.49, -0.49])
def test_the_low_limb_of_a_tally_does_not_grow(share: float) -> None:
    """Values far below a quantum of the high limb are in the low limb only; without a carry, 2^34 such values would
    overflow the low limb."""
    tally, small = Tally(np.array([1.0])), share * 2.0**-29
    for _ in range(50):
        tally.add(np.full((20, 1), small))
    assert abs(int(tally.words[1, 0])) <= 2**29
    assert tally.total(SerialComm())[0] == pytest.approx(1000.0 * small, rel=1e-9)


def test_where_a_tally_carries_over_changes_no_bit() -> None:
    """A sum in many additions, or over many ranks that have each carried before, has the same bit pattern."""
    columns = values(5000, 3)[:, :2]
    whole, parts = Tally(np.array([10.0, 1e9])), [Tally(np.array([10.0, 1e9])) for _ in range(3)]
    whole.add(columns)
    for i, row in enumerate(columns):
        parts[i % 3].add(row[None])
    words = np.sum([part.words for part in parts], axis=0)
    assert whole.valued(words).tobytes() == whole.total(SerialComm()).tobytes()


def limbs_before(values: Floats, scale: float) -> tuple[int, int]:
    """Returns the two sums with the rounding of numpy."""
    scaled = values * scale
    high = np.rint(scaled)
    return int(high.astype(np.int64).sum()), int(np.rint((scaled - high) * 2.0**30).astype(np.int64).sum())


def odd_values() -> list[Floats]:
    """Returns columns of all sizes up to the largest float, halves of a quantum of each limb, their neighbours, and
    zeros."""
    random = np.random.default_rng(6)
    sizes = random.normal(size=999) * 2.0 ** random.integers(-300, 300, 999)
    halves = np.concatenate([np.arange(-9.5, 10.0), np.arange(-9.5, 10.0) * 2.0**-30, [2.0**29 + 0.5, 0.5 - 2.0**30]])
    near = np.concatenate([halves, np.nextafter(halves, np.inf), np.nextafter(halves, -np.inf), -halves])
    last = [np.nextafter(2.0**30, 0.0), np.nextafter(2.0**1023, 0.0), -1e308]
    return [
        sizes, near, -np.abs(near), np.array(last[:1]), np.array(last[1:]), np.array([0.0, -0.0]), np.zeros(0),
        np.array([2.0**-993, 1e-300, -1e-305, 5e-324]), np.array([1.0, 1e-200, -1e-16, 2.0**-31, -(2.0**-61)]),
    ]  # fmt: skip


@pytest.mark.parametrize("values", odd_values())
def test_limbs_are_those_of_numpys_rounding(values: Floats) -> None:
    """The limbs agree exactly for values of any size below the bound of the scale, and for any number of values."""
    largest = float(np.abs(values).max(initial=0.0))
    assert fixed_point.magnitude(fixed_point.most(values)) == largest
    scale = math.ldexp(1.0, 30 - max(math.frexp(largest)[1], -993))
    for n in {len(values), len(values) // 2, min(len(values), 7)}:
        assert fixed_point.limbs(values[:n], scale) == limbs_before(values[:n], scale)


@pytest.mark.parametrize("odd", [math.nan, -math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_has_an_infinite_maximum(odd: float) -> None:
    for values in ([odd], [1.0, odd, -1e308], [odd, 0.0]):
        assert fixed_point.magnitude(fixed_point.most(np.array(values))) == math.inf


def test_the_smallest_floats_have_sums() -> None:
    """The quantum of sums of very small values is the quantum for 2^-993; smaller values are rounded to zero."""
    tiny = np.array([[2.0**-1000, 5e-324], [2.0**-1001, 0.0]])
    assert exact_sums(SerialComm(), tiny).tolist() == [1.5 * 2.0**-1000, 0.0]


def test_sums_of_limbs_are_rounded_once() -> None:
    """Sums below and above 2^53, of either sign, are rounded in the same way as Python's integers: halves to even."""
    random = np.random.default_rng(7)
    for bits in (10, 50, 53, 54, 62):
        high = random.integers(-(2**bits), 2**bits, 200)
        low = random.integers(-(2**61), 2**61, 200)
        words = np.stack([high, low])
        words[:, :4] = [[2**23 + 1, 2**23 + 2, -(2**23) - 1, 0], [-1, 1, 1, -1]]
        exact = [float(int(a) * 2**30 + int(b)) for a, b in words.T]
        assert fixed_point._whole(words).tolist() == exact


def test_ragged_columns_and_integers_go_along() -> None:
    """Columns of different lengths have the same sums as each column by itself, in every group."""
    columns = [values(300, 8)[:, 0], np.zeros(0), values(70, 9)[:, 1]]
    ragged = Ragged(np.concatenate(columns), np.array([0, 300, 300, 370]), 2)
    group = (np.arange(40) % 2).astype(np.int32)
    beside = grouped(values(40, 10), group, 2)
    sums, each, more = totals_and_words(SerialComm(), [ragged, beside], np.array([7, -(2**60)]))
    alone = [float(exact_sums(SerialComm(), column[:, None])[0]) for column in columns]
    assert sums[:3].tolist() == each[0, :3].tolist() == alone
    assert each[1, :3].tolist() == [0.0] * 3
    assert each[:, 3:].tobytes() == exact_totals(SerialComm(), beside)[1].tobytes()
    assert more.tolist() == [7, -(2**60)]
