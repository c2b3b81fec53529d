"""Suggestions of similar names in the error message of every choice from a list."""

from typing import Any

import pytest

from conoid.cases.load import CaseError, parse_case, shipped_path
from conoid.cases.reading.similar import allowed, close, nearest
from conoid.cases.site.batch import Slurm, profile_of
from conoid.cases.units import parse_unit

from .scenes import rod


def problem_of(*changes: str) -> str:
    with pytest.raises(CaseError) as caught:
        parse_case(rod(*changes))
    return str(caught.value)


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("Steel-4340", "steel_4340"), ("steel 4340", "steel_4340"), ("weldox", "weldox_460e"),
        ("SODA_LIME", "soda_lime"),
        ("stel", "steel"), ("xyz", None), ("st", None), ("", None),
    ],
)  # fmt: skip
def test_capitals_blanks_and_beginnings_do_not_matter(word: str, found: str | None) -> None:
    names = ["soda_lime", "steel", "steel_4340", "weldox_460e", "copper"]
    assert next(iter(close(word, names)), None) == found


def test_a_message_ends_with_the_allowed_names_and_a_suggestion() -> None:
    assert allowed("mizes", ["mises", "pressure"]) == "allowed: mises, pressure; did you mean 'mises'?"
    assert allowed("xyz", ["mises", "pressure"]) == "allowed: mises, pressure"
    assert nearest("xyz", ["mises"]) == "known: 'mises'"
    assert nearest("Mises", ["mises", "pressure"]) == "did you mean 'mises'?"


@pytest.mark.parametrize(
    ("change", "meant"),
    [
        ("parts[0].material=stel_4340", "steel_4340"),
        ("parts[0].mesh.shape=cylindre", "cylinder"),
        ('boundaries=[{kind="symetry", axis="x"}]', "symmetry"),
        ('probes=[{name="p", part="rod", field="stres_zz"}]', "stress_zz"),
        ('probes=[{name="p", part="rodd", field="stress_zz"}]', "rod"),
        ('reference=[{quantity="extend", value=1, tolerance=1, source="s"}]', "extent"),
        ('materials.m={density=1, elastic={young=1, poisson=0.3}, strength={model="johnson_cok"}}', "johnson_cook"),
        ("numerics.pressure=spilt", "split"),
        ("parts[0].velocty=[0, 0, 1]", "velocity"),
        ("parts[0].fracture.model=cohesiv", "cohesive"),
    ],
)
def test_an_unknown_name_of_a_case_gets_a_suggestion(change: str, meant: str) -> None:
    assert f"did you mean '{meant}'" in problem_of(change)


def test_unknown_cases_units_and_profiles_get_suggestions() -> None:
    with pytest.raises(CaseError, match="did you mean 'taylor_copper'"):
        shipped_path("taylor_coper")
    with pytest.raises(ValueError, match=r"unknown unit 'Mpa' in 'Mpa'; known: .*; did you mean 'MPa'"):
        parse_unit("Mpa")
    site: Any = Slurm(profiles={"standard": None, "large": None})  # type: ignore[dict-item]
    with pytest.raises(ValueError, match=r"^profile = 'larg': allowed: standard, large; did you mean 'large'"):
        profile_of(site, "larg")
