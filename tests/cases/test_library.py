"""The material library: every constant has a source, and the constants that tests use are unchanged."""

import math
from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from conoid.cases.model.materials import Elastic, JohnsonCook, Material, MohrCoulomb
from conoid.cases.reading.library import CONFIDENCES, library, provenance, sources

NAMES = sorted(library())


def leaves(model: BaseModel, prefix: str = "") -> Iterator[str]:
    """Yields the keys of all numbers of a material, defaults included."""
    for key, value in model:
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{prefix}{key}.")
        elif isinstance(value, float):
            yield f"{prefix}{key}"


@pytest.mark.parametrize("name", NAMES)
def test_every_number_has_a_confidence_and_a_source(name: str) -> None:
    """Constants that the schema fills in by default would have no source; therefore the library gives all constants."""
    known = provenance(name)
    assert set(known) == set(leaves(library()[name]))
    assert {confidence for confidence, _ in known.values()} <= set(CONFIDENCES)
    assert {source for _, source in known.values()} <= set(sources())
    assert library()[name].description


def test_every_source_is_used() -> None:
    used = {source for name in NAMES for _, source in provenance(name).values()}
    assert used == set(sources())


def test_the_paper_gives_all_of_its_metals_but_a_and_the_thermal_constants() -> None:
    for name, density, young, law in (
        ("wha", 17300.0, 389.16e9, (0.22326e9, 0.10841, 0.0221, 1.0)),
        ("mild_steel", 7870.0, 200.10e9, (0.22946e9, 0.3024, 0.0274, 1.0)),
    ):
        made, known = library()[name], provenance(name)
        assert isinstance(made.strength, JohnsonCook)
        assert (made.density, made.elastic.young) == (density, young)
        assert (made.strength.B, made.strength.n, made.strength.C, made.strength.m) == law
        assert known["strength.A"][0] == "derived"
        assert {known[f"strength.{key}"][0] for key in "BnCm"} == {"paper"}


def flow_stress(law: JohnsonCook, strain: float, rate: float) -> float:
    """Returns the flow stress of a material at the reference temperature, Pa."""
    return float((law.A + law.B * strain**law.n) * (1.0 + law.C * math.log(rate / law.reference_rate)))


@pytest.mark.parametrize(
    ("name", "twin", "within"), [("wha", "tungsten_alloy", 0.01), ("mild_steel", "steel_1006", 0.09)]
)
def test_the_derived_a_matches_the_published_metal(name: str, twin: str, within: float) -> None:
    ours, published = library()[name].strength, library()[twin].strength
    assert isinstance(ours, JohnsonCook)
    assert isinstance(published, JohnsonCook)
    for strain in (0.05, 0.1, 0.5, 1.0):
        assert flow_stress(ours, strain, 1e4) == pytest.approx(flow_stress(published, strain, 1e4), rel=within)


def isotropic(bulk: float, shear: float) -> Elastic:
    return Elastic(young=9 * bulk * shear / (3 * bulk + shear), poisson=(3 * bulk - 2 * shear) / (6 * bulk + 2 * shear))


@pytest.mark.parametrize(
    ("name", "bulk", "shear"),
    [
        ("copper_ofhc", 129e9, 46e9),
        ("tungsten_alloy", 18167 * 4030**2, 145e9),
        ("tungsten", 19235 * 3980**2, 160e9),
    ],
)
def test_the_derived_elastic_constants(name: str, bulk: float, shear: float) -> None:
    made, exact = library()[name].elastic, isotropic(bulk, shear)
    assert made.young == pytest.approx(exact.young, rel=5e-4)
    assert made.poisson == pytest.approx(exact.poisson, abs=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_the_constants_make_a_solid(name: str) -> None:
    """Wave speeds of the library are those of solids (boron carbide: 14 km/s); the bulk modulus of an equation of state
    is near the elastic bulk modulus.
    """
    made: Material = library()[name]
    bulk = made.elastic.young / (3 * (1 - 2 * made.elastic.poisson))
    shear = made.elastic.young / (2 * (1 + made.elastic.poisson))
    assert 3000 < math.sqrt((bulk + 4 / 3 * shear) / made.density) < 15000
    if made.eos is not None:
        assert made.density * made.eos.c0**2 == pytest.approx(bulk, rel=0.4)


def test_the_glass_has_the_strengths_that_it_was_derived_from() -> None:
    """To three digits, the strength is 1 GPa in compression and 0.1 GPa in tension, and the cap corresponds to a
    Hugoniot elastic limit of 5 GPa.
    """
    made, law = library()["soda_lime_mohr_coulomb"], library()["soda_lime_mohr_coulomb"].strength
    assert isinstance(law, MohrCoulomb)
    cohesion, sine = 2.0 * law.cohesion * math.cos(law.friction_angle), math.sin(law.friction_angle)
    assert math.isclose(cohesion / (1.0 - sine), 1e9, rel_tol=2e-3)
    assert math.isclose(cohesion / (1.0 + sine), 1e8, rel_tol=2e-3)
    poisson = made.elastic.poisson
    assert math.isclose(law.strength_cap or 0.0, 5e9 * (1.0 - 2.0 * poisson) / (1.0 - poisson), rel_tol=4e-3)
    assert (made.density, made.elastic) == (library()["soda_lime"].density, library()["soda_lime"].elastic)


def test_the_fracture_energy_of_glass_is_that_of_its_toughness() -> None:
    made = library()["soda_lime"]
    assert made.brittle is not None
    toughness = 0.75e6**2 * (1.0 - made.elastic.poisson**2) / made.elastic.young
    assert made.brittle.energy == pytest.approx(toughness, rel=5e-3)
    assert (made.brittle.strength, provenance("soda_lime")["brittle.strength"][0]) == (1e8, "paper")
