"""Conversion of materials and equations of state of LS-DYNA to Conoid (LS-DYNA Keyword User's Manual, volume II).

Where a formula differs between LS-DYNA and Conoid, the account of the import (its list of all keywords) has a note;
docs/howto/import.md compares the formulas.
"""

from collections.abc import Callable

from ..draft import Made
from ..laws import hardening_of, line_of, young_of
from .elasticity import Context, Curve, cut_off, elastic, failing, linear, with_eos
from .fields import Fields
from .johnson import holmquist, johnson_cook, simplified
from .rate import with_rate


def translated(name: str, fields: Fields, context: Context) -> Made | None:
    """Returns the material of a keyword. Returns None, and writes the reason into the entry, if Conoid lacks the
    material law. Raises CardError.
    """
    law = _LAWS.get(name)
    if law is None:
        fields.entry.refuse("Conoid has no such material law")
        return None
    fields.whole("MID")
    try:
        made = law(fields, context)
    except (ValueError, ZeroDivisionError) as error:
        fields.entry.refuse(f"the constants of the material cannot be used: {error}")
        return None
    fields.rest("refused")
    return made


def weighed(name: str, fields: Fields) -> tuple[float, float | None]:
    """Returns density and Young's modulus of a material, in units of the deck; None if the deck does not give the
    density.
    """
    density = fields.real("RO")
    if fields.real("E") > 0.0:
        return density, fields.real("E")
    shear = fields.real("G")
    if shear > 0.0 and fields.real("K1") > 0.0:
        return density, young_of(fields.real("K1"), shear)[0]
    return density, 2.6 * shear if shear > 0.0 else None


# Erosion --------------------------------------------------------------------------------------------------------------


def erode(fields: Fields | None, made: Made) -> None:
    """Reads ``*MAT_ADD_EROSION``. Criteria of strain are translated; every other criterion refuses the import.
    Raises CardError.
    """
    if fields is None:
        return
    fields.whole("MID")
    fields.forgive("EXCL NUMFIP NCS", "number of integration points that must fail")
    if "strength" not in made.material:
        fields.rest("refused", "the material is elastic in Conoid, so no plastic strain can delete a tet")
    elif fields.real("EFFEPS") > 0.0:
        made.erosion["plastic_strain"] = fields.real("EFFEPS")
        fields.differ("EFFEPS", "limit of the total strain; erosion.plastic_strain is a limit of the plastic strain")
    elif fields.real("MXEPS") > 0.0:
        made.erosion["plastic_strain"] = fields.real("MXEPS")
        fields.refuse(
            "MXEPS", "limit of the largest principal strain; equal to erosion.plastic_strain only in simple tension"
        )
    if "plastic_strain" in made.erosion:
        fields.entry.take("parts[].erosion")
    fields.rest("refused", "this failure criterion is not translated")


# Laws -----------------------------------------------------------------------------------------------------------------


def _mat_elastic(fields: Fields, context: Context) -> Made:
    fields.forgive("DA DB", "setting for the damping of beams and shells")
    return Made(elastic(fields, context))


def _mat_plastic_kinematic(fields: Fields, context: Context) -> Made:
    tangent, young = fields.real("ETAN"), fields.real("E")
    if tangent and fields.real("BETA") != 1.0:
        fields.refuse("BETA", "partly kinematic hardening; Conoid has only isotropic hardening (BETA = 1)")
        if not fields.given("BETA") or fields.real("BETA") == 0.0:
            fields.entry.remark(
                "refused", "BETA = 0", "kinematic hardening; Conoid has only isotropic hardening (BETA = 1)"
            )
    else:
        fields.real("BETA")
    law = linear(young, (fields.real("SIGY"), hardening_of(young, tangent)), context)
    law = with_rate(law, fields, context, ("SRC", "SRP"))
    return Made({**elastic(fields, context), "strength": law}, failing(fields.real("FS")))


def _mat_piecewise(fields: Fields, context: Context) -> Made:
    fields.refuse("LCSR", "curve of the flow stress over the strain rate; only C and P are translated")
    fields.forgive("TDEL", "deletes elements with a small time step; in Conoid: parts[].erosion.time_step")
    failure = fields.real("FAIL")
    if failure < 0.0:
        fields.refuse("FAIL", "failure by a user subroutine")
    law = linear(fields.real("E"), _hardening_curve(fields, context), context)
    law = with_rate(law, fields, context, ("C", "P"))
    if law["model"] == "cowper_symonds" and "hardening" in law and fields.real("VP") == 1.0:
        fields.refuse(
            "VP", "in LS-DYNA the rate adds SIGY (rate/C)^(1/P); in Conoid the rate also multiplies the hardening"
        )
    return Made({**elastic(fields, context), "strength": law}, failing(failure))


def _hardening_curve(fields: Fields, context: Context) -> tuple[float, float]:
    """Returns yield stress and hardening modulus: from a curve, else from eight points, else from a tangent modulus."""
    number = fields.whole("LCSS")
    if number:
        fields.forgive("SIGY ETAN", "no effect because LCSS is given")
        if number not in context.curves:
            raise ValueError(
                f"LCSS = {number} is not a *DEFINE_CURVE of the deck; tables for several strain rates are not "
                "translated"
            )
        return _straight(context.curves[number], f"the curve LCSS = {number}")
    strains = [fields.real(f"EPS{i}") for i in range(1, 9)]
    stresses = [fields.real(f"ES{i}") for i in range(1, 9)]
    last = max((i for i in range(8) if strains[i] or stresses[i]), default=-1)
    if last >= 1:
        fields.forgive("SIGY ETAN", "no effect because EPS1 and ES1 are given")
        return _straight(tuple(zip(strains, stresses, strict=True))[: last + 1], "the curve EPS1 to ES8")
    return fields.real("SIGY"), hardening_of(fields.real("E"), fields.real("ETAN"))


def _straight(curve: Curve, what: str) -> tuple[float, float]:
    found = line_of(curve)
    if found is None:
        raise ValueError(f"{what} of stress over plastic strain is not one straight line from strain 0")
    return found


def _mat_hydro(fields: Fields, context: Context) -> Made:
    material = with_eos(fields, context, fields.real("G"))
    fields.forgive("CHARL", "element length for fracture")
    cut_off(fields, material, context, fields.real("PC"), "PC")
    law = linear(0.0, (fields.real("SIGY"), fields.real("EH")), context)
    return Made({**material, "strength": law}, failing(fields.real("FS")))


def _mat_power(fields: Fields, context: Context) -> Made:
    modulus, first = fields.real("K"), fields.real("SIGY")
    if fields.real("N") != 1.0 or first <= 0.0:
        raise ValueError("the law K (strain)^N is translated only with N = 1 and SIGY above 0")
    strength = first if first > 0.02 else modulus * first
    law = with_rate(linear(fields.real("E"), (strength, modulus), context), fields, context, ("SRC", "SRP"))
    return Made({**elastic(fields, context), "strength": law}, failing(fields.real("EPSF")))


_TRANSLATIONS = {4.0: "xy", 5.0: "yz", 6.0: "xz", 7.0: "xyz"}
"""Directions that the codes CON1 of ``*MAT_RIGID`` fix, for codes with two or three directions."""


def _mat_rigid(fields: Fields, context: Context) -> Made:
    fields.forgive("N COUPLE M ALIAS", "coupling with other programs")
    fields.forgive("LCO A2 A3 V1 V2 V3", "local axes of output and constraints")
    code = fields.real("CON1")
    held = _TRANSLATIONS.get(code, "") if fields.real("CMO") == 1.0 and fields.real("CON2") == 7.0 else ""
    if fields.real("CMO") and not held:
        fields.refuse("CMO CON1 CON2", "only global axes (1), translations 4 to 7 and all rotations (7) are translated")
    return Made(elastic(fields, context), rigid=True, held=held)


_LAWS: dict[str, Callable[[Fields, Context], Made]] = {
    "MAT_ELASTIC": _mat_elastic, "MAT_PLASTIC_KINEMATIC": _mat_plastic_kinematic,
    "MAT_ELASTIC_PLASTIC_HYDRO": _mat_hydro, "MAT_JOHNSON_COOK": johnson_cook,
    "MAT_POWER_LAW_PLASTICITY": _mat_power, "MAT_RIGID": _mat_rigid,
    "MAT_PIECEWISE_LINEAR_PLASTICITY": _mat_piecewise, "MAT_SIMPLIFIED_JOHNSON_COOK": simplified,
    "MAT_JOHNSON_HOLMQUIST_CERAMICS": holmquist,
}  # fmt: skip
