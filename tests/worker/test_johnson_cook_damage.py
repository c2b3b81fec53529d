"""Damage of Johnson and Cook: the fracture strain of a tet is that of the formula, and erosion removes fully damaged
tets."""

import math

import numpy as np
import pytest

from conoid.cases.model.materials import Elastic, JohnsonCook, JohnsonCookDamage, Material
from conoid.cases.model.schema import Erosion
from conoid.cases.reading.library import library
from conoid.worker.elements import wear
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import DAMAGE, FLOW, PLASTIC_STRAIN, PRESSURE
from conoid.worker.model.rows import TEMPERATURE as HEAT

from . import formulas
from .kernels import Patch
from .meshes import REGULAR

DAMAGED = JohnsonCookDamage(D1=0.05, D2=3.44, D3=-2.12, D4=0.002, D5=0.61)
LAW = JohnsonCook(
    model="johnson_cook", A=800e6, B=0.0, n=0.3, C=0.0, m=20.0, melt_temperature=1793.15, specific_heat=477.0,
    taylor_quinney=0.0, damage=DAMAGED,
)  # fmt: skip
STEEL = Material(density=7830.0, elastic=Elastic(young=205e9, poisson=0.29), strength=LAW)
"""A steel without hardening and heating, for which all arguments of the fracture strain are constant."""
RATE, DT, TEMPERATURE = 2e4, 1e-8, 600.0


def fracture_strain(tension: float, rate: float) -> float:
    """Returns (D1 + D2 e^(D3 t)) (1 + D4 ln rate) (1 + D5 T*)."""
    hot = (TEMPERATURE - LAW.reference_temperature) / (LAW.melt_temperature - LAW.reference_temperature)
    shape = DAMAGED.D1 + DAMAGED.D2 * math.exp(DAMAGED.D3 * min(tension, 1.5))
    return shape * (1.0 + DAMAGED.D4 * math.log(rate)) * (1.0 + DAMAGED.D5 * hot)


def sheared(tension: float, steps: int, material: Material = STEEL) -> Patch:
    """Returns a tet that flows at a constant rate in pure shear, under a mean stress of ``tension`` times its
    strength."""
    point = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), material, temperature=TEMPERATURE)
    hot = (TEMPERATURE - LAW.reference_temperature) / (LAW.melt_temperature - LAW.reference_temperature)
    point.put(PRESSURE, -tension * LAW.A * (1.0 - hot**LAW.m))
    L = np.zeros((3, 3))
    L[0, 1] = L[1, 0] = 0.5 * math.sqrt(3.0) * RATE
    point.strain(L, DT)
    for _ in range(steps):
        point.advance(DT)
    return point


@pytest.mark.parametrize("tension", [1.0 / 3.0, 0.0, -1.0 / 3.0, 1.4, 3.0, -5.0])
def test_the_fracture_strain_is_that_of_the_formula(tension: float) -> None:
    """The fracture strain is checked in tension, in shear, under pressure, and at the upper limit of the tension
    ratio."""
    one, two = sheared(tension, 60), sheared(tension, 80)
    strain = two.get(PLASTIC_STRAIN)[0] - one.get(PLASTIC_STRAIN)[0]
    grown = two.get(DAMAGE)[0] - one.get(DAMAGE)[0]
    rate = strain / (20 * DT)
    assert rate == pytest.approx(RATE, rel=1e-5)
    assert strain / grown == pytest.approx(fracture_strain(tension, rate), rel=1e-6)


def test_damage_ends_at_one_and_takes_no_strength_by_default() -> None:
    point = sheared(1.4, 2500)
    assert point.get(DAMAGE)[0] == 1.0
    assert point.get(PLASTIC_STRAIN)[0] > fracture_strain(1.4, RATE)


def softened(softening: float, **keys: float) -> Material:
    """Returns the steel with ``softening`` and other constants of its strength."""
    damage = DAMAGED.model_copy(update={"softening": softening})
    return STEEL.model_copy(update={"strength": LAW.model_copy(update={"damage": damage, **keys})})


def test_damage_takes_its_share_of_the_flow_stress() -> None:
    """A metal without hardening has the flow stress A (1 - T*^m) (1 - s D), with the damage D at the beginning of
    the step."""
    before, after = (sheared(1.4, steps, softened(0.3)) for steps in (600, 601))
    damage = before.get(DAMAGE)[0]
    hot = (TEMPERATURE - LAW.reference_temperature) / (LAW.melt_temperature - LAW.reference_temperature)
    expected = LAW.A * (1.0 - hot**LAW.m) * (1.0 - 0.3 * damage)
    assert 0.3 < damage < 0.9
    assert formulas.mises(after.deviator)[0] == pytest.approx(expected, rel=1e-9)
    assert after.get(FLOW)[0] == pytest.approx(expected, rel=1e-9)


def test_a_metal_that_hardens_heats_and_softens_follows_an_integration_of_its_law() -> None:
    """The reference value is the integral of (A + B e^n)(1 + C ln rate)(1 - T*^m)(1 - s D) over the strain, with 20,000
    midpoints."""
    constants = {"B": 600e6, "C": 0.01, "m": 1.0, "taylor_quinney": 0.9}
    law = LAW.model_copy(update=constants)
    point = sheared(0.0, 3000, softened(0.3, **constants))
    strain, temperature, damage, d = 0.0, TEMPERATURE, 0.0, point.get(PLASTIC_STRAIN)[0] / 20_000
    tension = point.get(PRESSURE)[0]
    assert tension == 0.0
    for _ in range(20_000):
        hot = (temperature - law.reference_temperature) / (law.melt_temperature - law.reference_temperature)
        rate = 1.0 + law.C * math.log(RATE)
        flow = (law.A + law.B * (strain + 0.5 * d) ** law.n) * rate * (1.0 - hot) * (1.0 - 0.3 * damage)
        damage += d / ((DAMAGED.D1 + DAMAGED.D2) * (1.0 + DAMAGED.D4 * math.log(RATE)) * (1.0 + DAMAGED.D5 * hot))
        temperature += 0.9 * flow * d / (STEEL.density * law.specific_heat)
        strain += d
    assert point.get(DAMAGE)[0] == pytest.approx(damage, rel=1e-3)
    assert point.get(HEAT)[0] == pytest.approx(temperature, rel=1e-3)
    assert point.get(FLOW)[0] == pytest.approx(flow, rel=1e-3)


def fast_shear(softening: float) -> tuple[float, float]:
    """Returns two plastic strains of weldox_460e in shear at RATE without pressure, by numerical integration: the
    strain at which the adiabatic flow stress is largest, and the strain at which the steel breaks.
    """
    metal = library()["weldox_460e"]
    law = metal.strength
    assert isinstance(law, JohnsonCook)
    assert law.damage is not None
    fast = math.log(RATE / law.reference_rate)
    fracture = (law.damage.D1 + law.damage.D2) * (1.0 + law.damage.D4 * fast)
    strains = np.arange(0.0, 2.5, 1e-3)
    temperature, flow = law.reference_temperature, np.zeros(len(strains))
    for i, strain in enumerate(strains):
        hot = (temperature - law.reference_temperature) / (law.melt_temperature - law.reference_temperature)
        static = (law.A + law.B * strain**law.n) * (1.0 + law.C * fast) * (1.0 - hot**law.m)
        flow[i] = static * (1.0 - softening * strain / fracture)
        temperature += law.taylor_quinney * flow[i] * 1e-3 / (metal.density * law.specific_heat)
    return float(strains[flow.argmax()]), fracture


def test_weldox_loses_strength_before_it_breaks_in_fast_shear_by_its_damage_alone() -> None:
    """A shear band does not become narrower while the flow stress rises: without softening no localisation occurs."""
    (plain, fracture), (softer, _) = fast_shear(0.0), fast_shear(0.3)
    print(f"largest flow stress at {plain:.2f}, with softening at {softer:.2f}; fracture at {fracture:.2f}")
    assert plain > 1.1 * fracture
    assert softer < 0.75 * fracture


def test_a_part_without_damage_carries_no_row_of_it() -> None:
    plain = STEEL.model_copy(update={"strength": LAW.model_copy(update={"damage": None})})
    mesh = TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32))
    assert not Patch(mesh, plain).block.has(DAMAGE)
    assert Patch(mesh, STEEL).block.has(DAMAGE)


def test_erosion_has_a_limit_of_damage() -> None:
    assert wear.life(Erosion(damage=1.0))[wear.DAMAGED] == 1.0
    assert wear.life(Erosion())[wear.DAMAGED] == math.inf
