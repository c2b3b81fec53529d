"""Contact holds rubble that is driven through a narrower hole, with the sweeps that it gets (tests/bench/press.py)."""

import pytest

from ..bench.press import measure, press


@pytest.mark.slow
def test_what_is_driven_is_as_stiff_as_with_many_more_sweeps() -> None:
    """Five sweeps have a third, so that the check can fail."""
    converged, own, few = (measure(press(sweeps)).work for sweeps in (120, None, 5))
    print(converged, own, few)
    assert 0.8 < own / converged < 1.25
    assert few / converged < 0.6
