"""Rigid bodies in the sweeps, compared with plain numpy: bounds of contact rows, sums of impulses and moments."""

import numpy as np
import numpy.typing as npt
import pytest

from conoid.worker.contact.solver.active import IMPULSE, MOBILITY, ActiveNodes
from conoid.worker.contact.solver.loading import SHARES
from conoid.worker.rigid import rows

Floats = npt.NDArray[np.float64]
REACH = np.array([4.0, 0.5])


class Bodies:
    """Two bodies, and random contacts of their nodes with nodes of deformable bodies."""

    def __init__(self, seed: int, contacts: int = 40) -> None:
        draw = np.random.default_rng(seed)
        self.body = draw.integers(0, 2, contacts).astype(np.int32)
        self.arms = draw.uniform(-0.5, 0.5, (contacts, 3)) * REACH[self.body, None]
        ways = draw.normal(size=(contacts, 3))
        self.normals = ways / np.linalg.norm(ways, axis=1)[:, None]
        self.weights = draw.uniform(0.1, 1.0, contacts)
        self.lightness = np.repeat([[0.3], [7.0]], 3, axis=1)
        turn = np.linalg.qr(draw.normal(size=(2, 3, 3)))[0]
        self.yielding = np.ascontiguousarray(
            turn @ (draw.uniform(0.1, 9.0, (2, 3))[:, :, None] * turn.transpose(0, 2, 1))
        )
        self.active = ActiveNodes.of(contacts)
        self.slots = np.arange(contacts, dtype=np.int32)
        self.active.row_weights[:, :3] = np.rint(SHARES * self.weights[:, None] * np.abs(self.normals))
        self.active.row_weights[:, 3] = np.rint(SHARES * self.weights)

    @property
    def matrix(self) -> Floats:
        """Returns (contacts, contacts) the part of the bodies in the contact matrix: the scalar product of w n and (w'
        n' / M + W (r' x w' n') x r)."""
        n = len(self.body)
        found = np.zeros((n, n))
        pushes = self.weights[:, None] * self.normals
        moments = np.cross(self.arms, pushes)
        for b in range(2):
            some = np.flatnonzero(self.body == b)
            linear = pushes[some] @ (self.lightness[b][:, None] * pushes[some].T)
            found[np.ix_(some, some)] = linear + moments[some] @ self.yielding[b] @ moments[some].T
        return found

    def norms(self) -> tuple[Floats, Floats]:
        """Returns (contacts,) bounds along the normals, and of any direction, computed from the slots as in the
        sweeps."""
        words, every = np.zeros((2, rows.WEIGHTS), np.int64), np.ones(len(self.body), bool)
        rows.weigh(words, self.active, self.slots, self.body, self.arms, every, REACH)
        rows.norms(self.active, words, self.slots, self.body, self.arms, REACH, self.lightness, self.yielding)
        sums, fixed = self.active.row_weights, self.active.fixed[:, MOBILITY : MOBILITY + 3]
        along = (self.weights[:, None] * np.abs(self.normals) * sums[:, :3] * fixed).sum(axis=1) / SHARES
        return along, self.weights * sums[:, 3] * fixed.max(axis=1) / SHARES


@pytest.mark.parametrize("seed", range(5))
def test_the_norm_of_a_row_is_a_bound(seed: int) -> None:
    """The norm of a contact row is at least the l1 norm of the row, along the normal and in any direction."""
    bodies = Bodies(seed)
    along, across = bodies.norms()
    exact = np.abs(bodies.matrix).sum(axis=1)
    assert (along >= exact * (1.0 - 1e-6)).all()
    assert (across >= along * (1.0 - 1e-6)).all()


@pytest.mark.parametrize("contacts", [1, 7])
def test_contacts_through_the_centre_along_one_normal_are_exact(contacts: int) -> None:
    bodies = Bodies(1, contacts)
    bodies.arms[:] = 0.0
    bodies.normals[:] = (0.0, 0.0, 1.0)
    bodies.active.row_weights[:, :3] = np.rint(SHARES * bodies.weights[:, None] * bodies.normals)
    assert bodies.norms()[0] == pytest.approx(bodies.matrix.sum(axis=1), rel=1e-8)


def test_impulses_add_up_as_integers_and_moments_to_a_quantum() -> None:
    """The sums include owned slots only; all slots are set to zero."""
    bodies, draw = Bodies(3), np.random.default_rng(4)
    given = draw.integers(-(2**40), 2**40, (len(bodies.body), 3))
    bodies.active.moving_words[:, IMPULSE : IMPULSE + 3] = given
    owned = draw.uniform(size=len(bodies.body)) < 0.7
    words = np.zeros((2, rows.WORDS), np.int64)
    rows.gather(words, bodies.active, bodies.slots, bodies.body, bodies.arms, owned, REACH)
    for b in range(2):
        some = owned & (bodies.body == b)
        assert (words[b, :3] == given[some].sum(axis=0)).all()
        moments = np.cross(bodies.arms[some], given[some].astype(float)) / REACH[b]
        assert words[b, 3:] == pytest.approx(moments.sum(axis=0), abs=float(some.sum()))
    assert not bodies.active.moving_words[:, IMPULSE : IMPULSE + 3].any()
