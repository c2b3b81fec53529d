"""Fracture criterion: traction of the two sides, the inexpensive test before the criterion, strengths, delay."""

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from conoid.cases.model import materials, schema
from conoid.worker import step
from conoid.worker.elements import hot, scratch
from conoid.worker.fracture import criterion
from conoid.worker.fracture.facets import facet_ids
from conoid.worker.fracture.strength import Toughness, toughness
from conoid.worker.fracture.strength import required as required_traction
from conoid.worker.mesh.faces import FACES
from conoid.worker.model import state
from conoid.worker.model.rows import MASS, PRESSURE, S_XX, S_XY, VISCOUS
from conoid.worker.model.state import CHUNK, Floats, Ints
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of
from ..worker.formulas import at_nodes
from ..worker.kernels import build
from ..worker.meshes import REGULAR, block
from ..worker.simulations import on

GLASS = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=72e9, poisson=0.22),
    brittle=materials.Brittle(strength=60e6, energy=20.0, scatter=materials.Scatter(modulus=8.0, seed=5)),
)  # fmt: skip
MANY = 100_000
ROWS = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
"""Row of the state array for each component of the stress deviator."""


def effective(traction: Floats, normal: Floats, weight: float, friction: float) -> Floats:
    """Returns the effective traction of Camacho and Ortiz (1996) for tractions and unit normals (n, 3)."""
    along = (traction * normal).sum(axis=1)
    across = np.linalg.norm(traction - along[:, None] * normal, axis=1)
    pressed = math.sqrt(weight) * np.maximum(across + friction * np.minimum(along, 0.0), 0.0)
    return np.asarray(np.where(along >= 0.0, np.hypot(along, math.sqrt(weight) * across), pressed))


# Inexpensive test before the criterion


def marks(corners: Floats, rows: Floats, weakest: Floats, weight: float) -> Ints:
    """Returns (n, 4) the result of ``mark_hot`` for tets ``corners`` (n, 4, 3) under ``rows`` (n, 7) of stress."""
    n = len(corners)
    out = np.zeros((n, 4), np.int64)
    for start in range(0, n, CHUNK):
        some = slice(start, min(start + CHUNK, n))
        m = some.stop - start
        e = corners[some, 1:] - corners[some, :1]
        vectors = np.stack([np.cross(e[:, (k + 1) % 3], e[:, (k + 2) % 3]) for k in range(3)], axis=1)
        w, s, found = np.zeros(scratch.SCRATCH), np.zeros(20 * CHUNK), np.zeros(CHUNK, np.uint8)
        w[scratch.EDGE : scratch.EDGE + 9 * CHUNK].reshape(9, CHUNK)[:, :m] = vectors.reshape(m, 9).T
        s.reshape(20, CHUNK)[: PRESSURE + 1, :m] = rows[some].T
        s.reshape(20, CHUNK)[VISCOUS] = 1e12
        any_hot = hot.mark_hot(found, w, s, np.ascontiguousarray(weakest[some]), weight, m)
        assert any_hot == found[:m].any()
        out[some] = found[:m, None] >> np.arange(4) & 1
    return out


def stresses(rows: Floats) -> Floats:
    """Returns (n, 3, 3) stresses from rows (n, 7): deviator and pressure."""
    return np.asarray(rows[:, ROWS] - rows[:, PRESSURE, None, None] * np.eye(3))


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0, 4.0])
def test_a_facet_that_passes_is_overstressed_on_one_side_at_least(weight: float) -> None:
    """Checks 100 000 pairs of tets with random stresses; with equal stress in both tets, the marked faces are those
    that pass the criterion in tension.
    """
    random = np.random.default_rng([1, int(10 * weight)])
    corners = REGULAR + random.uniform(-0.3, 0.3, (MANY, 4, 3))
    mirrored = corners.copy()
    mirrored[:, 0] += 2.0 * (corners[:, 1:].mean(axis=1) - corners[:, 0])
    one, two = (random.normal(size=(MANY, 7)) * 10.0 ** random.uniform(-1, 1, (MANY, 1)) for _ in range(2))
    same = random.uniform(size=MANY) < 0.3
    two[same] = one[same]
    normal = np.cross(corners[:, 2] - corners[:, 1], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    traction = np.einsum("nij,nj->ni", 0.5 * (stresses(one) + stresses(two)), normal)
    friction = float(random.uniform(0.0, 1.0))
    strength = 10.0 ** random.uniform(-1, 1, MANY)
    passes = effective(traction, normal, weight, friction) >= strength * (1.0 + 1e-12)
    weakest = strength * random.uniform(0.5, 1.0, (2, MANY))
    first, second = marks(corners, one, weakest[0], weight), marks(mirrored, two, weakest[1], weight)
    found = (first[:, 0] | second[:, 0]) > 0
    assert (found | ~passes).all()
    assert MANY / 20 < passes.sum() < found.sum() < MANY
    exact = marks(corners, one, strength, weight)[:, 0] > 0
    sure = same & (np.abs(effective(traction, normal, weight, 0.0) / strength - 1.0) > 1e-9)
    pulled: state.Flags = sure & ((traction * normal).sum(axis=1) >= 0.0)
    assert pulled.sum() > MANY / 20
    assert (exact == (effective(traction, normal, weight, 0.0) >= strength))[pulled].all()


# Tractions


def loaded_sim(sim: Simulation) -> Simulation:
    """Returns a simulation with random stresses by the id of the tet; every face is marked, and all tractions are below
    the strength.
    """
    step.prepare(sim)
    for b in sim.model.blocks:
        for row in (*range(S_XX, S_XY + 1), PRESSURE, VISCOUS):
            values = 1e8 * np.sin(1.0 + row + 12.9898 * b.id)
            flat = np.zeros(b.state.shape[0] * CHUNK)
            flat[: b.n] = values
            b.state[:, row, :] = flat.reshape(-1, CHUNK)
        b.hot[:] = 15
    assert sim.fracture is not None
    for body in sim.fracture.initiation.bodies:
        body.facets.strength[:] = 0.0
    interface = sim.fracture.initiation.interface
    interface.receive(interface.words(hot=True))
    return sim


def tractions(sim: Simulation) -> dict[int, list[float]]:
    """Returns the traction and the effective traction of the facets whose side of smaller id is on this rank, by the
    number of this side.
    """
    assert sim.fracture is not None
    found: dict[int, list[float]] = {}
    initiation = sim.fracture.initiation
    for body, some in initiation.candidates():
        first = some.shared < 0
        first[~first] = initiation.interface.facets.first[some.shared[~first]]
        ids = facet_ids(body.block, some.place, some.face)
        found.update(zip(ids[first].tolist(), some.traction[first].tolist(), strict=True))
    return found


def case_of(**fracture: Any) -> schema.Case:
    case = meeting_of([{"fracture": schema.Fracture(**fracture)}], material=GLASS)
    return case.model_copy(update={"contact": None})


@pytest.mark.parametrize("source", ["tets", "nodes"])
def test_tractions_are_those_of_numpy_and_the_same_on_any_number_of_ranks(source: str) -> None:
    """The traction of a facet is the mean of its two sides, or of its three nodes by volume, without the viscous part.
    The traction acts on the outward normal of the tet of smaller id, and exists once for each facet.
    """
    mesh, case = block((3, 3, 2), 1e-3, seed=2), case_of(delay=0.0, shear_weight=0.7, friction=0.4, traction=source)
    sim = loaded_sim(build(case, [mesh]))
    found = tractions(sim)
    (b,) = sim.model.blocks
    place, face = np.nonzero((b.across >= 0) & (4 * b.id[:, None] + np.arange(4) < b.across))
    rows = np.stack([b.row(row) for row in range(PRESSURE + 1)], axis=1)
    stress = np.zeros((len(b.id), 3, 3))
    stress[b.id] = stresses(rows)
    a, c, d = (sim.model.nodes.x[b.tets[place, FACES[face, k]]] for k in range(3))
    normal = np.cross(c - a, d - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    mean = beside = 0.5 * (stress[b.id[place]] + stress[b.across[place, face] // 4])
    if source == "nodes":
        mass = b.row(MASS)
        weighted = at_nodes(
            b.tets, np.repeat((mass[:, None, None] * stress[b.id])[:, None], 4, axis=1), len(mesh.points)
        )
        nodal = weighted / at_nodes(b.tets, np.repeat(mass[:, None], 4, axis=1), len(mesh.points))[:, None, None]
        mean = sum(nodal[b.tets[place, FACES[face, k]]] for k in range(3)) / 3.0
    expected, of_tets = (np.einsum("nij,nj->ni", each, normal) for each in (mean, beside))
    keys = (4 * b.id[place] + face).tolist()
    assert sorted(found) == sorted(keys)
    got = np.array([found[key] for key in keys])
    near = (1e-12, 1e-11) if source == "tets" else (1e-7, 1e-6)  # nodal sums are in quanta of 2^-30
    own, theirs = (effective(each, normal, 0.7, 0.4) for each in (expected, of_tets))
    expected *= np.where(own > theirs, theirs / np.maximum(own, 1e-9), 1.0)[:, None]
    assert got[:, :3] == pytest.approx(expected, abs=near[0] * 1e8)
    assert got[:, 3] == pytest.approx(np.minimum(own, theirs), rel=near[1], abs=1e8 * near[1])
    assert got[:, 3] == pytest.approx(effective(got[:, :3], normal, 0.7, 0.4), rel=1e-6, abs=1.0)
    assert (got[:, 3] == 0.0).any()
    for ranks in (2, 3, 5):
        parts = on(ranks, case, [mesh], lambda sim: tractions(loaded_sim(sim)))
        assert sum(map(len, parts)) == len(found)
        assert {key: value for part in parts for key, value in part.items()} == found


def test_facets_below_their_strength_are_no_candidates() -> None:
    """The broken facets are the same on any number of ranks."""
    mesh, case = block((3, 3, 2), 1e-3, seed=2), case_of(delay=0.0, shear_weight=0.7, friction=0.4)

    def strengthened(sim: Simulation) -> Simulation:
        assert loaded_sim(sim).fracture is not None
        for body in sim.fracture.initiation.bodies if sim.fracture is not None else []:
            faces = np.broadcast_to(np.arange(4), (body.block.n, 4))
            ids = facet_ids(body.block, np.arange(body.block.n)[:, None], faces)
            body.facets.strength[:] = 5e7 + 1e8 * np.cos(ids) ** 2
        return sim

    found, every = (tractions(each(build(case, [mesh]))) for each in (strengthened, loaded_sim))
    assert found == {key: value for key, value in every.items() if value[3] >= 5e7 + 1e8 * np.cos(key) ** 2}
    assert len(every) / 20 < len(found) < len(every) / 2
    for ranks in (2, 3, 5):
        parts = on(ranks, case, [mesh], lambda sim: tractions(strengthened(sim)))
        assert {key: value for part in parts for key, value in part.items()} == found


def test_the_effective_traction_is_that_of_camacho_and_ortiz() -> None:
    random = np.random.default_rng(3)
    t, n = random.normal(size=(2000, 3)), random.normal(size=(2000, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    for weight, friction in ((0.0, 0.0), (1.0, 0.0), (0.4, 0.5), (2.0, 1.5)):
        got = [criterion.effective(a, b, weight, friction) for a, b in zip(t, n, strict=True)]
        assert np.array(got) == pytest.approx(effective(t, n, weight, friction), rel=1e-12, abs=1e-12)


def test_a_facet_that_is_only_pressed_never_breaks() -> None:
    """The facet is under hydrostatic pressure of any size; eq. (1) of the paper squares the normal traction."""
    corners = np.repeat(REGULAR[None], 5, axis=0)
    rows = np.zeros((5, 7))
    rows[:, PRESSURE] = 10.0 ** np.arange(5.0)
    for weight in (0.0, 1.0):
        assert not marks(corners, rows, np.full(5, 1e-3), weight).any()
    normal = np.array([0.0, 0.0, 1.0])
    assert criterion.effective(-1e9 * normal, normal, 1.0, 0.0) == 0.0


# Strengths


def tough(**changes: object) -> Toughness:
    scatter = materials.Scatter(**{"modulus": 8.0, "seed": 5, **changes})  # type: ignore[arg-type]
    brittle = materials.Brittle(strength=60e6, energy=20.0, scatter=scatter)
    return toughness(GLASS.model_copy(update={"brittle": brittle}), schema.Fracture(), 1e-3)


def test_a_tiny_modulus_makes_facets_that_never_break() -> None:
    """All other facets break at once, without a warning of numpy."""
    found = tough(modulus=1e-3).strengths(np.arange(100), np.ones(100))
    assert 0.0 < found.min() < 1e-200
    assert np.inf in found


@pytest.mark.parametrize("modulus", [2.0, 8.0, 30.0])
@pytest.mark.parametrize("seed", [0, 5])
def test_strengths_have_the_weibull_distribution(modulus: float, seed: int) -> None:
    """Test of Kolmogorov and Smirnov for the strengths by the ids of a mesh; strengths of different seeds are
    independent.
    """
    ids = 4 * np.arange(20_000) + np.arange(20_000) % 4
    area = np.ones(len(ids))
    found = tough(modulus=modulus, seed=seed, minimum=10e6).strengths(ids, area)
    assert stats.kstest(found, stats.weibull_min(modulus, loc=10e6, scale=50e6).cdf).pvalue > 0.01
    other = tough(modulus=modulus, seed=seed + 1, minimum=10e6).strengths(ids, area)
    assert abs(float(np.corrcoef(stats.rankdata(found), stats.rankdata(other))[0, 1])) < 0.03
    assert abs(float(np.corrcoef(stats.rankdata(found[1:]), stats.rankdata(found[:-1]))[0, 1])) < 0.03


def test_large_facets_are_as_strong_as_their_weakest_part() -> None:
    """A facet of k unit areas has the strength of the weakest of k facets of one unit area."""
    ids, k = np.arange(40_000), 16
    one = tough(modulus=4.0, area=1e-6).strengths(ids, np.full(len(ids), 1e-6)).reshape(-1, k).min(axis=1)
    large = tough(modulus=4.0, area=1e-6).strengths(ids[: len(one)] + 10**6, np.full(len(one), k * 1e-6))
    assert stats.ks_2samp(one, large).pvalue > 0.01
    assert np.median(large) == pytest.approx(60e6 * (math.log(2.0) / k) ** 0.25, rel=0.02)


def test_strengths_are_independent_of_order_and_ranks() -> None:
    """The strength depends on the id of the facet: it is equal on both sides and on all ranks."""
    mesh, case = block((3, 3, 2), 1e-3, seed=2), case_of()

    def strengths(sim: Simulation) -> dict[int, float]:
        assert sim.fracture is not None
        found: dict[int, float] = {}
        for body in sim.fracture.initiation.bodies:
            b = body.block
            place, face = np.nonzero(b.across >= 0)
            ids = facet_ids(b, place, face)
            values = body.facets.strength[place, face].tolist()
            for key, value in zip(ids.tolist(), values, strict=True):
                assert found.setdefault(key, value) == value
            every = np.full((b.n, 4), np.inf)
            every[place, face] = values
            assert (b.weakest == every.min(axis=1)).all()
        return found

    (one,) = on(1, case, [mesh], strengths)
    assert len(set(one.values())) == len(one)
    for ranks in (2, 5):
        for part in on(ranks, case, [mesh], strengths):
            assert part.items() <= one.items()


# Delay of the criterion


def required(made: Toughness, strength: Floats, since: Floats) -> Floats:
    """Returns (n,) the traction, Pa, that breaks facets at the times ``since`` after they first exceeded their
    strength.
    """
    return np.array([required_traction(s, t, made.delay) for s, t in zip(strength, since, strict=True)])


@pytest.mark.parametrize("factor", [0.5, 1.0])
def test_the_delay_is_that_of_the_paper(factor: float) -> None:
    """Eq. (3), strength * e^(t / t_c) / (e^(t / t_c) - 1) with t_c = factor * density * c * energy / strength^2."""
    spec = schema.Fracture(delay=factor)
    made = toughness(GLASS, spec, 1e-3)
    bulk, shear = 72e9 / (3.0 * (1.0 - 0.44)), 72e9 / (2.0 * 1.22)
    c = math.sqrt((bulk + 4.0 / 3.0 * shear) / 2500.0)
    strength = np.array([30e6, 60e6, 90e6])
    t_c = factor * 2500.0 * c * 20.0 / strength**2
    for share in (0.01, 0.3, 1.0, 5.0):
        grown = np.exp(share)
        assert required(made, strength, share * t_c) == pytest.approx(strength * grown / (grown - 1.0), rel=1e-12)
    assert np.isposinf(required(made, strength, np.zeros(3))).all()
    assert required(made, strength, 100.0 * t_c) == pytest.approx(strength, rel=1e-12)


def test_the_delay_comes_from_the_work_on_two_half_spaces() -> None:
    """An incident stress s above the strength opens a crack whose traction falls linearly with the opening d: rho c d'
    / 2 = s - T(d) on each side. The opening 2 energy / strength is reached at the time of eq. (3).
    """
    made = toughness(GLASS, schema.Fracture(delay=1.0), 1e-3)
    impedance = math.sqrt(2500.0 * 72e9 * 0.78 / (1.22 * 0.56))
    strength, energy = 60e6, 20.0
    critical = 2.0 * energy / strength
    for t in (5e-9, 2e-8, 2e-7):
        s = float(required(made, np.array([strength]), np.array([t]))[0])
        rate = 2.0 * strength / (impedance * critical)
        opening = 2.0 * (s - strength) / impedance * math.expm1(rate * t) / rate
        assert opening == pytest.approx(critical, rel=1e-9)


def test_without_delay_the_strength_is_enough() -> None:
    made = toughness(GLASS, schema.Fracture(delay=0.0), 1e-3)
    assert required(made, np.array([1.0, 2.0]), np.zeros(2)).tolist() == [1.0, 2.0]
