"""Stages that a case has or lacks, and the distribution of the core time of a case over its stages."""

import pytest

from conoid.cases.estimates.estimate import estimate
from conoid.cases.estimates.stages import stages, without
from conoid.cases.load import parse_case, read_case, shipped


def test_a_case_without_anything_besides_tets() -> None:
    bare = parse_case({
        "name": "bare", "run": {"end_time": "1 us"}, "contact": "none",
        "numerics": {"pressure": "standard", "viscosity": "none"},
        "materials": {"m": {"density": 1e3, "elastic": {"young": "1 GPa", "poisson": 0.3}}},
        "parts": [{
            "name": "a", "material": "m",
            "mesh": {"shape": "box", "low": ["0 m"] * 3, "high": ["1 m"] * 3, "element_size": "0.2 m"},
        }],
    })  # fmt: skip
    assert not any(stages(bare).values())
    assert without(bare) == list(stages(bare))
    assert set(estimate(bare).costs) == {"tets", "start and steps"}


@pytest.mark.parametrize(
    ("name", "there", "lacking"),
    [
        ("glass_steel_demo", {"contact", "fracture", "viscosity"}, {"strength", "erosion", "friction"}),
        ("long_rod", {"contact", "erosion", "strength", "averaged pressure"}, {"fracture", "cohesive facets"}),
        ("taylor_copper", {"strength"}, {"contact", "sharp edges", "fracture"}),
    ],
)
def test_what_shipped_cases_have(name: str, there: set[str], lacking: set[str]) -> None:
    case = read_case(shipped()[name])
    has = stages(case)
    assert there <= {stage for stage, present in has.items() if present}
    assert lacking <= set(without(case))


@pytest.mark.parametrize("name", ["glass_steel_demo", "long_rod", "taylor_copper", "shock_copper"])
def test_costs_add_up_and_are_those_of_stages_that_are_there(name: str) -> None:
    case = read_case(shipped()[name])
    expected = estimate(case)
    assert expected.core_seconds == pytest.approx(sum(expected.costs.values()))
    assert {"tets", "start and steps"} <= set(expected.costs)
    assert not set(expected.costs) & set(without(case))
