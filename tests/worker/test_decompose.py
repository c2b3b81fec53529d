"""Recursive bisection: equal weights, compact parts, and the same result for any distribution of the points, for any
number of parts."""

import numpy as np
import pytest

from conoid.worker.model.state import Indices
from conoid.worker.parallel import decompose
from conoid.worker.parallel.comm import SerialComm

from ..contact.ranks import ThreadComm, on_ranks
from .meshes import Floats

PARTS = [1, 2, 3, 4, 5, 7, 8, 16, 31]


def bisect(points: Floats, weights: Floats, parts: int) -> Indices:
    return decompose.bisect(points, np.arange(len(points)), weights, parts, SerialComm())[0]


def cloud(n: int, seed: int) -> Floats:
    return np.asarray(np.random.default_rng(seed).uniform(size=(n, 3)) * [3.0, 1.0, 0.5])


@pytest.mark.parametrize("parts", PARTS)
def test_equal_weights_are_shared_evenly(parts: int) -> None:
    """Each cut has an error below the weight of one point, so a part has an error below the weight of two points."""
    owner = bisect(cloud(1000, 1), np.ones(1000), parts)
    counts = np.bincount(owner, minlength=parts)
    assert len(counts) == parts
    assert np.abs(counts - 1000 / parts).max() < 2.0


@pytest.mark.parametrize("parts", [2, 4, 8])
def test_powers_of_two_divide_exactly(parts: int) -> None:
    assert np.bincount(bisect(cloud(64, 2), np.ones(64), parts)).tolist() == [64 // parts] * parts


@pytest.mark.parametrize("parts", PARTS)
def test_unequal_weights_are_shared_evenly(parts: int) -> None:
    weights = np.random.default_rng(3).uniform(0.1, 5.0, 2000)
    shares = np.bincount(bisect(cloud(2000, 4), weights, parts), weights, minlength=parts)
    assert np.abs(shares - weights.sum() / parts).max() < 2.0 * 5.0


@pytest.mark.parametrize("parts", PARTS)
def test_the_same_arguments_give_the_same_parts(parts: int) -> None:
    points = cloud(500, 5)
    assert (bisect(points, np.ones(500), parts) == bisect(points.copy(), np.ones(500), parts)).all()


def test_ties_are_ordered_by_their_ids() -> None:
    """The cut of points at one position follows the ids."""
    owner = bisect(np.zeros((40, 3)), np.ones(40), 4)
    assert owner.tolist() == sorted(owner.tolist())
    assert len(set(owner.tolist())) == 4


def test_cuts_run_across_the_longest_side() -> None:
    points = cloud(4000, 6)
    owner = bisect(points, np.ones(4000), 3)
    lows = [points[owner == part].min(axis=0) for part in range(3)]
    highs = [points[owner == part].max(axis=0) for part in range(3)]
    assert highs[0][0] <= lows[1][0]
    assert highs[1][0] <= lows[2][0]


@pytest.mark.parametrize("parts", [4, 7, 9])
def test_more_parts_than_points(parts: int) -> None:
    owner = bisect(cloud(4, 7), np.ones(4), parts)
    assert np.bincount(owner, minlength=parts).max() == 1


@pytest.mark.parametrize("parts", [2, 5, 16])
@pytest.mark.parametrize("ranks", [2, 3])
def test_parts_do_not_depend_on_who_holds_the_points(parts: int, ranks: int) -> None:
    """Many points have equal coordinates, because they lie in planes normal to the axes."""
    points = np.round(cloud(600, 8), 1)
    weights, ids = np.random.default_rng(9).uniform(0.5, 2.0, 600), np.arange(600)
    one, cuts = decompose.bisect(points, ids, weights, parts, SerialComm())
    holder = np.random.default_rng(10).integers(0, ranks, 600)

    def share(comm: ThreadComm) -> tuple[Indices, list[decompose.Cut]]:
        mine = holder == comm.rank
        return decompose.bisect(points[mine], ids[mine], weights[mine], parts, comm)

    for rank, (owner, same) in enumerate(on_ranks(ranks, share)):
        assert owner.tolist() == one[holder == rank].tolist()
        assert same == cuts


def test_other_points_lie_with_those_round_them() -> None:
    points = cloud(4000, 11)
    owner, cuts = decompose.bisect(points, np.arange(4000), np.ones(4000), 7, SerialComm())
    near = points + 1e-12
    assert (decompose.place(cuts, near) == owner).mean() > 0.99


def test_directions_are_unit_normals_that_differ() -> None:
    assert decompose.DIRECTIONS[:3].tolist() == np.eye(3).tolist()
    along = np.abs(decompose.DIRECTIONS @ decompose.DIRECTIONS.T)
    assert along.diagonal() == pytest.approx(1.0)
    assert (along - np.eye(49)).max() < 0.98


def nosed(n: int, tip: float) -> tuple[Floats, Floats]:
    """Returns a bar along z. Each point has the weight 1 in the first phase; in the second phase points below ``tip``
    times x have the weight 3."""
    points = np.random.default_rng(12).uniform(size=(n, 3)) * [1.0, 1.0, 3.0]
    return points, np.column_stack([np.ones(n), 3.0 * (points[:, 2] < 1.0 + tip * (points[:, 0] - 0.5))])


@pytest.mark.parametrize("parts", [2, 3, 4])
def test_every_phase_is_shared_evenly(parts: int) -> None:
    """The weight of one phase is at one end of the bar, like the weight of contact: a cut normal to the axis would give
    all of this weight to one part."""
    points, weights = nosed(20_000, 0.5)
    owner, _ = decompose.bisect(points, np.arange(len(points)), weights, parts, SerialComm())
    shares = np.array([np.bincount(owner, w, parts) for w in weights.T])
    assert shares.sum(axis=0) == pytest.approx(weights.sum() / parts, rel=0.01)
    worst = (shares.max(axis=1)).sum() * parts / weights.sum() - 1.0
    plain, _ = decompose.bisect(points, np.arange(len(points)), weights.sum(axis=1), parts, SerialComm())
    across = np.array([np.bincount(plain, w, parts) for w in weights.T])
    assert worst < 0.3 * (across.max(axis=1).sum() * parts / weights.sum() - 1.0)


def test_one_phase_alone_is_cut_across_the_longest_side() -> None:
    points = cloud(4000, 6)
    plain = bisect(points, np.ones(4000), 5)
    assert (bisect(points, np.tile([1.0, 0.0], (4000, 1)), 5) == plain).all()


def test_of_cuts_as_even_the_smaller_one_is_made() -> None:
    """The two phases have the same distribution, so an oblique cut has no advantage."""
    points = cloud(20_000, 13)
    _, cuts = decompose.bisect(points, np.arange(len(points)), np.ones((20_000, 2)), 2, SerialComm())
    assert [cut.direction for cut in cuts] == [0]


def test_even_phases_do_not_depend_on_who_holds_the_points() -> None:
    points, weights = nosed(12_000, 0.3)
    ids, holder = np.arange(12_000), np.random.default_rng(14).integers(0, 3, 12_000)
    one, cuts = decompose.bisect(points, ids, weights, 7, SerialComm())

    def share(comm: ThreadComm) -> tuple[Indices, list[decompose.Cut]]:
        mine = holder == comm.rank
        return decompose.bisect(points[mine], ids[mine], weights[mine], 7, comm)

    for rank, (owner, same) in enumerate(on_ranks(3, share)):
        assert owner.tolist() == one[holder == rank].tolist()
        assert same == cuts


def test_weights_beyond_the_integers_of_a_float_are_counted_exactly() -> None:
    """The position of the cut follows from integer sums, for any order of the points."""
    keys, quanta = np.array([1, 1, 1, 2]) << 40, np.array([2**54, 1, 1, 2**54])
    found = []
    for order in ([0, 1, 2, 3], [1, 2, 0, 3]):
        cut = decompose.Cut(0, 2, 0, 0.0, 1.0, 0)
        decompose._search([cut], [keys[order]], [quanta[order]], SerialComm())
        found.append(cut.key >> 40)
    assert found == [1, 1]
