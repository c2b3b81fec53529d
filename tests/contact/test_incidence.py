"""Rows of faces and edges at the slots of a broad phase are found through all copies of the slots."""

import numpy as np
import pytest

from conoid.worker.contact.scene.incidence import Incidence


@pytest.mark.parametrize("seed", range(5))
def test_every_row_with_a_slot_or_a_copy_of_it_is_found_once(seed: int) -> None:
    """Corners of faces are replaced by copies, and copies by further copies; the rows may contain copies of the same
    slot.
    """
    draw, slots = np.random.default_rng(seed), 40
    corners = draw.integers(0, slots, (60, 4)).astype(np.int32)
    incidence, root = Incidence(corners), np.arange(slots, dtype=np.int32)
    for _ in range(12):
        parents = draw.choice(len(root), 3, replace=False)
        corners_before, copies = corners.copy(), len(root) + np.arange(3)
        root = np.append(root, root[parents]).astype(np.int32)
        for parent, copy in zip(parents, copies, strict=True):
            corners[(corners == parent) & (draw.uniform(size=corners.shape) < 0.5)] = copy
        found = incidence.at(root[np.append(parents, copies)])
        assert np.array_equal(found, np.unique(found))
        assert np.isin(np.flatnonzero(np.isin(corners_before, parents).any(axis=1)), found).all()
        assert len(found) < len(corners)


def test_a_slot_that_came_after_the_search_has_no_rows() -> None:
    corners = np.array([[0, 1, 2], [2, 1, 4]], np.int32)
    assert Incidence(corners).at(np.array([-1, 3, 5, 6], np.int32)).tolist() == []
    assert Incidence(corners).at(np.array([2, -1, 2], np.int32)).tolist() == [0, 1]
    assert Incidence(corners[:0]).at(np.array([0, 1], np.int32)).tolist() == []
