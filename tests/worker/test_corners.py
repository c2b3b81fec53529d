"""Nodal values at the corners of tets, against plain numpy: bit-identical for any number of tets."""

import numpy as np
import pytest

from conoid.worker.elements import tet4
from conoid.worker.elements.forces import scatter_forces
from conoid.worker.elements.scratch import EDGE, MOVED, RATE, SCRATCH
from conoid.worker.model.state import CHUNK, Floats, Tets, force_table

COUNTS = (1, 3, 4, 7, 257, CHUNK)


def mesh(n: int) -> tuple[Floats, Floats, Tets]:
    """Returns positions before and after, and ``n`` tets of random nodes; the last tet has the last node."""
    random = np.random.default_rng(n)
    x0 = random.normal(size=(n + 4, 3))
    tets = random.integers(0, n + 4, (n, 4)).astype(np.uint32)
    tets[-1, 3] = n + 3
    return x0, x0 + 1e-6 * random.normal(size=x0.shape), tets


def differences(values: Floats, tets: Tets) -> Floats:
    """(9, n) values of corners 1, 2, 3 less that of corner 0."""
    return np.asarray((values[tets[:, 1:]] - values[tets[:, :1]]).reshape(len(tets), 9).T)


@pytest.mark.parametrize("n", COUNTS)
def test_rows_are_the_differences_of_the_nodes(n: int) -> None:
    """Only the first ``n`` numbers of nine rows are written."""
    _, x, tets = mesh(n)
    w = np.full(SCRATCH, np.nan)
    tet4.gather(w[RATE:], x, tets, w[:0], n)
    rows = w.reshape(-1, CHUNK)
    assert (rows[9:18, :n] == differences(x, tets)).all()
    assert np.isfinite(w).sum() == 9 * n


@pytest.mark.parametrize("n", COUNTS)
def test_displacements_are_the_edges_less_their_initial_values(n: int) -> None:
    x0, x, tets = mesh(n)
    w = np.full(SCRATCH, np.nan)
    tet4.gather_moved(w, x0, x, tets, w[:0], n)
    rows, now = w.reshape(-1, CHUNK), differences(x, tets)
    assert (rows[EDGE // CHUNK : EDGE // CHUNK + 9, :n] == now).all()
    assert (rows[MOVED // CHUNK : MOVED // CHUNK + 9, :n] == now - differences(x0, tets)).all()
    assert np.isfinite(w).sum() == 18 * n


@pytest.mark.parametrize("n", COUNTS)
def test_forces_of_tets_are_added_at_their_nodes(n: int) -> None:
    """Node 0 gets minus the sum of the other forces; the last column of the table stays zero."""
    x0, _, tets = mesh(n)
    random = np.random.default_rng(n)
    quanta, before = random.integers(-(2**50), 2**50, (9, CHUNK)), random.integers(-(2**60), 2**60, x0.shape)
    force, expected = force_table(before), before.copy()
    scatter_forces(force, quanta.reshape(-1), tets, n)
    others = quanta[:, :n].T.reshape(n, 3, 3)
    for corner, more in enumerate((-others.sum(axis=1), *others.transpose(1, 0, 2))):
        np.add.at(expected, tets[:, corner], more)
    assert (force[:, :3] == expected).all()
    assert not force[:, 3].any()
