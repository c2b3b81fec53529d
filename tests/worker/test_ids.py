"""Look-ups by global id: the table and the bisection give the same result."""

import numpy as np
import pytest

from conoid.worker.model import ids

KNOWN = np.array([0, 3, 4, 90, 4000])
WANTED = np.array([[3, 4000], [-2, 5], [-1, 4001], [0, 1 << 62]])


@pytest.mark.parametrize("many", [1, 1000])
@pytest.mark.parametrize("kind", [np.int32, np.int64])
def test_places_are_those_of_the_ids_and_minus_one_elsewhere(many: int, kind: type) -> None:
    wanted: np.ndarray = np.tile(WANTED[: 4 if kind is np.int64 else 3].astype(kind), (many, 1))
    expected = [list(KNOWN).index(w) if w in KNOWN else -1 for w in wanted.ravel().tolist()]
    assert ids.places(KNOWN, wanted).ravel().tolist() == expected
    assert ids.among(KNOWN, wanted).shape == wanted.shape
    assert not ids.among(KNOWN[:0], wanted).any()


@pytest.mark.parametrize("many", [1, 1000])
@pytest.mark.parametrize("known", [[], [90, 0, 4000, 3, 4]], ids=["none", "shuffled"])
def test_an_index_has_the_places_in_a_list_of_any_order(many: int, known: list[int]) -> None:
    wanted = np.tile(WANTED, (many, 1))
    found = ids.IdIndex(np.array(known, np.int64)).places(wanted)
    assert found.tolist() == [[known.index(w) if w in known else -1 for w in row] for row in wanted.tolist()]


@pytest.mark.parametrize("many", [1, 1000])
def test_ids_that_are_there_are_located(many: int) -> None:
    wanted = np.tile([4000, 0, 90], many)
    assert ids.located(KNOWN, wanted).tolist() == [4, 0, 3] * many


@pytest.mark.parametrize("many", [1, 1000])
def test_each_id_is_there_once_and_none_is_no_id(many: int) -> None:
    assert ids.unique(np.tile([4, -1, 0, 3000, 4], many)).tolist() == [0, 4, 3000]
    assert ids.unique(np.zeros((0, 3), np.int64)).tolist() == []
    assert ids.unique(np.array([-1])).tolist() == []
