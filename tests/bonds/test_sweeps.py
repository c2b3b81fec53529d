"""Kernels of tied rows compared with plain numpy: the impulses solve the linear equations."""

import numpy as np
import pytest

from conoid.worker.bonds import law, sweeps
from conoid.worker.bonds.layout import Layout, laid_out
from conoid.worker.bonds.records import DAMAGE, KEPT, NORMAL, OPENING, PUSH, WIDEST
from conoid.worker.bonds.rows import Rows
from conoid.worker.model.state import Nodes
from conoid.worker.parallel.comm import SerialComm

from ..worker.meshes import Floats

SCALE = 2.0**60
_LAWS = np.zeros((1, 5))


def layout(seed: int, laws: Floats = _LAWS) -> Layout:
    """Returns twenty nodes tied to some of ten other nodes, with random masses and velocities."""
    rng, n, m = np.random.default_rng(seed), 20, 10
    weight = rng.uniform(0.0, 1.0, (n, m)) * (rng.uniform(size=(n, m)) < 0.3) + 1e-3 * np.eye(n, m)
    weight[:, 0] += 0.1
    weight /= weight.sum(axis=1)[:, None]
    row, master = np.nonzero(weight)
    nodes = np.arange(n + m)
    mass = rng.uniform(0.5, 2.0, n + m)
    none = np.zeros((n + m, 3))
    state = Nodes(
        id=nodes, part=nodes.astype(np.int32), owner=np.zeros(n + m, np.int32), owned=np.ones(n + m, bool), x0=none,
        x=none, v=none, mass=mass, force=np.zeros((n + m, 3), np.int64), stepping=mass,
    )  # fmt: skip
    rows = Rows(
        np.zeros(n, np.int64), np.arange(n), np.ones(n), row, n + master, weight[row, master], np.zeros(0, np.int64),
        np.zeros((0, 3), np.int64),
    )  # fmt: skip
    mobility = np.repeat(1.0 / mass[:, None], 3, axis=1)
    free = np.zeros((n + m, 3), bool)
    found = laid_out(rows, np.zeros((n, KEPT)), laws, state, mobility, free, None, 1.0, SerialComm())
    found.nodes.v[:] = rng.normal(size=(n + m, 3))
    return found


def matrix(some: Layout) -> Floats:
    """Returns (rows, nodes) the matrix that gives the relative velocities of the rows from the velocities of the
    nodes."""
    found = np.zeros((len(some.rows.node), len(some.nodes.v)))
    for r, node in enumerate(some.rows.node):
        found[r, node] = 1.0
        for e in range(some.rows.begin[r], some.rows.begin[r + 1]):
            found[r, some.rows.master[e]] -= some.rows.weight[e]
    return found


@pytest.mark.parametrize("seed", range(4))
def test_sweeps_tie_as_the_linear_equations_do(seed: int) -> None:
    some = layout(seed)
    g, before, mobility = matrix(some), some.nodes.v.copy(), some.nodes.mobility
    impulse = np.linalg.solve(g @ (mobility[:, :1] * g.T), -g @ before)
    sweeps.sweep_all(some.rows, some.nodes, some.momentum, 1.0, 1.0, SCALE, some.sweeps)
    after = before + mobility * (g.T @ impulse)
    assert np.abs(some.nodes.v - after).max() < 1e-5 * np.abs(after - before).max()
    assert (some.nodes.total.sum(axis=0) == 0).all(), "momentum stays, to the quantum"
    kept = np.abs(g @ some.nodes.v).max() / np.abs(g @ before).max()
    assert kept < 1e-6, "the bound of the eigenvalues holds"


def test_the_order_of_tasks_changes_no_bit() -> None:
    one, two = layout(1), layout(1)
    sweeps.sweep_all(one.rows, one.nodes, one.momentum, 1.0, 1.0, SCALE, 3)
    for k in range(3):
        for r in reversed(range(20)):
            sweeps.act(two.rows, two.nodes, one.momentum if k < 2 else 0.0, 1.0, 1.0, SCALE, r, r + 1)
        for a in reversed(range(30)):
            sweeps.give(two.rows, two.nodes, SCALE, a, a + 1)
        for a in reversed(range(30)):
            sweeps.move(two.nodes, SCALE, a, a + 1)
    assert one.nodes.v.tobytes() == two.nodes.v.tobytes()


def projected(
    push: Floats, speed: Floats, out: Floats, closed: float, play: float, limits: Floats, stiff: float
) -> Floats:
    """Returns the result of law.project in plain numpy, with a step of 1 kg and 1 s."""
    along, opening = float(push @ out), -float(speed @ out)
    shear = push - along * out - (speed + opening * out)
    pulled, pressed = along + opening - play, along + opening + closed
    along = pulled if pulled > 0.0 else min(pressed, 0.0)
    size = np.hypot(max(along, 0.0) / limits[0], np.linalg.norm(shear) / limits[1])
    factor = min(1.0, stiff / size)
    return np.asarray((factor if along > 0.0 else 1.0) * along * out + factor * shear)


def test_a_bond_carries_what_its_ellipse_allows() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        push, speed, out = rng.normal(size=(3, 3))
        out /= np.linalg.norm(out)
        closed, play, stiff = rng.uniform(0.0, 1.0, 3)
        limits = rng.uniform(0.3, 3.0, 2)
        found = law.project(tuple(push), tuple(speed), tuple(out), closed, play, 1.0, *limits, 1.0, stiff)
        np.testing.assert_allclose(
            found, projected(push, speed, out, closed, play, limits, stiff), rtol=1e-12, atol=1e-14
        )
        across = max(np.dot(found, out), 0.0)
        along = np.linalg.norm(found - np.dot(found, out) * out)
        assert np.hypot(across / limits[0], along / limits[1]) <= stiff * (1.0 + 1e-12)


@pytest.mark.parametrize(("share", "pulls"), [(0.0, [1]), (0.3, [1]), (1.0, [1]), (0.0, 40 * [1] + 30 * [-1])])
def test_a_bond_that_is_opened_takes_its_energy(share: float, pulls: list[int]) -> None:
    """The bond is opened at one velocity, with the fraction ``share`` of the square of the velocity along the
    interface. The bond absorbs G per area in all; closing the bond and opening it again neither takes nor releases
    energy.
    """
    normal, shear, area, dt, energies = 3e6, 5e6, 2.0, 1e-3, (40.0, 90.0)
    some = layout(0, np.array([[normal, shear, *energies, 1.0]]))
    rows, row = some.rows._replace(area=np.full(20, area)), some.rows.state[0]
    row[NORMAL : NORMAL + 3] = out = (0.0, 0.0, 1.0)
    limits, soft, work, before, steps = (dt * area * normal, dt * area * shear), 1e9, 0.0, np.zeros(3), 0
    way = np.array([np.sqrt(share), 0.0, -np.sqrt(1.0 - share)])
    while row[DAMAGE] < 1.0:
        speed = 1e-7 / dt * pulls[steps % len(pulls)] * way
        some.nodes.v[:] = 0.0
        some.nodes.v[rows.node[0]] = speed
        play = row[WIDEST] - row[OPENING]
        push = law.project((0.0, 0.0, 0.0), tuple(speed), out, row[OPENING], play, soft, *limits, dt, 1.0 - row[DAMAGE])
        row[PUSH : PUSH + 3] = push
        work -= 0.5 * np.dot(push, before + speed)
        before, steps = speed, steps + 1
        law.open_bonds(rows, some.nodes, dt, dt, 0, 1)
    wanted = 1.0 / ((1.0 - share) / energies[0] + share / energies[1])
    assert work / area == pytest.approx(wanted, rel=0.02)
