"""Strength of facets and the delayed criterion. The strength depends on material, mesh and a hash of the facet id.

Eqs (2) to (4) of the paper: if the incident stress is strength * e^(t/t_c) / (e^(t/t_c) - 1), a facet is fully open at
the time t after its traction first reached the strength. The formula is derived for two half-spaces with a traction
that decreases linearly with the opening. If the fracture energy is the area under the traction, t_c = density * c *
energy / strength^2, which is twice the value printed in the paper.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from conoid.cases.model.bonds import SharedBond
from conoid.cases.model.materials import Brittle, Material, Scatter
from conoid.cases.model.schema import Fracture

from ..kernels.jit import njit
from ..materials.elementary import exp_less_one, log, power
from ..model.hashing import uniform
from ..model.state import Floats, Ints


@dataclass(frozen=True)
class Toughness:
    """Constants of a part that fractures, in SI units."""

    strength: float
    energy: float
    scatter: Scatter | None
    delay: float
    """Characteristic time t_c times the square of the strength, Pa^2 s; the characteristic time of a facet is this
    value divided by the square of its own strength."""
    zone: float
    """Length of the cohesive zone, m: 9 pi / 32 E' G_c / strength^2, with E' = E / (1 - nu^2), Young's modulus E,
    Poisson's ratio nu and the fracture energy G_c."""
    speed: float
    """Speed of plane waves, m/s."""
    density: float
    shear_energy: float | None = None
    """Fracture energy of a bond in shear, J/m^2; None if equal to ``energy``."""

    @property
    def impedance(self) -> float:
        """Impedance of plane waves, kg/m^2/s."""
        return self.density * self.speed

    @property
    def critical(self) -> float:
        """Opening at which the traction becomes zero, m."""
        return 2.0 * self.energy / self.strength

    def energies(self, share: Floats) -> Floats:
        """(m,) fracture energies, J/m^2; ``share`` (m,): fraction of shear in the square of the effective traction.

        If normal and shear opening grow in proportion, ``share`` is the fraction of the work that is done in shear.
        Facets break if w_n / energy + w_s / shear_energy = 1, with the work w_n of the normal traction and the work w_s
        of the shear traction (Wu and Reuter 1965, exponent 1; docs/theory/bonds.md, Bonds).
        """
        if self.shear_energy is None:
            return np.full(len(share), self.energy)
        return np.asarray(1.0 / ((1.0 - share) / self.energy + share / self.shear_energy))

    def strengths(self, face: Ints, area: Floats) -> Floats:
        """(n,) strengths, Pa, of facets with the ids ``face`` and the areas ``area``, m^2."""
        scatter = self.scatter
        if scatter is None:
            return np.full(len(face), self.strength)
        share = np.ones(len(face)) if scatter.area is None else scatter.area / area
        drawn = _weibull(uniform(face, scatter.seed), share, scatter.modulus)
        with np.errstate(over="ignore"):  # a shape parameter far below 1 gives infinite strengths
            return np.asarray(scatter.minimum + (self.strength - scatter.minimum) * drawn)


@njit("float64[::1](float64[::1], float64[::1], float64)", cache=True, error_model="numpy")
def _weibull(random, share, modulus):  # type: ignore[no-untyped-def]
    """(n,) Weibull variates of scale 1, made from ``random`` numbers in [0, 1). ``share``: reference area of the
    scatter divided by the area of each facet.
    """
    drawn = np.empty(len(random))
    for i in range(len(random)):
        drawn[i] = power(-log(1.0 - random[i]) * share[i], 1.0 / modulus)
    return drawn


@njit("float64(float64, float64, float64)", cache=True, error_model="numpy")
def required(strength, since, delay):  # type: ignore[no-untyped-def]
    """Returns the traction, Pa, that breaks a facet. ``since``: time since the facet first reached its strength, s;
    ``delay``: see records.Law.
    """
    if delay <= 0.0:
        return strength
    grown = exp_less_one(-since * strength * strength / delay)
    return strength / -grown if grown < 0.0 else np.inf


def toughness(material: Material, spec: Fracture, size: float) -> Toughness:
    """Returns the constants of a part whose tets have the mean edge ``size``, m."""
    brittle = material.brittle
    assert brittle is not None
    plane, strength = _plane(material), brittle.strength
    if spec.resolve == "strength":
        strength = min(strength, math.sqrt(_zone(plane, brittle.energy) / (spec.resolution * size)))
    speed = _speed(material)
    return Toughness(
        strength, brittle.energy, _scaled(brittle, strength), spec.delay * material.density * speed * brittle.energy,
        _zone(plane, brittle.energy) / strength**2, speed, material.density,
    )  # fmt: skip


UNBREAKABLE = Toughness(math.inf, 0.0, None, 0.0, math.inf, 1.0, 1.0)
"""Returns the constants of facets that never break."""


def of_bond(bond: SharedBond, materials: Sequence[Material]) -> Toughness:
    """Returns the constants of a bond between parts of two ``materials``. The length of the cohesive zone is that of
    the softer material.
    """
    (strength, _), (energy, shear_energy) = bond.strengths, bond.energies
    soft = min(materials, key=_plane)
    return Toughness(
        strength, energy, None, 0.0, _zone(_plane(soft), energy) / strength**2, _speed(soft), soft.density,
        shear_energy if shear_energy != energy else None,
    )  # fmt: skip


def terms(bond: SharedBond) -> Fracture:
    """Returns the fracture specification of the facets of a bond: no delay, the strengths in tension and shear, and the
    given energies.
    """
    normal, shear = bond.strengths
    model: Literal["cohesive", "instant"] = "cohesive" if bond.cohesive else "instant"
    return Fracture(model=model, shear_weight=(normal / shear) ** 2, delay=0.0)


def _plane(material: Material) -> float:
    """Returns the modulus of plane strain E / (1 - nu^2), Pa."""
    return material.elastic.young / (1.0 - material.elastic.poisson**2)


def _speed(material: Material) -> float:
    """Returns the speed of plane waves, m/s."""
    elastic = material.elastic
    lame = elastic.young * (1.0 - elastic.poisson) / ((1.0 + elastic.poisson) * (1.0 - 2.0 * elastic.poisson))
    return math.sqrt(lame / material.density)


def _zone(plane: float, energy: float) -> float:
    return 9.0 * math.pi / 32.0 * plane * energy


def _scaled(brittle: Brittle, strength: float) -> Scatter | None:
    """Returns the scatter of strengths for a strength that was lowered for the mesh."""
    if brittle.scatter is None:
        return None
    lowest = brittle.scatter.minimum * strength / brittle.strength
    return brittle.scatter.model_copy(update={"minimum": lowest})
