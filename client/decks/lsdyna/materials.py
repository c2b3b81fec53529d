"""Materials and equations of state of LS-DYNA as those of Conoid (LS-DYNA Keyword User's Manual, volume II).

What the formulas there and here do not share is a remark of the keyword: docs/import.md has them side by side.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..draft import Made
from ..laws import hardening_of, line_of, shear_of, young_of
from ..units import DENSITY, RATE, SPECIFIC_HEAT, SPEED, STRESS, TEMPERATURE, System
from .fields import Fields

Curve = tuple[tuple[float, float], ...]


@dataclass
class Context:
    """What a material needs besides its own cards."""

    system: System
    eos: Fields | None = None
    curves: Mapping[int, Curve] = field(default_factory=dict)

    def stress(self, value: float) -> str | float:
        """With its unit."""
        return self.system.quantity(value, STRESS)


def translated(name: str, fields: Fields, context: Context) -> Made | None:
    """The material of a keyword; None, with the reason in its entry, for one that Conoid lacks. Raises CardError."""
    law = _LAWS.get(name)
    if law is None:
        fields.entry.refuse("Conoid has no such material law")
        return None
    fields.whole("MID")
    try:
        made = law(fields, context)
    except (ValueError, ZeroDivisionError) as error:
        fields.entry.refuse(f"its constants cannot be used: {error}")
        return None
    fields.rest("refused")
    return made


def weighed(name: str, fields: Fields) -> tuple[float, float | None]:
    """Density and Young's modulus of a material, in units of the deck; None where the deck does not say it."""
    density = fields.real("RO")
    if fields.real("E") > 0.0:
        return density, fields.real("E")
    shear = fields.real("G")
    if shear > 0.0 and fields.real("K1") > 0.0:
        return density, young_of(fields.real("K1"), shear)[0]
    return density, 2.6 * shear if shear > 0.0 else None


# Elasticity and pressure ----------------------------------------------------------------------------------------------


def _elastic(fields: Fields, context: Context) -> dict[str, Any]:
    """Density and elasticity of laws with E and PR."""
    young, poisson = fields.real("E"), fields.real("PR")
    density = context.system.quantity(fields.real("RO"), DENSITY)
    if context.eos is not None:
        return _with_eos(fields, context, shear_of(young, poisson))
    return {"density": density, "elastic": {"young": context.stress(young), "poisson": poisson}}


def _with_eos(fields: Fields, context: Context, shear: float) -> dict[str, Any]:
    """Density, elasticity and equation of state of laws that take the pressure from ``*EOS``."""
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
        eos.differ("C1", "p = C1 (V0/V - 1) there, C1 ln(V0/V) here: 1 % less at 2 % of compression, 5 % at 10 %")
    if eos.real("V0") == 1.0:
        eos.entry.remark("left", "V0 = 1", "the volume at the start is the reference")
    else:
        eos.refuse("V0", "matter starts compressed or stretched there, at rest here")
    eos.refuse("E0", "matter starts with heat there, without here")
    eos.rest("refused", "this term of the pressure has no key here")
    young, poisson = young_of(bulk, shear)
    return {**material, "elastic": {"young": context.stress(young), "poisson": poisson}}


# Erosion --------------------------------------------------------------------------------------------------------------


def erode(fields: Fields | None, made: Made) -> None:
    """``*MAT_ADD_EROSION``: criteria of strain; all others change the answer. Raises CardError."""
    if fields is None:
        return
    fields.whole("MID")
    fields.forgive("EXCL NUMFIP NCS", "how many points of an element fail")
    if "strength" not in made.material:
        fields.rest("refused", "its material is elastic here and has no plastic strain by which a tet could leave")
    elif fields.real("EFFEPS") > 0.0:
        made.erosion["plastic_strain"] = fields.real("EFFEPS")
        fields.differ("EFFEPS", "a strain of the whole deformation; erosion.plastic_strain is that of the plastic one")
    elif fields.real("MXEPS") > 0.0:
        made.erosion["plastic_strain"] = fields.real("MXEPS")
        fields.refuse("MXEPS", "the largest principal strain: equal to erosion.plastic_strain in simple tension alone")
    if "plastic_strain" in made.erosion:
        fields.entry.take("parts[].erosion")
    fields.rest("refused", "a criterion of failure that is not taken over")


# Laws -----------------------------------------------------------------------------------------------------------------


def _mat_elastic(fields: Fields, context: Context) -> Made:
    fields.forgive("DA DB", "damping of beams and shells")
    return Made(_elastic(fields, context))


def _linear(young: float, strength: tuple[float, float], context: Context) -> dict[str, Any]:
    law: dict[str, Any] = {"model": "linear_hardening", "yield_stress": context.stress(strength[0])}
    if strength[1] < 0.0:
        raise ValueError("the flow stress falls with the plastic strain; allowed here: one that rises or stays")
    if strength[1]:
        law["hardening"] = context.stress(strength[1])
    return law


def _no_rate(fields: Fields, names: str) -> None:
    fields.refuse(names, "the flow stress depends on the rate there, not here")


def _failing(strain: float) -> dict[str, Any]:
    return {"plastic_strain": strain} if 0.0 < strain < 1e10 else {}


def _mat_plastic_kinematic(fields: Fields, context: Context) -> Made:
    tangent, young = fields.real("ETAN"), fields.real("E")
    if tangent and fields.real("BETA") != 1.0:
        fields.refuse("BETA", "kinematic hardening in part; here it is isotropic, BETA = 1")
        if not fields.given("BETA") or fields.real("BETA") == 0.0:
            fields.entry.remark("refused", "BETA = 0", "kinematic hardening; here it is isotropic, BETA = 1")
    else:
        fields.real("BETA")
    _no_rate(fields, "SRC SRP")
    fields.forgive("VP", "how the rate counts, of a law without rate")
    law = _linear(young, (fields.real("SIGY"), hardening_of(young, tangent)), context)
    return Made({**_elastic(fields, context), "strength": law}, _failing(fields.real("FS")))


def _mat_piecewise(fields: Fields, context: Context) -> Made:
    _no_rate(fields, "C P LCSR")
    fields.forgive("VP", "how the rate counts, of a law without rate")
    fields.forgive("TDEL", "elements leave at a small step there; parts[].erosion.time_step does that here")
    failure = fields.real("FAIL")
    if failure < 0.0:
        fields.refuse("FAIL", "failure by a subroutine of the user")
    law = _linear(fields.real("E"), _hardening_curve(fields, context), context)
    return Made({**_elastic(fields, context), "strength": law}, _failing(failure))


def _hardening_curve(fields: Fields, context: Context) -> tuple[float, float]:
    """Yield stress and hardening of a curve, of eight points, or of a tangent modulus, in this order."""
    number = fields.whole("LCSS")
    if number:
        fields.forgive("SIGY ETAN", "of no meaning where LCSS is given")
        if number not in context.curves:
            raise ValueError(f"LCSS = {number} is no *DEFINE_CURVE of the deck; tables by rate are not taken over")
        return _straight(context.curves[number], f"the curve LCSS = {number}")
    strains = [fields.real(f"EPS{i}") for i in range(1, 9)]
    stresses = [fields.real(f"ES{i}") for i in range(1, 9)]
    last = max((i for i in range(8) if strains[i] or stresses[i]), default=-1)
    if last >= 1:
        fields.forgive("SIGY ETAN", "of no meaning where EPS1 and ES1 are given")
        return _straight(tuple(zip(strains, stresses, strict=True))[: last + 1], "the curve EPS1 to ES8")
    return fields.real("SIGY"), hardening_of(fields.real("E"), fields.real("ETAN"))


def _straight(curve: Curve, what: str) -> tuple[float, float]:
    found = line_of(curve)
    if found is None:
        raise ValueError(f"{what} of stress by plastic strain is no straight line from strain 0 on")
    return found


def _mat_hydro(fields: Fields, context: Context) -> Made:
    material = _with_eos(fields, context, fields.real("G"))
    fields.forgive("CHARL", "a length of elements that break there")
    _cut_off(fields, material, context, fields.real("PC"), "PC")
    law = _linear(0.0, (fields.real("SIGY"), fields.real("EH")), context)
    return Made({**material, "strength": law}, _failing(fields.real("FS")))


def _cut_off(fields: Fields, material: dict[str, Any], context: Context, pressure: float, name: str) -> None:
    if -1e10 < context.system.si(pressure, STRESS) * 1e-9 < 0.0:
        material["spall"] = context.stress(-pressure)
        fields.differ(name, "no pressure is below it; beyond it pores open here, which take up the work")


def _mat_power(fields: Fields, context: Context) -> Made:
    _no_rate(fields, "SRC SRP")
    fields.forgive("VP", "how the rate counts, of a law without rate")
    modulus, first = fields.real("K"), fields.real("SIGY")
    if fields.real("N") != 1.0 or first <= 0.0:
        raise ValueError("the law K (strain)^N is taken over with N = 1 and SIGY above 0 alone")
    strength = first if first > 0.02 else modulus * first
    law = _linear(fields.real("E"), (strength, modulus), context)
    return Made({**_elastic(fields, context), "strength": law}, _failing(fields.real("EPSF")))


def _johnson_cook(fields: Fields, context: Context) -> dict[str, Any]:
    """A, B, n, C and the reference rate, which both laws have."""
    rate = fields.real("EPSO")
    if rate <= 0.0:
        raise ValueError("EPSO, the reference rate, is not above 0")
    if rate == 1.0 and context.system.time != "s" and fields.real("C"):
        shown = context.system.quantity(rate, RATE)
        fields.differ("EPSO", f"taken as it stands: {shown}. Tables of constants mean 1/s: is it that here?")
    if fields.real("C") and fields.real("VP") == 0.0:
        fields.differ("VP", "the rate of the whole strain there, with VP = 0; here that of the plastic strain")
    return {
        "model": "johnson_cook", "A": context.stress(fields.real("A")), "B": context.stress(fields.real("B")),
        "n": fields.nonzero("N", 1.0), "C": fields.real("C"), "m": fields.nonzero("M", 1.0),
        "reference_rate": context.system.quantity(rate, RATE),
    }  # fmt: skip


def _mat_simplified(fields: Fields, context: Context) -> Made:
    for name in ("SIGMAX", "SIGSAT"):
        if fields.real(name) < 1e20:
            fields.refuse(name, "the flow stress ends there, not here")
    law = _johnson_cook(fields, context) | {
        "m": 1.0, "melt_temperature": "2000 K", "specific_heat": "1000 J/kg/K", "taylor_quinney": 0.0,
    }  # fmt: skip
    fields.entry.remark(
        "differs", "no heat", "the law there knows no temperature: no work becomes heat here (taylor_quinney = 0), so "
        "that melt_temperature and specific_heat have no meaning",
    )  # fmt: skip
    return Made({**_elastic(fields, context), "strength": law}, _failing(fields.real("PSFAIL")))


def _mat_johnson_cook(fields: Fields, context: Context) -> Made:
    shear = fields.real("G") or shear_of(fields.real("E"), fields.real("PR"))
    fields.forgive("E PR", "of shells; solids have G and the equation of state")
    fields.forgive("DTF", "elements leave at a small step there; parts[].erosion.time_step does that here")
    fields.forgive("IT NUMINT", "how shells are computed")
    material = _with_eos(fields, context, shear)
    law = _johnson_cook(fields, context)
    heat, room = fields.real("CP"), context.system.quantity(fields.real("TR"), TEMPERATURE)
    law["reference_temperature"] = room
    law["melt_temperature"] = context.system.quantity(fields.real("TM"), TEMPERATURE)
    if heat <= 0.0:
        raise ValueError("CP, the specific heat, is not above 0")
    law["specific_heat"] = context.system.quantity(heat, SPECIFIC_HEAT)
    law["taylor_quinney"] = 1.0
    fields.entry.remark(
        "differs", "taylor_quinney = 1", "the deck has no share of the plastic work that becomes heat: all of it does "
        "there; 0.9 is usual here",
    )  # fmt: skip
    _spall(fields, material, context)
    erosion = _damage(fields, law)
    return Made({**material, "strength": law}, erosion, temperature=room)


def _spall(fields: Fields, material: dict[str, Any], context: Context) -> None:
    kind = fields.nonzero("SPALL", 2.0)
    pressure = fields.real("PC")
    if pressure and kind != 1.0:
        fields.entry.remark(
            "refused", f"SPALL = {kind:g}", "matter that spalls is rubble without tension there; here the pressure is "
            "cut off at PC, as with SPALL = 1",
        )  # fmt: skip
    _cut_off(fields, material, context, -abs(pressure), "PC")


def _damage(fields: Fields, law: dict[str, Any]) -> dict[str, Any]:
    """``strength.damage``, and the erosion that goes with it; all of D1 to D5 at 0 mean no failure."""
    values = {f"D{i}": fields.real(f"D{i}") for i in range(1, 6)}
    stays = fields.real("EROD")
    if fields.real("EFMIN") > 1e-6:
        fields.refuse("EFMIN", "least strain of failure, 1e-6 here")
    if not any(values.values()):
        return {}
    law["damage"] = values
    if stays:
        fields.refuse("EROD", "what has failed stays without strength there; here it leaves, or keeps its strength")
        return {}
    return {"damage": 1.0}


def _mat_rigid(fields: Fields, context: Context) -> Made:
    fields.forgive("N COUPLE M ALIAS", "coupling with other programs")
    fields.forgive("LCO A2 A3 V1 V2 V3", "directions of local axes, of output and constraints")
    return Made(_elastic(fields, context), rigid=True)


def _mat_holmquist(fields: Fields, context: Context) -> Made:
    shear, bulk = fields.real("G"), fields.real("K1")
    young, poisson = young_of(bulk, shear)
    rate = fields.real("EPSI")
    if rate <= 0.0 and fields.real("C"):
        raise ValueError("EPSI, the reference rate, is not above 0")
    law: dict[str, Any] = {
        "model": "johnson_holmquist", "hel": context.stress(fields.real("HEL")),
        "pressure_hel": context.stress(fields.real("PHEL")), "tension": context.stress(abs(fields.real("T"))),
        "A": fields.real("A"), "N": fields.real("N"), "B": fields.real("B"), "M": fields.real("M"),
        "C": fields.real("C"), "D1": fields.real("D1"), "D2": fields.real("D2"),
        "K2": context.stress(fields.real("K2")), "K3": context.stress(fields.real("K3")), "beta": fields.real("BETA"),
    }  # fmt: skip
    if rate > 0.0:
        law["reference_rate"] = context.system.quantity(rate, RATE)
    if fields.real("T") < 0.0:
        fields.differ("T", "taken without its sign: it is a tension here")
    if 0.0 < fields.real("SFMAX") < 1e10:
        law["largest_fractured"] = fields.real("SFMAX")
    failure = fields.real("FS")
    if failure < 0.0:
        fields.refuse("FS", "elements leave by tension there (p* + T* below 0)")
    material: dict[str, Any] = {"density": context.system.quantity(fields.real("RO"), DENSITY)}
    material |= {"elastic": {"young": context.stress(young), "poisson": poisson}, "strength": law}
    return Made(material, _failing(failure))


_LAWS: dict[str, Callable[[Fields, Context], Made]] = {
    "MAT_ELASTIC": _mat_elastic, "MAT_PLASTIC_KINEMATIC": _mat_plastic_kinematic,
    "MAT_ELASTIC_PLASTIC_HYDRO": _mat_hydro, "MAT_JOHNSON_COOK": _mat_johnson_cook,
    "MAT_POWER_LAW_PLASTICITY": _mat_power, "MAT_RIGID": _mat_rigid,
    "MAT_PIECEWISE_LINEAR_PLASTICITY": _mat_piecewise, "MAT_SIMPLIFIED_JOHNSON_COOK": _mat_simplified,
    "MAT_JOHNSON_HOLMQUIST_CERAMICS": _mat_holmquist,
}  # fmt: skip
