"""Every strength law and equation of state: in the case, in the registry, and in the kernel that calls the law of a
block."""

from typing import get_args

import numpy as np
import pytest

from conoid.cases.laws.law import Law as Constants
from conoid.cases.model.materials import Material, MieGruneisen, Strength
from conoid.cases.reading.library import library
from conoid.worker.elements import scratch
from conoid.worker.materials import law, models
from conoid.worker.model import rows, state

from .kernels import COPPER, COPPER_GAS, GLASS, MILD_STEEL, STEEL, STEEL_42CRMO4

MATERIALS = [STEEL, COPPER, COPPER_GAS, STEEL_42CRMO4, GLASS, MILD_STEEL, *library().values()]
SCHEMAS: tuple[type[Constants], ...] = get_args(get_args(Strength)[0])
N = 300


def named(model: str) -> Material:
    """Returns a material with the given law."""
    return next(m for m in MATERIALS if ("" if m.strength is None else m.strength.model) == model)


def chunk(made: Material, seed: int) -> tuple["np.ndarray", "np.ndarray", "np.ndarray"]:
    """Returns scratch, state and constants of tets under large trial stresses, which every law changes."""
    random = np.random.default_rng(seed)
    w = random.uniform(0.5, 1.0, scratch.SCRATCH)
    s = np.zeros((models.rows_of(made, "nodal"), state.CHUNK))
    for row, value in models.beginning(made, 300.0).items():
        s[row : row + 1] = value
    s[: rows.S_XY + 1] = random.uniform(-0.1, 0.1, (6, state.CHUNK)) * made.elastic.young
    s[rows.MASS], s[rows.PRESSURE] = made.density, 0.01 * made.elastic.young
    return w, s.reshape(-1), models.parameters(made, None)


@pytest.mark.parametrize("number", range(len(models.LAWS)))
def test_the_kernel_of_a_law_is_the_one_that_is_called(number: int) -> None:
    """Without a branch for the law in ``strengthen`` the chunk would not change."""
    (w, s, params), (w1, s1, _), (_, before, _) = (chunk(named(models.LAWS[number].model), number) for _ in range(3))
    models.strengthen(number, w, s, params, N, 1e-8)
    models.LAWS[number].kernel(w1, s1, params, N, 1e-8)
    assert np.array_equal(s, s1)
    assert np.array_equal(w, w1)
    assert not np.array_equal(s, before)


@pytest.mark.parametrize("number", range(len(models.EQUATIONS)))
def test_the_kernel_of_an_equation_is_the_one_that_is_called(number: int) -> None:
    made = next(m for m in MATERIALS if models.eos_of(m) == number)
    (w, s, params), (w1, s1, _), (_, before, _) = (chunk(made, number) for _ in range(3))
    models.swell(number, w, s, params, N)
    models.press(number, w, s, params, N)
    models.EQUATIONS[number].volume(w1, s1, params, N)
    models.EQUATIONS[number].kernel(w1, s1, params, N)
    assert np.array_equal(s, s1)
    assert np.array_equal(w, w1)
    assert not np.array_equal(s, before)


def test_every_law_of_the_case_has_one_of_the_same_name_in_the_worker() -> None:
    names = [get_args(schema.model_fields["model"].annotation)[0] for schema in SCHEMAS]
    assert ["", *names] == [each.model for each in models.LAWS]
    assert [each.model for each in models.EQUATIONS][:2] == [
        "",
        get_args(MieGruneisen.model_fields["model"].annotation)[0],
    ]


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda s: s.__name__)
def test_a_law_gives_its_cost_and_its_strength(schema: type[Constants]) -> None:
    made = named(get_args(schema.model_fields["model"].annotation)[0]).strength
    assert made is not None
    assert schema.nanoseconds > 0.0
    assert 1e6 < made.flow_stress() < 1e11
    assert list(made.problems()) == []


def test_a_vector_of_constants_has_room_for_every_law() -> None:
    for made in MATERIALS:
        params = models.parameters(made, None)
        assert params.shape == (law.SIZE,)
        assert params[law.DENSITY] == made.density


def test_a_law_of_the_case_counts_damage_where_its_tets_have_a_row_for_it() -> None:
    counting = [made.strength is not None and made.strength.counts_damage for made in MATERIALS]
    assert counting == [models.law_of(made).rows(made.strength) > rows.DAMAGE for made in MATERIALS]
    assert 0 < sum(counting) < len(MATERIALS)
