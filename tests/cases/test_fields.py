"""Fields of frames that only some cases have."""

import pytest

from conoid.cases.fields import lacking
from conoid.cases.load import read_case, shipped_path


@pytest.mark.parametrize(
    ("name", "missing"),
    [
        ("taylor_copper", {"damage", "fragment"}), ("long_rod", {"fragment"}), ("plugging_weldox", {"fragment"}),
        ("glass_ball_cohesive", set()), ("glass_ball_jh2", {"fragment"}),
    ],
)  # fmt: skip
def test_a_case_lacks_what_nothing_in_it_can_have(name: str, missing: set[str]) -> None:
    assert lacking(read_case(shipped_path(name))) == missing
