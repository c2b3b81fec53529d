"""Common properties of LS-DYNA materials: elasticity, pressure, linear hardening."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..laws import young_of
from ..units import DENSITY, SPEED, STRESS, System
from .fields import Fields

Curve = tuple[tuple[float, float], ...]


@dataclass
class Context:
    """Data of the deck that a material needs in addition to its own cards."""

    system: System
    eos: Fields | None = None
    curves: Mapping[int, Curve] = field(default_factory=dict)

    def stress(self, value: float) -> str | float:
        """Returns a number with its unit."""
        return self.system.quantity(value, STRESS)


def elastic(fields: Fields, context: Context) -> dict[str, Any]:
    """Returns density and elasticity of laws with E and PR."""
    young, poisson = fields.real("E"), fields.real("PR")
    density = context.system.quantity(fields.real("RO"), DENSITY)
    if context.eos is not None:
        context.eos.entry.leave("the law of its material takes the pressure from E and PR")
    return {"density": density, "elastic": {"young": context.stress(young), "poisson": poisson}}


def with_eos(fields: Fields, context: Context, shear: float) -> dict[str, Any]:
    """Returns density, elasticity and equation of state of laws with the pressure of ``*EOS``."""
    density, eos = fields.real("RO"), context.eos
    material: dict[str, Any] = {"density": context.system.quantity(density, DENSITY)}
    if eos is None:
        raise ValueError("*PART names no equation of state (EOSID), which this law needs for its pressure")
    eos.whole("EOSID")
    if eos.block.name.startswith(("EOS_GRUNEISEN", "EOS_004")):
        speed = eos.real("C")
        bulk = density * speed * speed
        material["eos"] = {
            "model": "mie_gruneisen", "c0": context.system.quantity(speed, SPEED), "S": eos.real("S1"),
            "gamma0": eos.real("GAMAO"),
        }  # fmt: skip
    else:
        bulk = eos.real("C1")
        if bulk <= 0.0:
            raise ValueError(f"C1 = {bulk:g} of its equation of state is not above 0")
        eos.differ("C1", "p = C1 (V0/V - 1) in LS-DYNA, C1 ln(V0/V) in Conoid: 1 % less at 2 % compression")
    if eos.real("V0") == 1.0:
        eos.entry.remark("left", "V0 = 1", "the volume at the start is the reference")
    else:
        eos.refuse("V0", "the material starts compressed or stretched in the deck, unstrained in Conoid")
    eos.refuse("E0", "the material starts with an internal energy in the deck, with none in Conoid")
    eos.rest("refused", "Conoid does not have this term of the pressure")
    young, poisson = young_of(bulk, shear)
    return {**material, "elastic": {"young": context.stress(young), "poisson": poisson}}


def cut_off(fields: Fields, material: dict[str, Any], context: Context, pressure: float, name: str) -> None:
    """Returns ``spall`` of a cut-off of the pressure below 0; none for one that cannot be reached."""
    if -1e10 < context.system.si(pressure, STRESS) * 1e-9 < 0.0:
        material["spall"] = context.stress(-pressure)
        fields.differ(name, "the pressure is cut off; in Conoid pores open at this value and absorb the work")


def linear(young: float, strength: tuple[float, float], context: Context) -> dict[str, Any]:
    """Returns ``strength`` of a yield stress and a hardening. Raises ValueError for softening."""
    law: dict[str, Any] = {"model": "linear_hardening", "yield_stress": context.stress(strength[0])}
    if strength[1] < 0.0:
        raise ValueError("the flow stress falls with the plastic strain; allowed: one that rises or is constant")
    if strength[1]:
        law["hardening"] = context.stress(strength[1])
    return law


def failing(strain: float) -> dict[str, Any]:
    """Returns ``erosion`` of a plastic strain; none for 0 and for one that cannot be reached."""
    return {"plastic_strain": strain} if 0.0 < strain < 1e10 else {}
