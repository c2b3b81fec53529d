"""Johnson and Cook's damage: the strain to fracture of a tet is that of the formula; erosion takes what is done for."""

import math

import numpy as np
import pytest

from conoid.cases.materials import Elastic, JohnsonCook, JohnsonCookDamage, Material
from conoid.cases.schema import Erosion
from conoid.worker.elements import wear
from conoid.worker.mesh.model import TetMesh
from conoid.worker.state import DAMAGE, PLASTIC_STRAIN, PRESSURE

from .kernels import Patch
from .meshes import REGULAR

DAMAGED = JohnsonCookDamage(D1=0.05, D2=3.44, D3=-2.12, D4=0.002, D5=0.61)
LAW = JohnsonCook(
    model="johnson_cook", A=800e6, B=0.0, n=0.3, C=0.0, m=20.0, melt_temperature=1793.15, specific_heat=477.0,
    taylor_quinney=0.0, damage=DAMAGED,
)  # fmt: skip
STEEL = Material(density=7830.0, elastic=Elastic(young=205e9, poisson=0.29), strength=LAW)
"""It does not harden and does not warm up: all that the fracture strain depends on stays."""
RATE, DT, TEMPERATURE = 2e4, 1e-8, 600.0


def fracture_strain(tension: float, rate: float) -> float:
    """(D1 + D2 e^(D3 t)) (1 + D4 ln rate) (1 + D5 T*)."""
    hot = (TEMPERATURE - LAW.reference_temperature) / (LAW.melt_temperature - LAW.reference_temperature)
    shape = DAMAGED.D1 + DAMAGED.D2 * math.exp(DAMAGED.D3 * min(tension, 1.5))
    return shape * (1.0 + DAMAGED.D4 * math.log(rate)) * (1.0 + DAMAGED.D5 * hot)


def sheared(tension: float, steps: int) -> Patch:
    """A tet that flows at a constant rate, in pure shear, under a mean stress of ``tension`` times its strength."""
    point = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), STEEL, temperature=TEMPERATURE)
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
    """In tension, in shear, under pressure, and where the tension is cut."""
    one, two = sheared(tension, 60), sheared(tension, 80)
    strain = two.get(PLASTIC_STRAIN)[0] - one.get(PLASTIC_STRAIN)[0]
    grown = two.get(DAMAGE)[0] - one.get(DAMAGE)[0]
    rate = strain / (20 * DT)
    assert rate == pytest.approx(RATE, rel=1e-5)
    assert strain / grown == pytest.approx(fracture_strain(tension, rate), rel=1e-6)


def test_damage_ends_at_one_and_takes_no_strength() -> None:
    point = sheared(1.4, 2500)
    assert point.get(DAMAGE)[0] == 1.0
    assert point.get(PLASTIC_STRAIN)[0] > fracture_strain(1.4, RATE)


def test_a_part_without_damage_carries_no_row_of_it() -> None:
    plain = STEEL.model_copy(update={"strength": LAW.model_copy(update={"damage": None})})
    mesh = TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32))
    assert not Patch(mesh, plain).block.has(DAMAGE)
    assert Patch(mesh, STEEL).block.has(DAMAGE)


def test_erosion_knows_a_limit_of_damage() -> None:
    assert wear.life(Erosion(damage=1.0))[wear.DAMAGED] == 1.0
    assert wear.life(Erosion())[wear.DAMAGED] == math.inf
