"""The laws of Johnson and Cook and of Johnson and Holmquist in LS-DYNA (materials 15, 98 and 110)."""

from typing import Any

from ..draft import Made
from ..laws import shear_of, young_of
from ..units import DENSITY, RATE, SPECIFIC_HEAT, TEMPERATURE
from .elasticity import Context, cut_off, elastic, failing, with_eos
from .fields import Fields


def _flow(fields: Fields, context: Context) -> dict[str, Any]:
    """Reads A, B, n, C and the reference rate of the Johnson-Cook flow stress, for materials 15 and 98."""
    rate = fields.real("EPSO")
    if rate <= 0.0:
        raise ValueError("EPSO, the reference rate, is not above 0")
    if rate == 1.0 and context.system.time != "s" and fields.real("C"):
        shown = context.system.quantity(rate, RATE)
        fields.differ("EPSO", f"the reference rate is {shown}; published constants usually are for 1/s: check the deck")
    if fields.real("C") and fields.real("VP") == 0.0:
        fields.differ(
            "VP", "with VP = 0 LS-DYNA uses the rate of the total strain, Conoid the rate of the plastic strain"
        )
    return {
        "model": "johnson_cook", "A": context.stress(fields.real("A")), "B": context.stress(fields.real("B")),
        "n": fields.nonzero("N", 1.0), "C": fields.real("C"), "m": fields.nonzero("M", 1.0),
        "reference_rate": context.system.quantity(rate, RATE),
    }  # fmt: skip


def simplified(fields: Fields, context: Context) -> Made:
    """Reads ``*MAT_SIMPLIFIED_JOHNSON_COOK``."""
    for name in ("SIGMAX", "SIGSAT"):
        if fields.real(name) < 1e20:
            fields.refuse(name, "Conoid has no limit of the flow stress")
    law = _flow(fields, context) | {
        "m": 1.0, "melt_temperature": "2000 K", "specific_heat": "1000 J/kg/K", "taylor_quinney": 0.0,
    }  # fmt: skip
    fields.entry.remark(
        "differs", "no heat", "the law has no temperature, so no plastic work becomes heat (taylor_quinney = 0); "
                              "melt_temperature and specific_heat have no effect",
    )  # fmt: skip
    return Made({**elastic(fields, context), "strength": law}, failing(fields.real("PSFAIL")))


def johnson_cook(fields: Fields, context: Context) -> Made:
    """Reads ``*MAT_JOHNSON_COOK``."""
    shear = fields.real("G") or shear_of(fields.real("E"), fields.real("PR"))
    fields.forgive("E PR", "field for shells; solids use G and the equation of state")
    fields.forgive("DTF", "deletes elements with a small time step; in Conoid: parts[].erosion.time_step")
    fields.forgive("IT NUMINT", "how shells are computed")
    material = with_eos(fields, context, shear)
    law = _flow(fields, context)
    heat, room = fields.real("CP"), context.system.quantity(fields.real("TR"), TEMPERATURE)
    law["reference_temperature"] = room
    law["melt_temperature"] = context.system.quantity(fields.real("TM"), TEMPERATURE)
    if heat <= 0.0:
        raise ValueError("CP, the specific heat, is not above 0")
    law["specific_heat"] = context.system.quantity(heat, SPECIFIC_HEAT)
    law["taylor_quinney"] = 1.0
    fields.entry.remark(
        "differs", "taylor_quinney = 1", "in LS-DYNA all plastic work becomes heat; in Conoid the usual fraction is "
                                         "0.9",
    )  # fmt: skip
    _spall(fields, material, context)
    erosion = _damage(fields, law)
    return Made({**material, "strength": law}, erosion, temperature=room)


def _spall(fields: Fields, material: dict[str, Any], context: Context) -> None:
    kind = fields.nonzero("SPALL", 2.0)
    pressure = fields.real("PC")
    if pressure and kind != 1.0:
        fields.entry.remark(
            "refused", f"SPALL = {kind:g}", "in LS-DYNA spalled material carries no tension; in Conoid the pressure "
                                            "is cut off at PC, like SPALL = 1",
        )  # fmt: skip
    cut_off(fields, material, context, -abs(pressure), "PC")


def _damage(fields: Fields, law: dict[str, Any]) -> dict[str, Any]:
    """Returns ``strength.damage`` and the erosion that belongs to this damage. If D1 to D5 are all 0, the material
    does not fail.
    """
    values = {f"D{i}": fields.real(f"D{i}") for i in range(1, 6)}
    stays = fields.real("EROD")
    if fields.real("EFMIN") > 1e-6:
        fields.refuse("EFMIN", "smallest failure strain; Conoid always uses 1e-6")
    if not any(values.values()):
        return {}
    law["damage"] = values
    if stays:
        fields.refuse(
            "EROD", "a failed element has no strength in LS-DYNA; in Conoid the tet is deleted or keeps its strength"
        )
        return {}
    return {"damage": 1.0}


def holmquist(fields: Fields, context: Context) -> Made:
    """Reads ``*MAT_JOHNSON_HOLMQUIST_CERAMICS``."""
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
        fields.differ("T", "converted without the sign, because T is positive in tension in Conoid")
    if 0.0 < fields.real("SFMAX") < 1e10:
        law["largest_fractured"] = fields.real("SFMAX")
    failure = fields.real("FS")
    if failure < 0.0:
        fields.refuse("FS", "deletes elements in tension (p* + T* below 0)")
    material: dict[str, Any] = {"density": context.system.quantity(fields.real("RO"), DENSITY)}
    material |= {"elastic": {"young": context.stress(young), "poisson": poisson}, "strength": law}
    return Made(material, failing(failure))
