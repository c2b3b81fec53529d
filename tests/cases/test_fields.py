"""Fields of frames that only some cases have."""

import pytest

from conoid.cases.load import read_case, shipped_path
from conoid.cases.output.fields import lacking

ASKED_FOR = {"density", "effective_strain", "strain_rate", "contact_pressure"}


@pytest.mark.parametrize(
    ("name", "missing"),
    [
        ("taylor_copper", {"damage", "fragment"}), ("long_rod", {"fragment"}), ("plugging_weldox", {"fragment"}),
        ("glass_ball_cohesive", set()), ("glass_ball_jh2", {"fragment"}),
    ],
)  # fmt: skip
def test_a_case_lacks_what_nothing_in_it_can_have(name: str, missing: set[str]) -> None:
    """The case also lacks the fields that are written only if run.fields requests them."""
    assert lacking(read_case(shipped_path(name))) == missing | ASKED_FOR
