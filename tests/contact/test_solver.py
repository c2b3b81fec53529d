"""Kernels of the impulse solver compared with plain Python that follows the formulas, to the last bit."""

import numpy as np
import pytest

from conoid.worker.contact.narrow_phase.tables import CRACK, ContactRows
from conoid.worker.contact.solver.active import Kept

from ..worker.meshes import Floats
from .kernels import Solver

NODES, CONTACTS, SWEEPS = 40, 60, 6
_QUANTA, _SCALE = 2.0**30, 2.0**40


def scene(seed: int) -> tuple[ContactRows, Floats, Floats]:
    """Returns contacts of nodes on faces, edges and cracks in a cloud that closes slowly. Most contacts have no
    friction and some have held nodes; half of the contacts are idle at first, and some of the idle contacts are loaded
    later.
    """
    random = np.random.default_rng(seed)
    rows = np.array([random.choice(NODES, 4, replace=False) for _ in range(CONTACTS)], np.int32)
    weights = np.column_stack([np.ones(CONTACTS), -random.dirichlet(np.ones(3), CONTACTS)])
    crack = random.uniform(size=CONTACTS) < 0.5
    rows[crack, 2:], weights[crack] = rows[crack, 1:2], (1.0, -1.0, 0.0, 0.0)
    normals = random.normal(size=(CONTACTS, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    friction = np.where(random.uniform(size=CONTACTS) < 0.3, 0.3, 0.0)
    pair = np.where(crack, CRACK - np.arange(CONTACTS), np.arange(CONTACTS)).astype(np.int32)
    pair[random.uniform(size=CONTACTS) < 0.2] = -1
    mobility = np.repeat(10.0 ** random.uniform(-1.0, 1.0, (NODES, 1)), 3, axis=1)
    mobility[random.uniform(size=(NODES, 3)) < 0.05] = 0.0
    wanted = -2.0 * random.uniform(size=CONTACTS)
    return ContactRows(rows, weights, normals, wanted, friction, pair), random.normal(size=(NODES, 3)), mobility


class Plain:
    """Sweeps over all contacts, in plain Python."""

    def __init__(self, met: ContactRows, v: Floats, mobility: Floats) -> None:
        self.met, self.v, self.mobility = met, v.copy(), mobility
        self.push, self.total = np.zeros((CONTACTS, 4)), np.zeros((NODES, 3), np.int64)
        self.last = np.zeros(CONTACTS)
        sums, sizes = np.zeros((NODES, 4), np.int64), np.column_stack([np.abs(met.normals), np.ones(CONTACTS)])
        for p in range(CONTACTS):
            for k in range(4):
                quanta = abs(met.weights[p, k]) * _QUANTA
                sums[met.nodes[p, k]] += np.rint(quanta * sizes[p]).astype(np.int64)
        self.norms = np.array([self._norms(p, sums) for p in range(CONTACTS)])

    def _norms(self, p: int, sums: "np.ndarray") -> tuple[float, float]:
        """Returns the row norms of contacts along the normal and across it."""
        met, along, across = self.met, 0.0, 0.0
        for k in range(4):
            a, weight = met.nodes[p, k], abs(met.weights[p, k]) / _QUANTA
            for i in range(3):
                along += weight * abs(met.normals[p, i]) * sums[a, i] * self.mobility[a, i]
            across += weight * sums[a, 3] * self.mobility[a].max()
        return along or np.inf, across or np.inf

    def give(self, changes: Floats) -> None:
        """Applies the changes (contacts, 3) of the impulses of contacts to the velocities."""
        impulse, met = np.zeros((NODES, 3), np.int64), self.met
        for p in range(CONTACTS):
            parts = [np.rint(met.weights[p, k] * changes[p] * _SCALE).astype(np.int64) for k in (1, 2, 3)]
            for k, part in enumerate(parts):
                impulse[met.nodes[p, k + 1]] += part
            impulse[met.nodes[p, 0]] -= sum(parts)
        self.total += impulse
        self.v = np.where(impulse != 0, self.v + impulse * (self.mobility / _SCALE), self.v)

    def resume(self, kept: Kept, ratio: float) -> None:
        """Applies a warm start from the stored impulses of pairs and cracks."""
        met, changes = self.met, np.zeros((CONTACTS, 3))
        for p in np.flatnonzero(met.pair != -1):
            share, last = (0.8, kept.pairs[p]) if met.pair[p] >= 0 else (1.0, kept.cracks[p])
            along = _dot(last[1:], met.normals[p])
            self.push[p, 0] = self.last[p] = share * ratio * last[0] / self.norms[p, 0]
            self.push[p, 1:] = ratio * (last[1:] - along * met.normals[p]) / self.norms[p, 1]
            changes[p] = self.push[p, 0] * met.normals[p] + self.push[p, 1:]
        self.give(changes)

    def sweep(self, ahead: float = 0.0) -> None:
        """Makes one sweep; the changes along the normals are extrapolated by the factor ``ahead``."""
        self.give(np.array([self.change(p, ahead) for p in range(CONTACTS)]))

    def change(self, p: int, ahead: float) -> Floats:
        """Corrects the impulse of one contact."""
        met, normal, old = self.met, self.met.normals[p], self.push[p].copy()
        rate = np.zeros(3)
        for k in range(4):
            rate = rate + met.weights[p, k] * self.v[met.nodes[p, k]]
        speed = _dot(normal, rate)
        plain = max(0.0, old[0] + (met.wanted[p] - speed) / self.norms[p, 0])
        self.push[p, 0] = max(0.0, plain + ahead * (plain - self.last[p]))
        self.last[p] = plain
        change = (self.push[p, 0] - old[0]) * normal
        if met.friction[p] > 0.0:
            aim = old[1:] - (rate - speed * normal) / self.norms[p, 1]
            size, most = _dot(aim, aim), met.friction[p] * self.push[p, 0]
            aim = (most / np.sqrt(size) if size > most * most else 1.0) * aim
            change = change + (aim - old[1:])
            self.push[p, 1:] = aim
        return np.asarray(change)


def _dot(a: Floats, b: Floats) -> float:
    """Returns a dot product with the order of operations of the kernels."""
    return float(0.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@pytest.mark.parametrize("resumed", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_kernels_have_the_bits_of_the_formula(seed: int, resumed: bool) -> None:
    """Idle contacts are skipped and cracks have two nodes; no bit of the result differs."""
    met, v, mobility = scene(seed)
    plain, solver = Plain(met, v, mobility), Solver(met, v, mobility, _SCALE)
    if resumed:
        some = np.abs(np.random.default_rng(seed + 100).normal(size=(2, CONTACTS, 4))) * [0.1, 0.01, 0.01, 0.01]
        some[:, ::3], some[:, met.friction == 0.0, 1:] = 0.0, 0.0
        kept = Kept(*some)
        plain.resume(kept, 0.9)
        solver.resume(kept, 0.9)
    for _ in range(SWEEPS):
        plain.sweep()
        solver.sweep()
        assert (solver.v == plain.v).all()
        assert (solver.total == plain.total).all()
        assert (solver.push == plain.push).all()


@pytest.mark.parametrize("seed", range(12))
def test_a_step_has_the_bits_of_sweeps_with_momentum(seed: int) -> None:
    """The factor of extrapolation is Nesterov's k / (k + 3), and the last sweep has no extrapolation."""
    met, v, mobility = scene(seed)
    for many in (1, 2, 5, 20):
        plain, solver = Plain(met, v, mobility), Solver(met, v, mobility, _SCALE)
        for k in range(many):
            plain.sweep(k / (k + 3.0) if k < many - 1 else 0.0)
        assert (solver.step(many) == plain.v).all()
        assert (solver.push == plain.push).all()


def test_idle_contacts_are_skipped_until_others_load_them() -> None:
    """The scenes of the comparison contain idle contacts, and contacts that are loaded later."""
    idle = np.array([[CONTACTS - len(rows) for rows in loaded(seed)] for seed in range(12)])
    assert (idle[:, -1] > 0).all()
    assert (idle[:, -1] < idle[:, 0]).any()


def loaded(seed: int) -> list["np.ndarray"]:
    """Returns the contacts that have needed an impulse, after every sweep."""
    solver, rows = Solver(*scene(seed), _SCALE), []
    for _ in range(SWEEPS):
        solver.sweep()
        rows.append(solver.active.pushes()[0])
    return rows


def test_slots_are_used_again() -> None:
    """A second step with the same arrays and other nodes has the same result as with new arrays."""
    first, second = scene(1), scene(2)
    alone, solver = Solver(*second, _SCALE), Solver(*first, _SCALE)
    solver.sweep(SWEEPS)
    again = Solver(*second, _SCALE, solver.active)
    assert (again.sweep(SWEEPS) == alone.sweep(SWEEPS)).all()
