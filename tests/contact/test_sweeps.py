"""Sweeps: exact for one contact, without overshoot for many contacts, independent of the order of contacts, and without
loss of impulse.
"""

import numpy as np
import pytest

from conoid.worker.contact.narrow_phase.tables import CRACK, ContactRows

from ..worker.meshes import Floats
from .bodies import rotation
from .kernels import Solver, many, network, taken, unit

SEEDS = range(40)


def energy(v: Floats, mobility: Floats) -> float:
    """Returns the kinetic energy, J, of the velocity components that can move."""
    mass = np.divide(1.0, mobility, out=np.zeros_like(mobility), where=mobility > 0.0)
    return float(0.5 * (mass * v * v).sum())


def rates(met: ContactRows, v: Floats) -> Floats:
    """Returns (n, 3) the relative velocity at each contact."""
    return np.asarray(np.einsum("pk,pki->pi", met.weights, v[met.nodes]))


def speeds(met: ContactRows, v: Floats) -> Floats:
    """Returns (n,) the relative velocities along the normals of the contacts."""
    return np.asarray((rates(met, v) * met.normals).sum(axis=1))


def rows_of(met: ContactRows, nodes: int) -> Floats:
    """Returns (n, 3 nodes) the matrix that gives normal speeds from velocities."""
    rows = np.zeros((many(met), nodes, 3))
    for p in range(many(met)):
        rows[p, met.nodes[p]] += met.weights[p][:, None] * met.normals[p]
    return rows.reshape(many(met), -1)


def dense(met: ContactRows, v: Floats, mobility: Floats) -> Floats:
    """Returns the velocities of the exact solution of the frictionless problem, by projected Gauss-Seidel."""
    J, inverse = rows_of(met, len(v)), mobility.reshape(-1)
    A, rest = J * inverse @ J.T, J @ v.reshape(-1) - met.wanted
    push = np.zeros(many(met))
    for _ in range(20_000):
        before = push.copy()
        for p in range(many(met)):
            push[p] = max(0.0, push[p] - (A[p] @ push + rest[p]) / A[p, p])
        if np.abs(push - before).max() <= 1e-14 * push.max():
            break
    return np.asarray(v + (inverse * (push @ J)).reshape(-1, 3))


def alone(seed: int, friction: float = 0.0) -> tuple[ContactRows, Floats, Floats]:
    """Returns one contact of a random network, oriented so that the contact needs an impulse."""
    met, v, mobility = network(seed, 1, 4, friction)
    v *= np.sign(-speeds(met, v)[0])
    return met, v, mobility


@pytest.mark.parametrize("seed", SEEDS)
def test_one_contact_is_solved_in_one_sweep(seed: int) -> None:
    """The contact has any masses and weights, and some held velocity components."""
    met, v, mobility = alone(seed)
    random = np.random.default_rng(seed)
    met.wanted[:] = random.uniform(0.0, 5.0)
    mobility *= random.uniform(size=mobility.shape) > 0.3
    after = Solver(met, v, mobility).sweep()
    assert speeds(met, after)[0] == pytest.approx(met.wanted[0], abs=1e-7)
    held = mobility == 0.0
    assert (after[held] == v[held]).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_impulses_add_up_to_exactly_nothing_and_act_along_the_normals(seed: int) -> None:
    met, v, mobility = network(seed)
    solver = Solver(met, v, mobility)
    solver.sweep(7)
    assert np.abs(solver.total).max() > 2**36
    assert (solver.total.sum(axis=0) == 0).all()
    pushes = (rows_of(met, len(v)).T @ solver.push[:, 0]).reshape(-1, 3)
    assert np.abs(pushes - solver.total / solver.scale).max() < 4.0 * 7 * many(met) / solver.scale
    assert np.abs(v + mobility * pushes - solver.v).max() < 1e-9 * np.abs(v).max()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_contact_never_pulls(seed: int) -> None:
    """No impulse of a contact is negative after any sweep. A contact that opens without an impulse is not changed, to
    the last bit.
    """
    met, v, mobility = network(seed, wanted=20.0, friction=0.4)
    solver = Solver(met, v, mobility)
    for _ in range(20):
        solver.sweep()
        assert (solver.push[:, 0] >= 0.0).all()
    met.wanted[:] = speeds(met, v) - 1e-3
    assert (Solver(met, v, mobility).sweep(5) == v).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_an_impulse_that_was_too_large_is_reduced(seed: int) -> None:
    """The sum of the changes over the sweeps cannot be negative, but the change in one sweep can be negative: at the
    end no open contact has an impulse.
    """
    met, v, mobility = network(seed)
    solver = Solver(met, v, mobility)
    solver.sweep(4000)
    opening = speeds(met, solver.v) > 1e-3 * np.abs(v).max()
    assert opening.any()
    assert solver.push[opening, 0].max() < 1e-3 * solver.push[:, 0].max()


@pytest.mark.parametrize("wanted", [0.0, 10.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_kinetic_energy_never_rises_where_nothing_overlaps(seed: int, wanted: float) -> None:
    """The kinetic energy does not rise for any number of sweeps, even with held velocity components. Without prescribed
    motions the energy does not rise from sweep to sweep.
    """
    met, v, mobility = network(seed, wanted=wanted)
    mobility *= np.random.default_rng(seed).uniform(size=mobility.shape) > 0.1
    v[mobility == 0.0] = 0.0
    solver, start = Solver(met, v, mobility), energy(v, mobility)
    last = start
    for _ in range(30):
        now = energy(solver.sweep(), mobility)
        assert now <= (last if wanted == 0.0 else start) * (1.0 + 1e-9)
        last = now
    assert last < 0.999 * start


@pytest.mark.parametrize("along_axes", [False, True])
@pytest.mark.parametrize("held", [0.0, 0.2])
@pytest.mark.parametrize("friction", [0.1, 0.5, 2.0])
def test_kinetic_energy_never_rises_with_friction(friction: float, held: float, along_axes: bool) -> None:
    """Some contacts have friction along the normal of another contact."""
    worst = 0.0
    for seed in range(60):
        met, v, mobility = network(seed, friction=friction)
        if along_axes:
            met.normals[:] = np.eye(3)[np.abs(met.normals).argmax(axis=1)] * np.sign(met.normals[:, :1])
        mobility *= np.random.default_rng(seed).uniform(size=mobility.shape) >= held
        v[mobility == 0.0] = 0.0
        solver, start = Solver(met, v, mobility), energy(v, mobility)
        worst = max(worst, *(energy(solver.sweep(), mobility) / start for _ in range(20)))
    assert worst <= 1.0 + 1e-9


@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5, 2.0])
def test_kinetic_energy_never_rises_in_a_step(friction: float) -> None:
    """The kinetic energy does not rise for any number of sweeps with extrapolation."""
    worst = 0.0
    for seed in range(40):
        met, v, mobility = network(seed, friction=friction, wanted=5.0 if seed % 2 else 0.0)
        mobility *= np.random.default_rng(seed).uniform(size=mobility.shape) > 0.1
        v[mobility == 0.0] = 0.0
        start = energy(v, mobility)
        worst = max(worst, *(energy(Solver(met, v, mobility).step(many), mobility) / start for many in range(1, 26)))
    assert worst <= 1.0 + 1e-9


@pytest.mark.parametrize(("many", "plain"), [(10, 20), (20, 60)])
def test_momentum_does_what_many_more_plain_sweeps_do(many: int, plain: int) -> None:
    """Ten contacts have a common node; the error is measured in the norm of the kinetic energy."""
    left = np.zeros(2)
    for seed in range(10):
        met, v, mobility = network(seed, meetings=60)
        exact, mass = dense(met, v, mobility), 1.0 / mobility
        found = Solver(met, v, mobility).step(many), Solver(met, v, mobility).sweep(plain)
        left += [float((mass * (one - exact) ** 2).sum()) for one in found]
    assert left[0] < left[1]


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_order_of_contacts_changes_no_bit(seed: int, friction: float) -> None:
    met, v, mobility = network(seed, friction=friction)
    order = np.random.default_rng(seed).permutation(many(met))
    other = taken(met, order)
    one, two = Solver(met, v, mobility), Solver(other, v, mobility)
    assert one.sweep(9).tobytes() == two.sweep(9).tobytes()
    assert (one.total == two.total).all()
    assert (one.push[order] == two.push).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_held_components_keep_their_velocity_to_the_bit(seed: int) -> None:
    met, v, mobility = network(seed, friction=0.3)
    held = np.random.default_rng(seed).uniform(size=mobility.shape) < 0.4
    mobility[held] = 0.0
    solver = Solver(met, v, mobility)
    after = solver.sweep(10)
    assert (after[held] == v[held]).all()
    assert (after[~held] != v[~held]).any()
    assert np.isfinite(after).all()


def test_where_nothing_can_move_nothing_does() -> None:
    met, v, mobility = network(1, friction=0.3)
    assert (Solver(met, v, 0.0 * mobility).sweep(3) == v).all()


@pytest.mark.parametrize("seed", range(10))
def test_sweeps_converge_to_the_solution_of_the_dense_problem(seed: int) -> None:
    met, v, mobility = network(seed, meetings=20, wanted=1.0)
    exact, mass = dense(met, v, mobility), 1.0 / mobility
    assert speeds(met, exact).min() > met.wanted.min() - 1e-9
    errors = []
    solver = Solver(met, v, mobility)
    for _ in range(6):
        off = solver.v - exact
        errors.append(np.sqrt((mass * off * off).sum()))
        solver.sweep(len(errors) ** 3 * 20)
    assert (np.diff(errors) < 1e-9).all()
    assert errors[-1] < 1e-6 * errors[0]


@pytest.mark.parametrize("seed", range(10))
def test_the_error_falls_with_every_sweep(seed: int) -> None:
    """The error of the sweeps is measured in the norm of the kinetic energy, from the first sweep on."""
    met, v, mobility = network(seed, one_normal=seed % 2 == 0)
    exact, mass = dense(met, v, mobility), 1.0 / mobility
    solver, errors = Solver(met, v, mobility), []
    for _ in range(25):
        off = solver.v - exact
        errors.append(float((mass * off * off).sum()))
        solver.sweep()
    assert (np.diff(errors) < 1e-12 * errors[0]).all()


@pytest.mark.parametrize("mu", [0.05, 0.3, 1.0])
def test_friction_is_bounded_by_mu_times_the_normal_impulse(mu: float) -> None:
    slides = 0
    for seed in SEEDS:
        met, v, mobility = network(seed, friction=mu)
        solver = Solver(met, v, mobility)
        for _ in range(10):
            solver.sweep()
            size = np.linalg.norm(solver.push[:, 1:], axis=1)
            assert (size <= mu * solver.push[:, 0] * (1.0 + 1e-12)).all()
            across = (solver.push[:, 1:] * met.normals).sum(axis=1)
            assert np.abs(across).max() < 1e-9 * (size.max() + 1.0)
        slides += int((size > 0.999 * mu * solver.push[:, 0]).sum())
    assert slides > 100


@pytest.mark.parametrize("seed", SEEDS)
def test_one_contact_sticks_when_it_can_and_slides_when_it_must(seed: int) -> None:
    """A contact that sticks has no relative velocity after the sweeps. In a contact that slides, friction acts against
    the motion, with mu times the normal impulse.
    """
    met, v, mobility = alone(seed)
    met.friction[:] = 1e3
    assert np.abs(rates(met, Solver(met, v, mobility).sweep(1))).max() < 1e-7
    met.friction[:] = 1e-3
    solver = Solver(met, v, mobility)
    tangent = rates(met, v)[0] - speeds(met, v)[0] * met.normals[0]
    left = rates(met, solver.sweep(1))[0]
    assert left @ met.normals[0] == pytest.approx(0.0, abs=1e-7)
    assert left @ tangent > 0.0
    assert np.cross(left, tangent) == pytest.approx(0.0, abs=1e-7 * float(tangent @ tangent))
    assert solver.push[0, 1:] == pytest.approx(-1e-3 * solver.push[0, 0] * tangent / np.linalg.norm(tangent), abs=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_friction_is_isotropic(seed: int) -> None:
    """A rotation of the whole scene rotates the impulses of the nodes in the same way."""
    met, v, mobility = alone(seed, friction=0.4)
    turn = rotation(unit(np.random.default_rng(seed), 1)[0], 1.0)
    before = Solver(met, v, mobility).sweep(3)
    met.normals[:] = met.normals @ turn.T
    assert Solver(met, v @ turn.T, mobility).sweep(3) == pytest.approx(before @ turn.T, abs=1e-8)


@pytest.mark.parametrize("mu", [0.0, 0.2, 50.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_energy_lost_is_friction_heat_and_the_work_of_the_normal_impulse(seed: int, mu: float) -> None:
    """The energy of one contact is -1/2 times the impulse times the sum of the speeds before and after the impulse;
    heat and work are never negative.
    """
    met, v, mobility = alone(seed, friction=mu)
    solver = Solver(met, v, mobility)
    after = solver.sweep(4)
    lost = energy(v, mobility) - energy(after, mobility)
    normal = -0.5 * solver.push[0, 0] * float(speeds(met, v)[0] + speeds(met, after)[0])
    heat = solver.heat(v)
    assert normal >= -1e-9
    assert heat >= 0.0
    assert (heat > 0.0) == (mu > 0.0)
    assert lost == pytest.approx(normal + heat, rel=1e-7)


@pytest.mark.parametrize(("cracks", "share"), [(False, 0.8), (True, 1.0)])
def test_a_step_begins_with_the_impulses_of_the_one_before(cracks: bool, share: float) -> None:
    """The start values are the whole friction impulse, across the present normal, and a fraction of the normal impulse;
    for cracks they include the whole normal impulse.
    """
    met, v, mobility = network(7, friction=0.4)
    if cracks:
        met.nodes[:, 2:], met.weights[:] = met.nodes[:, 1:2], (1.0, -1.0, 0.0, 0.0)
        met.pair[:] = CRACK - met.pair
    first, again = Solver(met, v, mobility), Solver(met, v, mobility)
    solved = first.sweep(2000)
    again.resume(first.kept)
    across = first.push[:, 1:] - (first.push[:, 1:] * met.normals).sum(axis=1)[:, None] * met.normals
    assert again.push[:, 1:] == pytest.approx(across, abs=1e-9)
    assert again.push[:, 0] == pytest.approx(share * first.push[:, 0], abs=1e-9)
    assert np.abs(again.sweep(5) - solved).max() < 0.5 * np.abs(Solver(met, v, mobility).sweep(5) - solved).max()


def test_a_node_that_has_become_lighter_begins_with_less() -> None:
    """The start value gives the same speed as in the previous step: with an eighth of the mass on each side it is an
    eighth of the impulse.
    """
    met, v, mobility = network(7, friction=0.4)
    heavy, same, light = Solver(met, v, mobility), Solver(met, v, mobility), Solver(met, v, 8.0 * mobility)
    heavy.sweep(2000)
    same.resume(heavy.kept)
    light.resume(heavy.kept)
    assert light.push == pytest.approx(same.push / 8.0, abs=1e-9)
    assert light.v - v == pytest.approx(same.v - v, abs=1e-9)
