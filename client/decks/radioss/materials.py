"""Conversion of materials, equations of state and failure of Radioss to Conoid (Reference Guide, "Material laws").

Where the formulas of Radioss and Conoid differ, the account of the import has a note; docs/howto/import.md compares
the formulas.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..draft import Made
from ..laws import shear_of, young_of
from ..units import DENSITY, RATE, SPECIFIC_HEAT, SPEED, STRESS, TEMPERATURE, System
from .text import Fields

NAMES = {"ELAST": "LAW1", "PLAS_JOHNS": "LAW2", "HYD_JCOOK": "LAW4", "JOHN_HOLM": "LAW79"}
"""Numbers of material laws (LAW1, ...) by their names in the guide."""

LAYOUTS: dict[str, tuple[str, ...]] = {
    "LAW1": ("RHO_I RHO_0", "E NU"),
    "LAW2": (
        "RHO_I RHO_0", "E NU IFLAG:", "A B N EPS_MAX SIG_MAX", "C EPS_DOT_0 ICC: FSMOOTH: FCUT CHARD",
        "M TMELT RHOCP TR",
    ),
    "LAW4": (
        "RHO_I RHO_0", "E NU", "A B N EPS_MAX SIG_MAX", "PMIN", "C EPS_DOT_0 M TMELT TMAX", "RHOCP - - TR",
    ),
    "LAW79": (
        "RHO_I RHO_0", "G", "A B M N", "C EPS_DOT_0 SIG_FMAX FCUT", "T HEL PHEL", "D1 D2 -: IDEL: EPSMAX",
        "K1 K2 K3 BETA",
    ),
    "GRUNEISEN": ("C S1 S2 S3", "GAMMA0 ALPHA E0 RHO_0"),
    "JOHNSON": ("D1 D2 D3 D4 D5", "EPS_DOT_0 IFAIL_SH: IFAIL_SO: - DADV -: IXFEM:"),
}  # fmt: skip
"""Names of the fields on the lines after the title of an option, as in the guide."""


@dataclass
class Context:
    """Data of the deck that the conversion of a material needs in addition to the material's own lines."""

    system: System
    eos: Fields | None = None
    failure: Fields | None = None

    def stress(self, value: float) -> str | float:
        """Returns a stress of the deck with its unit."""
        return self.system.quantity(value, STRESS)


def translated(law: str, fields: Fields, context: Context) -> Made | None:
    """Returns the material of an option. Returns None, and writes the reason into the entry, if Conoid lacks the
    material law. Raises CardError.
    """
    make = _LAWS.get(law)
    if make is None:
        fields.entry.refuse("Conoid has no such material law")
        return None
    try:
        made = make(fields, context)
    except (ValueError, ZeroDivisionError) as error:
        fields.entry.refuse(f"the constants of the material cannot be used: {error}")
        return None
    if fields.real("RHO_0") not in (0.0, fields.real("RHO_I")):
        fields.refuse("RHO_0", "in the deck the material starts compressed or stretched, in Conoid without strain")
    fields.rest()
    return made


def _elastic(fields: Fields, context: Context, law: str) -> dict[str, Any]:
    """Returns density, elastic constants, and the equation of state if the deck has one."""
    density, young, poisson = fields.real("RHO_I"), fields.real("E"), fields.real("NU")
    material: dict[str, Any] = {"density": context.system.quantity(density, DENSITY)}
    if context.eos is not None and law != "LAW4":
        context.eos.entry.refuse(f"{law} computes the pressure from E and NU; use LAW4 with an equation of state")
    elif context.eos is not None:
        shear = shear_of(young, poisson)
        speed = context.eos.real("C")
        young, poisson = young_of(density * speed * speed, shear)
    material["elastic"] = {"young": context.stress(young), "poisson": poisson}
    return material | (_equation(context) if law == "LAW4" else {})


def _equation(context: Context) -> dict[str, Any]:
    eos = context.eos
    if eos is None:
        return {}
    eos.refuse("S2 S3 ALPHA E0", "Conoid does not have this term of the pressure")
    eos.forgive("RHO_0", "the density of the material")
    law = {
        "model": "mie_gruneisen", "c0": context.system.quantity(eos.real("C"), SPEED), "S": eos.real("S1"),
        "gamma0": eos.real("GAMMA0"),
    }  # fmt: skip
    eos.rest()
    return {"eos": law}


def _law1(fields: Fields, context: Context) -> Made:
    return Made(_elastic(fields, context, "LAW1"))


def _law2(fields: Fields, context: Context) -> Made:
    if fields.whole("IFLAG"):
        raise ValueError("IFLAG = 1: give A, B and N instead of yield and ultimate stress")
    fields.refuse("CHARD", "partly kinematic hardening; Conoid has only isotropic hardening")
    fields.forgive("ICC FSMOOTH FCUT", "setting of the filter of the strain rate")
    return _plastic(fields, context, 298.0, "LAW2")


def _law4(fields: Fields, context: Context) -> Made:
    fields.forgive("TMAX", "temperature above which the flow stress is constant") if fields.real(
        "TMAX"
    ) >= 1e9 else None
    if context.eos is None:
        fields.entry.remark(
            "differs",
            "no /EOS",
            "p = K (V0/V - 1) in Radioss, K ln(V0/V) in Conoid: Conoid's pressure is 1 % lower at 2 % compression",
        )
    made = _plastic(fields, context, 300.0, "LAW4")
    pressure = fields.real("PMIN")
    if -1e20 < pressure < 0.0:
        made.material["spall"] = context.stress(-pressure)
        fields.differ("PMIN", "the pressure is cut off; in Conoid pores open at this value and absorb the work")
    return made


def _plastic(fields: Fields, context: Context, room: float, kind: str) -> Made:
    """Reads the Johnson-Cook law. The result is linear hardening if the law has neither rate nor heat and n is 1."""
    if 0.0 < fields.real("SIG_MAX") < 1e20:
        fields.refuse("SIG_MAX", "Conoid has no limit of the flow stress")
    material = _elastic(fields, context, kind)
    A, B, n, C = (fields.real("A"), fields.real("B"), fields.nonzero("N", 1.0), fields.real("C"))
    heats = fields.real("M") > 0.0 and fields.real("RHOCP") > 0.0
    if n == 1.0 and C == 0.0 and not heats and context.failure is None:
        law: dict[str, Any] = {"model": "linear_hardening", "yield_stress": context.stress(A)}
        if B:
            law["hardening"] = context.stress(B)
        fields.forgive("M TMELT TR EPS_DOT_0", "no effect without strain rate and heat")
        return Made({**material, "strength": law}, _limit(fields))
    law = {"model": "johnson_cook", "A": context.stress(A), "B": context.stress(B), "n": n, "C": C}
    law |= _rate(fields, context) | _heat(fields, context, heats, room)
    erosion = _limit(fields) | _damage(law, context)
    return Made({**material, "strength": law}, erosion, temperature=law["reference_temperature"])


def _rate(fields: Fields, context: Context) -> dict[str, Any]:
    rate = fields.real("EPS_DOT_0")
    if rate <= 0.0 and fields.real("C"):
        raise ValueError("EPS_DOT_0, the reference rate, is not above 0")
    if not fields.real("C"):
        return {}
    fields.differ("C", "Radioss uses the rate of the total strain, Conoid the rate of the plastic strain")
    return {"reference_rate": context.system.quantity(rate, RATE)}


def _heat(fields: Fields, context: Context, heats: bool, room: float) -> dict[str, Any]:
    """Reads thermal softening. Plastic work does not heat the material if the heat capacity or the exponent is 0."""
    cold = context.system.quantity(fields.nonzero("TR", room), TEMPERATURE)
    if not fields.real("TR") and heats:
        fields.differ("TR", f"not given; {room:g} K, the default of Radioss, is used")
    if not heats:
        fields.forgive("M TMELT RHOCP", "no effect without both M and RHOCP")
        fields.entry.remark(
            "differs",
            "no heat",
            "no plastic work becomes heat (taylor_quinney = 0); melt_temperature and specific_heat have no effect",
        )
        return {"m": 1.0, "reference_temperature": cold, "melt_temperature": "2000 K", "specific_heat": "1000 J/kg/K",
                "taylor_quinney": 0.0}  # fmt: skip
    fields.entry.remark(
        "differs", "taylor_quinney = 1", "in Radioss all internal energy heats the material, in Conoid all plastic work"
    )
    heat = fields.real("RHOCP") / fields.real("RHO_I")
    return {
        "m": fields.real("M"), "reference_temperature": cold,
        "melt_temperature": context.system.quantity(fields.real("TMELT"), TEMPERATURE),
        "specific_heat": context.system.quantity(heat, SPECIFIC_HEAT), "taylor_quinney": 1.0,
    }  # fmt: skip


def _limit(fields: Fields) -> dict[str, Any]:
    """Reads the failure strain of a strength law. In Radioss a failed tet keeps its pressure; in Conoid the tet is
    deleted.
    """
    strain = fields.real("EPS_MAX")
    if not 0.0 < strain < 1e20:
        return {}
    fields.refuse("EPS_MAX", "in Radioss the element keeps its pressure without strength; in Conoid the tet is deleted")
    return {"plastic_strain": strain}


def _damage(law: dict[str, Any], context: Context) -> dict[str, Any]:
    """Reads ``/FAIL/JOHNSON``. The constant D3 of ``/FAIL/JOHNSON`` has the same sign in Radioss and Conoid."""
    found = context.failure
    if found is None:
        return {}
    law["damage"] = {f"D{i}": found.real(f"D{i}") for i in range(1, 6)}
    rate = found.real("EPS_DOT_0")
    if rate > 0.0:
        wanted = context.system.quantity(rate, RATE)
        if law.setdefault("reference_rate", wanted) != wanted:
            found.refuse(
                "EPS_DOT_0",
                f"in Conoid the damage law uses the reference rate of the strength law, {law['reference_rate']}",
            )
    found.forgive("IFAIL_SH IXFEM DADV", "of shells")
    if found.whole("IFAIL_SO") not in (0, 1):
        found.refuse("IFAIL_SO", "in Radioss a failed element keeps no strength; in Conoid the tet is deleted")
    found.rest()
    return {"damage": 1.0}


def _law79(fields: Fields, context: Context) -> Made:
    young, poisson = young_of(fields.real("K1"), fields.real("G"))
    law: dict[str, Any] = {
        "model": "johnson_holmquist", "hel": context.stress(fields.real("HEL")),
        "pressure_hel": context.stress(fields.real("PHEL")), "tension": context.stress(abs(fields.real("T"))),
        **{key: fields.real(key) for key in ("A", "N", "B", "M", "C", "D1", "D2")},
        "K2": context.stress(fields.real("K2")), "K3": context.stress(fields.real("K3")), "beta": fields.real("BETA"),
    }  # fmt: skip
    law["reference_rate"] = context.system.quantity(fields.nonzero("EPS_DOT_0", 1.0), RATE)
    if fields.real("T") < 0.0:
        fields.differ("T", "converted without the sign, because T is positive in tension in Conoid")
    if 0.0 < fields.real("SIG_FMAX") < 1e19:
        law["largest_fractured"] = fields.real("SIG_FMAX")
    fields.forgive("FCUT", "setting of the filter of the strain rate")
    if fields.whole("IDEL"):
        fields.refuse("IDEL", "criterion for the deletion of elements; in Conoid: parts[].erosion")
        fields.real("EPSMAX")
    else:
        fields.forgive("EPSMAX", "no effect without IDEL")
    material = {"density": context.system.quantity(fields.real("RHO_I"), DENSITY)}
    return Made({**material, "elastic": {"young": context.stress(young), "poisson": poisson}, "strength": law})


_LAWS: dict[str, Callable[[Fields, Context], Made]] = {"LAW1": _law1, "LAW2": _law2, "LAW4": _law4, "LAW79": _law79}
