"""Largest compression of brittle materials without a law of compressive failure, by Griffith's criterion."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.model import materials, schema
from conoid.cases.outcome import Compressed
from conoid.cases.warnings.compression import borne, griffith
from conoid.worker import step
from conoid.worker.elements.crushing import crushed, hardest, principal
from conoid.worker.model.rows import PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ
from conoid.worker.model.state import CHUNK
from conoid.worker.simulation import Simulation

from . import formulas
from .brittle import random_deviators
from .kernels import GLASS, HARD, Patch, scene
from .meshes import Floats, block
from .simulations import kept_again, on, tick

STRENGTH = 60e6
BRITTLE = materials.Material(
    density=2500.0, elastic=GLASS.elastic, brittle=materials.Brittle(strength=STRENGTH, energy=8.0)
)  # fmt: skip
DEVIATOR = (S_XX, S_YY, S_ZZ, S_YZ, S_ZX, S_XY)


def chunks(stress: Floats) -> Floats:
    """Returns the state of tets with the given stresses (n, 3, 3), Pa, positive in tension."""
    n, s = len(stress), formulas.deviator(stress)
    state = np.zeros((-(-n // CHUNK), PRESSURE + 1, CHUNK))
    rows = [s[:, 0, 0], s[:, 1, 1], s[:, 2, 2], s[:, 1, 2], s[:, 2, 0], s[:, 0, 1]]
    for row, values in [*zip(DEVIATOR, rows, strict=True), (PRESSURE, -np.trace(stress, axis1=1, axis2=2) / 3.0)]:
        for c in range(len(state)):
            part = values[c * CHUNK : (c + 1) * CHUNK]
            state[c, row, : len(part)] = part
    return state


def stresses(n: int) -> Floats:
    """Returns stresses of all kinds: two equal or nearly equal principal values, tension and compression from all
    sides."""
    random = np.random.default_rng(5)
    s = random_deviators(n, random)
    return s - (random.normal(size=n) * formulas.mises(s))[:, None, None] * np.eye(3)


def beyond(stress: Floats) -> Floats:
    """Returns (n,) values of Griffith's criterion, computed with the eigenvalues of numpy."""
    pressures = -np.linalg.eigvalsh(stress)
    s1, s3 = pressures[:, 0], np.maximum(pressures[:, 2], 0.0)
    times: Floats = np.divide((s1 - s3) ** 2, 8.0 * STRENGTH * (s1 + s3), out=np.zeros(len(s1)), where=s1 > 0.0)
    return times


def test_principal_pressures_are_those_of_numpy() -> None:
    """The tolerance for two equal principal values is the square root of round-off, because equal values are a double
    root.
    """
    stress = stresses(2000)
    state, known = chunks(stress), -np.linalg.eigvalsh(stress)
    found = np.array([principal(state[i // CHUNK].reshape(-1), i % CHUNK) for i in range(len(stress))])
    assert (np.abs(found - known[:, [0, 2]]).max(axis=1) / np.abs(known).max(axis=1)).max() < 1e-7


def test_no_stress_has_none() -> None:
    assert principal(chunks(np.zeros((1, 3, 3)))[0].reshape(-1), 0) == (0.0, 0.0)


def test_the_hardest_is_that_of_all_tets() -> None:
    """The bounds do not exclude the tet with the largest value, for any largest value so far and any position of this
    tet."""
    stress = stresses(1500)
    for last in (1500, 700, 300, 40, 5, 1):
        expected, of = beyond(stress[:last]), (0, -(-last // CHUNK))
        place, times = hardest(chunks(stress[:last]), np.arange(last), last, STRENGTH, 0.0, *of)
        assert times == pytest.approx(expected.max(initial=0.0), rel=1e-6)
        assert crushed(chunks(stress[:last]), last, STRENGTH, *of) == (expected > 1.0).sum()
        if times > 0.0:
            assert place == expected.argmax()
            assert hardest(chunks(stress[:last]), np.arange(last), last, STRENGTH, times, *of) == (-1, times)


def test_of_equal_tets_the_smallest_id_is_named() -> None:
    stress = np.tile(np.diag([-3e9, -1e9, -1e9]), (4, 1, 1))
    assert hardest(chunks(stress), np.array([7, 3, 5, 9]), 4, STRENGTH, 0.0, 0, 1)[0] == 1


def test_a_plane_wave_and_a_bar_reach_the_criterion_at_the_warned_strength() -> None:
    """In a plane wave the value is griffith(), from which on ``conoid validate`` gives a warning; in a bar the
    criterion is 1 at 8 T.
    """
    k = 0.22 / 0.78
    wave = griffith(BRITTLE) * np.diag([-1.0, -k, -k])
    bar = 8.0 * STRENGTH * np.diag([-1.0, 0.0, 0.0])
    for stress in (wave, bar):
        assert hardest(chunks(stress[None]), np.arange(1), 1, STRENGTH, 0.0, 0, 1)[1] == pytest.approx(1.0)


@pytest.mark.parametrize(("stress", "times"), [
    ([1e9, 1e9, 1e9], 0.0), ([3e9, 1e9, 0.0], 0.0), ([-1e9, -1e9, -1e9], 0.0), ([5e9, -8e8, 0.0], 1e8 / STRENGTH),
])  # fmt: skip
def test_tension_and_equal_pressures_crush_nothing(stress: list[float], times: float) -> None:
    """Tension in another direction than the pressure has no effect, because the tensile law covers this tension."""
    assert hardest(chunks(np.diag(stress)[None]), np.arange(1), 1, STRENGTH, 0.0, 0, 1)[1] == pytest.approx(
        times, abs=1e-9
    )


MESH = block((5, 3, 3), 1e-3, seed=2)
WALL = schema.Wall(kind="wall", point=(0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))
CASE = scene(BRITTLE, end=2e-6, velocity=(-400.0, 0.0, 0.0), boundaries=(WALL,))
STEPS = 12


def met(sim: Simulation, steps: int = STEPS) -> list[Compressed]:
    """Returns the largest values of the criterion after the given number of steps."""
    if sim.clock.step == 0:
        step.prepare(sim)
    assert sim.crushing is not None
    for _ in range(steps):
        tick(sim)
        sim.crushing.count()
    return sim.crushing.found()


@pytest.fixture(scope="module")
def alone() -> Compressed:
    """Returns the result of one rank."""
    ((found,),) = on(1, CASE, [MESH], met)
    return found


def test_a_body_that_hits_a_wall_has_the_stress_of_the_wave(alone: Compressed) -> None:
    """In front of the wall the stress is density times wave speed times impact speed, 5.4 GPa; a coarse mesh
    overshoots.
    """
    wave = 2500.0 * 400.0 * (72e9 * 0.78 / (1.22 * 0.56) / 2500.0) ** 0.5
    assert 0.9 * wave < alone.most < 1.5 * wave
    assert alone.x < 2e-3
    assert 0.0 < alone.time < 1e-6
    assert alone.times > wave / griffith(BRITTLE) * 0.9
    assert 54 < alone.tets < 270
    (text,) = borne([alone])
    assert "body was compressed to" in text
    assert "strength.model = 'mohr_coulomb' or 'johnson_holmquist' can fail in compression" in text


@pytest.mark.parametrize("ranks", [2, 3])
def test_several_ranks_print_the_output_of_one_rank(ranks: int, alone: Compressed) -> None:
    assert on(ranks, CASE, [MESH], met) == [[alone]] * ranks


def test_a_resumed_run_restores_its_state(tmp_path: Path, alone: Compressed) -> None:
    """The restarted run also reports the largest value if this value occurred before the checkpoint."""

    def work(sim: Simulation) -> list[Compressed]:
        met(sim, STEPS)
        return met(kept_again(sim, CASE, tmp_path), 3)

    (found,) = on(1, CASE, [MESH], work)[0]
    assert found.times >= alone.times
    assert found.tets >= alone.tets


def test_crushing_is_not_measured_for_other_materials() -> None:
    assert Patch(MESH, GLASS).sim.crushing is None
    assert Patch(MESH, HARD).sim.crushing is None


def test_a_part_below_the_criterion_is_no_warning(alone: Compressed) -> None:
    (slow,) = on(1, scene(BRITTLE, velocity=(-4.0, 0.0, 0.0), boundaries=(WALL,)), [MESH], met)[0]
    assert slow.times < 1.0 < alone.times
    assert borne([slow]) == []
