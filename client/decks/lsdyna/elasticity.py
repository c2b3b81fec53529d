"""Properties that many LS-DYNA materials have: elasticity, pressure, linear hardening."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..laws import young_of
from ..units import DENSITY, SPEED, STRESS, System
from .fields import Fields

Curve = tuple[tuple[float, float], ...]


@dataclass
class Context:
    """Data of the deck that the conversion of a material needs in addition to the material's own cards."""

    system: System
    eos: Fields | None = None
    curves: Mapping[int, Curve] = field(default_factory=dict)

    def stress(self, value: float) -> str | float:
        """Returns a stress of the deck with its unit."""
        return self.system.quantity(value, STRESS)


def elastic(fields: Fields, context: Context) -> dict[str, Any]:
    """Returns density and elastic constants of materials with the fields E and PR."""
    young, poisson = fields.real("E"), fields.real("PR")
    density = context.system.quantity(fields.real("RO"), DENSITY)
    if context.eos is not None:
        context.eos.entry.leave("the law of the material computes the pressure from E and PR")
    return {"density": density, "elastic": {"young": context.stress(young), "poisson": poisson}}


def with_eos(fields: Fields, context: Context, shear: float) -> dict[str, Any]:
    """Returns density, elastic constants and equation of state of materials whose pressure is computed by ``*EOS``."""
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
            raise ValueError(f"C1 = {bulk:g} of the equation of state is not above 0")
        eos.differ(
            "C1",
            "p = C1 (V0/V - 1) in LS-DYNA, C1 ln(V0/V) in Conoid: Conoid's pressure is 1 % lower at 2 % compression",
        )
    if eos.real("V0") == 1.0:
        eos.entry.remark("left", "V0 = 1", "in Conoid the volume at the start is the reference volume")
    else:
        eos.refuse("V0", "in the deck the material starts compressed or stretched, in Conoid without strain")
    eos.refuse("E0", "in the deck the material starts with internal energy, in Conoid without")
    eos.rest("refused", "Conoid does not have this term of the pressure")
    young, poisson = young_of(bulk, shear)
    return {**material, "elastic": {"young": context.stress(young), "poisson": poisson}}


def cut_off(fields: Fields, material: dict[str, Any], context: Context, pressure: float, name: str) -> None:
    """Adds the key ``spall`` to a material, from a cut-off of the pressure below 0. The key is not added if the
    pressure cannot reach the cut-off.
    """
    if -1e10 < context.system.si(pressure, STRESS) * 1e-9 < 0.0:
        material["spall"] = context.stress(-pressure)
        fields.differ(name, "the pressure is cut off; in Conoid pores open at this value and absorb the work")


def linear(young: float, strength: tuple[float, float], context: Context) -> dict[str, Any]:
    """Returns the table ``strength`` from a yield stress and a hardening modulus. Raises ValueError if the hardening
    is negative.
    """
    law: dict[str, Any] = {"model": "linear_hardening", "yield_stress": context.stress(strength[0])}
    if strength[1] < 0.0:
        raise ValueError("the flow stress falls with the plastic strain; allowed: a rising or constant flow stress")
    if strength[1]:
        law["hardening"] = context.stress(strength[1])
    return law


def failing(strain: float) -> dict[str, Any]:
    """Returns the table ``erosion`` from a failure strain. Returns no table if the strain is 0 or too large to be
    reached.
    """
    return {"plastic_strain": strain} if 0.0 < strain < 1e10 else {}
