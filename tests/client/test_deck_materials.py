"""Imported materials give the values of the formulas of the other code, point by point.

The formulas are those of the manuals: LS-DYNA Keyword User's Manual II (materials 3, 10, 15, 18, 24, 98, 110; equation
of state 4), Abaqus Analysis User's Guide ("Johnson-Cook plasticity", "Damage initiation for ductile metals", "Equation
of state"), Radioss Reference Guide (laws 2, 4, 79, /FAIL/JOHNSON, /EOS/GRUNEISEN).
"""

import math
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.model.materials import CowperSymonds, JohnsonCook, JohnsonHolmquist, LinearHardening, Material
from conoid.worker.materials.equation_of_state import cold
from conoid.worker.materials.law import DENSITY, EQUATION

from .deck_texts import abaqus, lsdyna, material, part, r20, radioss, read, row

POINTS = [(0.0, 1.0, 300.0), (0.02, 10.0, 400.0), (0.3, 1e4, 900.0), (1.1, 3e5, 1300.0)]
"""Plastic strain, strain rate in 1/s, and temperature in K of each compared point."""
MPA = 1e6


def flow(law: JohnsonCook, strain: float, rate: float, temperature: float) -> float:
    """Returns Conoid's flow stress of Johnson and Cook, Pa (cases/laws/johnson_cook.py)."""
    span = law.melt_temperature - law.reference_temperature
    soft = min(max((temperature - law.reference_temperature) / span, 0.0), 1.0)
    fast = 1.0 + law.C * math.log(max(rate / law.reference_rate, 1.0))
    return float((law.A + law.B * strain**law.n) * fast * (1.0 - soft**law.m))


def fracture(law: JohnsonCook, tension: float, rate: float, temperature: float) -> float:
    """Returns Conoid's fracture strain of Johnson and Cook (cases/laws/johnson_cook.py)."""
    of = law.damage
    assert of is not None
    span = law.melt_temperature - law.reference_temperature
    fast = 1.0 + of.D4 * math.log(max(rate / law.reference_rate, 1.0))
    warm = 1.0 + of.D5 * min(max((temperature - law.reference_temperature) / span, 0.0), 1.0)
    return (of.D1 + of.D2 * math.exp(of.D3 * tension)) * fast * warm


def hardening(made: Material) -> tuple[float, float]:
    assert isinstance(made.strength, LinearHardening)
    return made.strength.yield_stress, made.strength.hardening


def johnson_cook(made: Material) -> JohnsonCook:
    assert isinstance(made.strength, JohnsonCook)
    return made.strength


# LS-DYNA --------------------------------------------------------------------------------------------------------------

LSDYNA_JC = (
    "*MAT_JOHNSON_COOK", row(1, "8.96E-9", 4.6e4, 0, 0, 0, 1), row(90.0, 292.0, 0.31, 0.025, 1.09, 1356.0, 298.0, 1.0),
    row("3.83E8", -1500.0, 1, 0, 0.54, 4.89, -3.03, 0.014), row(1.12), "*EOS_GRUNEISEN",
    row(1, "3.94E6", 1.49, 0, 0, 1.99, 0, 0), row(1.0),
)  # fmt: skip


def test_johnson_cook_of_lsdyna(tmp_path: Path) -> None:
    found = read(tmp_path, "a.k", lsdyna(*LSDYNA_JC, eos=1))
    law = johnson_cook(material(found))
    for strain, rate, temperature in POINTS:
        soft = max((temperature - 298.0) / (1356.0 - 298.0), 0.0)
        theirs = (90.0 + 292.0 * strain**0.31) * (1.0 + 0.025 * math.log(rate / 1.0)) * (1.0 - soft**1.09)
        assert flow(law, strain, rate, temperature) == pytest.approx(theirs * MPA, rel=1e-12)
        for tension in (-0.5, 1.0 / 3.0, 1.2):
            theirs = (0.54 + 4.89 * math.exp(-3.03 * tension)) * (1.0 + 0.014 * math.log(rate)) * (1.0 + 1.12 * soft)
            assert fracture(law, tension, rate, temperature) == pytest.approx(theirs, rel=1e-12)
    assert law.specific_heat == pytest.approx(383.0, rel=1e-15)
    assert (law.taylor_quinney, material(found).spall) == (1.0, 1.5e9)
    assert part(found)["erosion"] == {"damage": 1.0}
    assert (part(found)["temperature"], found.refusals) == ("298 K", [])


@pytest.mark.parametrize(("system", "rate"), [("mm,t,s", 1.0), ("mm,kg,ms", 1e3), ("cm,g,us", 1e6)])
def test_the_reference_rate_of_lsdyna_is_in_its_unit_of_time(tmp_path: Path, system: str, rate: float) -> None:
    found = read(tmp_path, "a.k", lsdyna(*LSDYNA_JC, eos=1), system)
    assert johnson_cook(material(found)).reference_rate == pytest.approx(rate, rel=1e-15)
    details = [each.what for entry in found.account.entries for each in entry.details]
    assert ("EPSO = 1.0" in details) == (system != "mm,t,s"), "a rate of 1 that is not 1/s is pointed at"


def test_gruneisen_of_lsdyna_in_compression(tmp_path: Path) -> None:
    made = material(read(tmp_path, "a.k", lsdyna(*LSDYNA_JC, eos=1)))
    assert made.eos is not None
    density, speed, slope, gamma = 8960.0, 3940.0, 1.49, 1.99
    params = np.zeros(64)
    params[DENSITY], params[EQUATION : EQUATION + 3] = made.density, (made.eos.c0, made.eos.S, made.eos.gamma0)
    for mu in (1e-4, 0.01, 0.1, 0.3):
        below = (1.0 - (slope - 1.0) * mu) ** 2
        theirs = density * speed**2 * mu * (1.0 + (1.0 - gamma / 2.0) * mu) / below
        assert cold(params, 1.0 / (1.0 + mu))[0] == pytest.approx(theirs, rel=1e-12)
    assert made.eos.gamma0 * made.density == pytest.approx(gamma * density, rel=1e-15), "(gamma0 + 0 mu) E"
    assert made.elastic.shear == pytest.approx(46e9, rel=1e-12)
    assert made.elastic.bulk == pytest.approx(density * speed**2, rel=1e-12)


@pytest.mark.parametrize(("field", "message"), [("S2", "S2 = 0.4"), ("A", "A = 0.4"), ("E0", "E0 = 0.4")])
def test_terms_that_this_pressure_has_not_refuse(tmp_path: Path, field: str, message: str) -> None:
    values = {"S2": 0.0, "S3": 0.0, "GAMAO": 1.99, "A": 0.0, "E0": 0.0, field: 0.4}
    eos = row(1, "3.94E6", 1.49, *values.values())
    found = read(tmp_path, "a.k", lsdyna(*LSDYNA_JC[:6], eos, row(1.0), eos=1))
    assert any(message in line for line in found.refusals)


LINEAR = {
    "MAT_003": ("*MAT_003", row(1, "7.85E-9", 2.1e5, 0.3, 350.0, 1000.0, 1.0)),
    "MAT_024": ("*MAT_PIECEWISE_LINEAR_PLASTICITY", row(1, "7.85E-9", 2.1e5, 0.3, 350.0, 1000.0, 0.4)),
}  # fmt: skip


@pytest.mark.parametrize("name", LINEAR)
def test_a_tangent_modulus_is_the_slope_by_the_total_strain(tmp_path: Path, name: str) -> None:
    made = material(read(tmp_path, "a.k", lsdyna(*LINEAR[name])))
    strength, slope = hardening(made)
    for strain in (0.01, 0.2):
        stress = strength + slope * strain
        total = strain + stress / made.elastic.young
        theirs = 350e6 + 1000e6 * (total - 350e6 / 210e9)
        assert stress == pytest.approx(theirs, rel=1e-12)


@pytest.mark.parametrize(
    ("cards", "strength", "slope", "failure"),
    [
        (("*MAT_024", row(1, "7.85E-9", 2.1e5, 0.3, 0, 0, 0.4), row(0, 0, 5), "*DEFINE_CURVE", row(5, 0, 1, 2.0),
          r20(0.0, 200.0), r20(1.0, 250.0)), 400.0, 100.0, 0.4),
        (("*MAT_024", row(1, "7.85E-9", 2.1e5, 0.3, 1.0), row(0), row(0, 0.1, 0.3), row(300.0, 310.0, 330.0)),
         300.0, 100.0, None),
        (("*MAT_018", row(1, "7.85E-9", 2.1e5, 0.3, 500.0, 1.0), row(350.0, 0, 0.7)), 350.0, 500.0, 0.7),
        (("*MAT_010", row(1, "7.85E-9", 8.0e4, 350.0, 600.0, -900.0, 0.9), row(0), row(0), row(0), row(0),
          "*EOS_GRUNEISEN", row(1, "4.5E6", 1.49, 0, 0, 2.17), row(1.0)), 350.0, 600.0, 0.9),
    ],
)  # fmt: skip
def test_straight_flow_curves_of_lsdyna(
    tmp_path: Path, cards: tuple[str, ...], strength: float, slope: float, failure: float | None
) -> None:
    found = read(tmp_path, "a.k", lsdyna(*cards, eos=1 if "*EOS_GRUNEISEN" in cards else 0))
    assert found.refusals == []
    assert hardening(material(found)) == pytest.approx((strength * MPA, slope * MPA), rel=1e-12)
    assert part(found).get("erosion", {}).get("plastic_strain") == failure


@pytest.mark.parametrize(
    "cards",
    [
        ("*MAT_003", row(1, "7.85E-6", 210.0, 0.3, 0.35, 1.0, 1.0), row(0.0404, 5.0, 0.0, 1.0)),
        ("*MAT_024", row(1, "7.85E-6", 210.0, 0.3, 0.35, 1.0), row(0.0404, 5.0)),
        ("*MAT_018", row(1, "7.85E-6", 210.0, 0.3, 1.004785, 1.0, 0.0404, 5.0), row(0.35, 1.0)),
    ],
)
def test_the_factor_of_cowper_and_symonds_of_lsdyna(tmp_path: Path, cards: tuple[str, ...]) -> None:
    """In the units mm, kg, ms the constant SRC or C is a rate in 1/ms; the rate factor multiplies yield stress and
    hardening.
    """
    found = read(tmp_path, "a.k", lsdyna(*cards), "mm,kg,ms")
    law = material(found).strength
    assert isinstance(law, CowperSymonds)
    assert (law.D, law.q) == pytest.approx((40.4, 5.0), rel=1e-12)
    assert law.yield_stress == pytest.approx(350e6, rel=1e-12)
    assert law.hardening == pytest.approx(1e9 / (1.0 - 1.0 / 210.0), rel=1e-6)
    assert found.refusals == []


def test_a_bent_flow_curve_refuses(tmp_path: Path) -> None:
    curve = ("*DEFINE_CURVE", row(5), r20(0.0, 200.0), r20(0.5, 300.0), r20(1.0, 320.0))
    found = read(tmp_path, "a.k", lsdyna("*MAT_024", row(1, "7.85E-9", 2.1e5, 0.3), row(0, 0, 5), *curve))
    assert any("is not one straight line" in line for line in found.refusals)


def test_simplified_johnson_cook_has_no_thermal_softening(tmp_path: Path) -> None:
    cards = (
        "*MAT_098",
        row(1, "7.85E-9", 2.1e5, 0.3, 1),
        row(350, 275, 0.36, 0.022, "1.0E17", "1.0E28", "1.0E28", 1.0),
    )
    found = read(tmp_path, "a.k", lsdyna(*cards))
    law = johnson_cook(material(found))
    assert found.refusals == []
    assert law.taylor_quinney == 0.0, "its temperature stays at the reference"
    for strain, rate, _ in POINTS:
        theirs = (350.0 + 275.0 * strain**0.36) * (1.0 + 0.022 * math.log(rate))
        assert flow(law, strain, rate, law.reference_temperature) == pytest.approx(theirs * MPA, rel=1e-12)


def holmquist(law: JohnsonHolmquist, pressure: float, rate: float) -> tuple[float, float]:
    """Returns Conoid's intact and fractured strength, Pa (cases/laws/johnson_holmquist.py)."""
    p, t = pressure / law.pressure_hel, law.tension / law.pressure_hel
    fast = 1.0 + law.C * math.log(max(rate / law.reference_rate, 1.0))
    broken = law.B * p**law.M * fast
    return (
        law.strength_hel * law.A * (p + t) ** law.N * fast,
        law.strength_hel * min(broken, law.largest_fractured or math.inf),
    )


JH2 = {
    "a.k": lsdyna(
        "*MAT_110", row(1, "3.7E-9", 9.016e4, 0.93, 0.31, 0.007, 0.6, 0.64), row(2.0, 200.0, 0.5, 2790.0, 1460.0, 1.0),
        row(0.005, 1.0, 1.3095e5, 1000.0, 2000.0, 0.0),
    ),
    "a_0000.rad": radioss(
        "/MAT/LAW79/1", "alumina", r20("3.7E-9"), r20("9.016E4"), r20(0.93, 0.31, 0.6, 0.64), r20(0.007, 2.0, 0.5),
        r20(200.0, 2790.0, 1460.0), r20(0.005, 1.0), r20("1.3095E5", 1000.0, 2000.0, 1.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", JH2)
def test_johnson_holmquist_of_both_codes(tmp_path: Path, name: str) -> None:
    """Intact strength: sigma* = a (p* + t*)^n (1 + c ln rate*). Fractured strength: b p*^m (1 + c ln rate*), at most
    SFMAX. Stresses of JH-2 are divided by 3/2 (HEL - PHEL).
    """
    found = read(tmp_path, name, JH2[name])
    law = material(found).strength
    assert found.refusals == []
    assert isinstance(law, JohnsonHolmquist)
    hel = 1.5 * (2790.0 - 1460.0)
    for pressure in (10.0, 1460.0, 9000.0):
        fast = 1.0 + 0.007 * math.log(1e4 / 2.0)
        intact = hel * 0.93 * ((pressure + 200.0) / 1460.0) ** 0.64 * fast
        broken = hel * min(0.31 * (pressure / 1460.0) ** 0.6 * fast, 0.5)
        assert holmquist(law, pressure * MPA, 1e4) == pytest.approx((intact * MPA, broken * MPA), rel=1e-12)
    assert (law.D1, law.D2, law.K2, law.K3, law.beta) == (0.005, 1.0, 1e9, 2e9, 1.0)
    assert material(found).elastic.bulk == pytest.approx(130.95e9, rel=1e-12)
    assert material(found).elastic.shear == pytest.approx(90.16e9, rel=1e-12)


# Abaqus ---------------------------------------------------------------------------------------------------------------

ABAQUS_JC = (
    "*Density\n8.96e-9,\n*Elastic\n124000., 0.34\n*Plastic, hardening=JOHNSON COOK\n90., 292., 0.31, 1.09, 1058., 25.\n"
    "*Rate Dependent, type=JOHNSON COOK\n0.025, 1.\n*Specific Heat\n3.83e8,\n"
    "*Damage Initiation, criterion=JOHNSON COOK\n0.54, 4.89, 3.03, 0.014, 1.12, 1058., 25., 1.\n"
    "*Damage Evolution, type=DISPLACEMENT\n0.,"
)
CELSIUS = "*Physical constants, absolute zero=-273.15\n*Initial Conditions, type=TEMPERATURE\nall, 40."


def test_johnson_cook_of_abaqus(tmp_path: Path) -> None:
    """Temperatures of the deck are in degrees Celsius; R = 1 + C ln(rate / rate0); the factor of the triaxiality is
    exp(-d3 triaxiality).
    """
    deck = abaqus(ABAQUS_JC, model=CELSIUS, dynamic="*Dynamic, Explicit, adiabatic")
    found = read(tmp_path, "a.inp", deck)
    law = johnson_cook(material(found))
    for strain, rate, kelvin in POINTS:
        soft = max((kelvin - 273.15 - 25.0) / (1058.0 - 25.0), 0.0)
        theirs = (90.0 + 292.0 * strain**0.31) * (1.0 - soft**1.09) * (1.0 + 0.025 * math.log(rate))
        assert flow(law, strain, rate, kelvin) == pytest.approx(theirs * MPA, rel=1e-12)
        for triaxiality in (-0.5, 1.0 / 3.0, 1.2):
            theirs = (
                (0.54 + 4.89 * math.exp(-3.03 * triaxiality)) * (1.0 + 0.014 * math.log(rate)) * (1.0 + 1.12 * soft)
            )
            assert fracture(law, triaxiality, rate, kelvin) == pytest.approx(theirs, rel=1e-12)
    assert (part(found)["temperature"], part(found)["erosion"]) == ("313.15 K", {"damage": 1.0})
    assert (law.taylor_quinney, found.refusals) == (0.9, [])


def test_without_adiabatic_nothing_heats_in_abaqus(tmp_path: Path) -> None:
    found = read(tmp_path, "a.inp", abaqus(ABAQUS_JC, model=CELSIUS))
    assert johnson_cook(material(found)).taylor_quinney == 0.0


def test_damage_that_softens_by_a_displacement_refuses(tmp_path: Path) -> None:
    found = read(tmp_path, "a.inp", abaqus(ABAQUS_JC.removesuffix("0.,") + "0.01,"))
    assert any("damage 1" in line for line in found.refusals)


def test_two_rows_of_plasticity_are_a_line(tmp_path: Path) -> None:
    found = read(tmp_path, "a.inp", abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3\n*Plastic\n350., 0.\n600., 0.5"))
    assert hardening(material(found)) == pytest.approx((350e6, 500e6), rel=1e-12)
    bent = abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3\n*Plastic\n350., 0.\n600., 0.5\n700., 1.")
    assert any("is not one straight line" in line for line in read(tmp_path, "a.inp", bent).refusals)


def test_usup_of_abaqus(tmp_path: Path) -> None:
    """Mie-Grueneisen pressure: p = rho0 c0^2 eta / (1 - s eta)^2 (1 - Gamma0 eta / 2) + Gamma0 rho0 Em."""
    deck = abaqus("*Density\n8.96e-9,\n*Elastic, type=SHEAR\n46000.,\n*Eos, type=USUP\n3.94e6, 1.49, 1.99")
    made = material(read(tmp_path, "a.inp", deck))
    assert made.eos is not None
    params = np.zeros(64)
    params[DENSITY], params[EQUATION : EQUATION + 3] = made.density, (made.eos.c0, made.eos.S, made.eos.gamma0)
    for eta in (0.001, 0.1, 0.3):
        theirs = 8960.0 * 3940.0**2 * eta / (1.0 - 1.49 * eta) ** 2 * (1.0 - 1.99 * eta / 2.0)
        assert cold(params, 1.0 - eta)[0] == pytest.approx(theirs, rel=1e-12)
    assert made.elastic.shear == pytest.approx(46e9, rel=1e-12)


# Radioss --------------------------------------------------------------------------------------------------------------


def test_johnson_cook_of_radioss(tmp_path: Path) -> None:
    """Radioss law 2: (a + b e^n)(1 + c ln(rate / rate0))(1 - ((T - Tr) / (Tmelt - Tr))^m); the heating uses rho Cp."""
    found = read(tmp_path, "a_0000.rad", radioss(
        "/MAT/PLAS_JOHNS/1", "copper", r20("8.96E-9"), r20(1.24e5, 0.34), r20(90.0, 292.0, 0.31, 0, 0),
        r20(0.025, 1.0), r20(1.09, 1356.0, 3.43168, 298.0), "/FAIL/JOHNSON/1", r20(0.54, 4.89, -3.03, 0.014, 1.12),
        r20(1.0) + row(1, 1) + r20("", 0) + row("", 0),
    ))  # fmt: skip
    law = johnson_cook(material(found))
    for strain, rate, temperature in POINTS:
        soft = max((temperature - 298.0) / (1356.0 - 298.0), 0.0)
        theirs = (90.0 + 292.0 * strain**0.31) * (1.0 + 0.025 * math.log(rate)) * (1.0 - soft**1.09)
        assert flow(law, strain, rate, temperature) == pytest.approx(theirs * MPA, rel=1e-12)
        theirs = (0.54 + 4.89 * math.exp(-3.03 / 3.0)) * (1.0 + 0.014 * math.log(rate)) * (1.0 + 1.12 * soft)
        assert fracture(law, 1.0 / 3.0, rate, temperature) == pytest.approx(theirs, rel=1e-12)
    assert law.specific_heat == pytest.approx(383.0, rel=1e-12)
    assert found.refusals == []


def test_law_2_with_n_1_is_linear_hardening(tmp_path: Path) -> None:
    found = read(tmp_path, "a_0000.rad", radioss(
        "/MAT/LAW2/1", "steel", r20("7.85E-9"), r20(2.1e5, 0.3), r20(350.0, 600.0, 1.0, 0.7, 0), r20(0.0), r20(0.0)
    ))  # fmt: skip
    assert hardening(material(found)) == pytest.approx((350e6, 600e6), rel=1e-12)
    assert part(found)["erosion"] == {"plastic_strain": 0.7}
    assert any("EPS_MAX = 0.7" in line for line in found.refusals), "there a solid stays without strength"
