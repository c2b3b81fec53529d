"""Energy that a term of the energy balance creates: the checked terms, the reference energy, and rounding."""

import math
import re

import pytest

from conoid.cases.messages import Energy
from conoid.worker.accounts.making import LASTING, RETURNED, WARNED, Making
from conoid.worker.errors import EnergyError

from .kernels import COPPER, build, scene
from .meshes import block


def lines(**values: float) -> Energy:
    """Returns an energy balance with the given terms, J; the other terms are 0."""
    return Energy(**({"kinetic": 0.0, "elastic": 0.0, "plastic": 0.0, "viscous": 0.0, "contact": 0.0, "external": 0.0,
                      "initial": 1.0, "residual": 0.0} | values))  # fmt: skip


@pytest.mark.parametrize("name", LASTING)
def test_what_takes_for_good_may_not_fall(name: str) -> None:
    making = Making(0.0)
    making.look(lines(**{name: 0.5}), 1.0, 1e-6)
    making.look(lines(**{name: 0.45}), 1.0, 2e-6)
    making.look(lines(**{name: 0.7}), 1.0, 3e-6)
    (found,) = making.worst.values()
    assert list(making.worst) == [name]
    assert found.share == pytest.approx(0.05)
    assert found.t == 2e-6


@pytest.mark.parametrize("name", RETURNED)
def test_a_ledger_line_returns_no_more_than_it_has(name: str) -> None:
    making = Making(0.0)
    making.look(lines(**{name: 0.5}), 1.0, 1e-6)
    making.look(lines(**{name: 0.0}), 1.0, 2e-6)
    assert making.worst == {}
    making.look(lines(**{name: -0.03}), 1.0, 3e-6)
    with pytest.raises(
        EnergyError, match=re.escape(f"the term {name} of the energy ledger has created 0.03 of the largest")
    ):
        making.require(0.02, 0.9, "at step 3")
    making.require(0.04, 0.9, "at step 3")


def test_hot_matter_that_erodes_may_have_given_its_heat() -> None:
    making = Making(0.0)
    making.look(lines(eroded=-0.05), 1.0, 1e-6, heat=0.06)
    assert making.worst == {}
    making.look(lines(eroded=-0.09), 1.0, 2e-6, heat=0.06)
    assert making.worst["eroded"].share == pytest.approx(0.03)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_unequal_steps_count_either_way_and_their_cure_is_derived(sign: float) -> None:
    """The created energy is of second order in the step: with the named safety factor half of WARNED remains."""
    making = Making(0.0)
    making.look(lines(stepping=sign * 0.04), 1.0, 1e-6)
    (text,) = making.warnings(0.9)
    named = float(text.partition("numerics.dt_safety = ")[2].split()[0])
    assert 0.04 * (named / 0.9) ** 2 == pytest.approx(0.5 * WARNED, rel=0.05)


def test_the_share_is_of_the_largest_energy_so_far() -> None:
    making = Making(0.0)
    making.look(lines(), 10.0, 1e-6)
    making.look(lines(averaging=-0.1), 2.0, 2e-6)
    assert making.worst["averaging"].share == pytest.approx(0.01)


def test_rounding_is_not_judged_and_what_is_not_a_number_is_left_to_the_residual() -> None:
    making = Making(1e-12)
    making.look(lines(contact=-1e-13, stepping=1e-13), 1e-12, 1e-6)
    making.look(lines(contact=math.nan), 1.0, 2e-6)
    assert making.worst == {}


def test_a_resumed_run_restores_the_energy_that_was_made() -> None:
    making, other = Making(0.0), Making(0.0)
    making.look(lines(plastic=0.5, averaging=-0.01), 2.0, 1e-6)
    other.resume(making.keep())
    for each in (making, other):
        each.look(lines(plastic=0.4), 1.0, 2e-6)
    assert other.worst == making.worst
    (name, made), *_ = other.ranked()
    assert (name, made.t) == ("plastic", 2e-6)
    assert made.share == pytest.approx(0.05)


def test_rounding_is_the_energy_of_a_strain_that_positions_hardly_have() -> None:
    """The limit for the check is K / 2 times the square of the strain over the whole volume: 27 mm^3 of copper."""
    sim = build(scene(COPPER), [block((3, 3, 3), 1e-3)])
    assert sim.ledger.making._rounding == pytest.approx(0.5 * 117e9 / 0.9 * 1e-20 * 27e-9, rel=1e-9)
