"""A small valid case for tests to modify, and the problems of the modified case."""

from typing import Any

import pytest

from conoid.cases.load import CaseError, Problem, apply_overrides, parse_case, toml_data

ROD = """
name = "rod"

[[parts]]
name = "rod"
material = "steel"
velocity = [0, 0, "-10 m/s"]
mesh = { shape = "cylinder", radius = "3 mm", length = "30 mm", element_size = "1 mm", sector = "quarter" }

[[boundaries]]
kind = "wall"
point = [0, 0, 0]
normal = [0, 0, 1]

[[boundaries]]
kind = "symmetry"
axis = "x"

[[boundaries]]
kind = "symmetry"
axis = "y"

[[probes]]
name = "middle"
part = "rod"
field = "stress_zz"
low = [0, 0, "14 mm"]
high = ["3 mm", "3 mm", "16 mm"]

[run]
end_time = "10 us"

[[reference]]
quantity = "extent"
part = "rod"
axis = "z"
value = "30 mm"
tolerance = "1 mm"
source = "None"
"""


def rod(*overrides: str) -> dict[str, Any]:
    """Returns the rod as plain data, with changes."""
    return apply_overrides(toml_data(ROD), overrides)


def problems(*overrides: str) -> list[Problem]:
    """Returns the problems of the rod with changes that must make it invalid."""
    with pytest.raises(CaseError) as caught:
        parse_case(rod(*overrides))
    assert str(caught.value).splitlines() == [str(problem) for problem in caught.value.problems]
    return list(caught.value.problems)


def messages(*overrides: str) -> dict[str, str]:
    """Returns the problems of the rod with changes, by key."""
    return {problem.key: problem.message for problem in problems(*overrides)}
