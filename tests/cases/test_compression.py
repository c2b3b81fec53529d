"""Warning about a brittle material without compressive failure that an impact would crush."""

import math
from typing import Any

import pytest

from conoid.cases.estimates.estimate import estimate
from conoid.cases.load import parse_case
from conoid.cases.reading.library import library
from conoid.cases.warnings.compression import griffith, impact_stresses
from conoid.cases.warnings.plausible import doubts

MM = 1e-3


def shot(material: str = "alumina", speed: float = 800.0, **case: Any) -> dict[str, Any]:
    """Returns a case of a steel rod that hits a tile."""
    return {
        "name": "shot", "run": {"end_time": 1e-5},
        "parts": [
            {"name": "rod", "material": "steel_4340", "velocity": [0, 0, -speed],
             "mesh": {"shape": "cylinder", "base": [0, 0, 0.1 * MM], "radius": 3 * MM, "length": 9 * MM,
                      "element_size": MM}},
            {"name": "tile", "material": material, "fracture": {},
             "mesh": {"shape": "box", "low": [-9 * MM, -9 * MM, -5 * MM], "high": [9 * MM, 9 * MM, 0],
                      "element_size": MM}},
        ],
    } | case  # fmt: skip


def crushed(data: dict[str, Any]) -> dict[str, str]:
    """Returns the warnings about compression of a case, by key."""
    case = parse_case(data)
    found = doubts(data, case, estimate(case))
    return {each.key: each.message for each in found if "crushed" in each.message}


def test_griffith_of_a_plane_wave_is_on_his_parabola() -> None:
    """Griffith's criterion is (s1 - s3)^2 = 8 T (s1 + s3) with s3 = nu / (1 - nu) s1; the stress s1 is near the
    measured elastic limit of alumina.
    """
    made = library()["alumina"]
    assert made.brittle is not None
    s1 = griffith(made)
    s3 = made.elastic.poisson / (1.0 - made.elastic.poisson) * s1
    assert (s1 - s3) ** 2 == pytest.approx(8.0 * made.brittle.strength * (s1 + s3), rel=1e-12)
    assert s1 == pytest.approx(6.5e9, rel=0.1)


def test_the_stress_of_an_impact_is_that_of_two_impedances() -> None:
    """Two equal plates of glass collide at 100 m/s: the stress is Z v / 2 in both plates."""
    glass = library()["soda_lime"]
    z = math.sqrt(glass.density * (glass.elastic.bulk + 4.0 / 3.0 * glass.elastic.shear))
    data = shot("soda_lime", 100.0)
    data["parts"][0]["material"] = "soda_lime"
    assert impact_stresses(parse_case(data)) == pytest.approx([50.0 * z, 50.0 * z])


def test_alumina_at_800_metres_a_second_is_named_with_its_law() -> None:
    (text,) = crushed(shot()).values()
    assert list(crushed(shot())) == ["materials.alumina.strength"]
    assert "'tile' may be compressed to" in text
    assert "strength.model = 'mohr_coulomb' or 'johnson_holmquist' can fail in compression (alumina_995_jh2)" in text


def test_glass_and_a_material_of_the_case_are_named_too() -> None:
    assert list(crushed(shot("soda_lime"))) == ["materials.soda_lime.strength"]
    own = {"density": 3200, "elastic": {"young": 4e11, "poisson": 0.17}, "brittle": {"strength": 2e8, "energy": 30}}
    assert list(crushed(shot("own", materials={"own": own}))) == ["materials.own.strength"]


def test_a_wall_counts() -> None:
    data = shot()
    tile = data["parts"][1] | {"velocity": [0, 0, -400.0]}
    wall = {"kind": "wall", "point": [0, 0, -6 * MM], "normal": [0, 0, 1]}
    assert crushed(data | {"parts": [tile], "boundaries": [wall]})
    assert not crushed(data | {"parts": [tile]})


@pytest.mark.parametrize("material", ["alumina_995_jh2", "soda_lime_mohr_coulomb", "steel_4340"])
def test_what_fails_or_flows_in_compression_is_not_named(material: str) -> None:
    data = shot(material)
    del data["parts"][1]["fracture"]
    assert not crushed(data)


def test_a_slow_impact_is_not_named() -> None:
    assert not crushed(shot(speed=150.0))
