"""A quarter and a half of an eroding scene are the whole, whatever debris does at the planes of symmetry."""

from pathlib import Path

import pytest

from conoid.worker import simulation
from conoid.worker.parallel.comm import SerialComm

from ..bench.sectors import MM, case_of, run


@pytest.mark.parametrize("sector", ["quarter", "half"])
def test_a_sector_is_the_whole_while_a_rod_is_used_up(sector: str) -> None:
    """Structured meshes are mirror images, whose momentum and energy agree. Debris that stopped on the planes left 1.5
    % more energy in the quarter, and nine times as much mass near the axis as there is in the whole.
    """
    target = 6.25 * MM, 10.0 * MM
    part, whole = (
        run(simulation.build(case, Path(), SerialComm()))
        for case in (
            case_of(each, 1.25 * MM, 16e-6, 7.5 * MM, target, 0.6, generator="structured") for each in (sector, "full")
        )
    )
    assert whole.near[1] > 1e-3
    assert part.near[0] < 3.0 * whole.near[0]
    assert part.rod == pytest.approx(whole.rod, rel=0.02)
    assert part.kinetic == pytest.approx(whole.kinetic, rel=0.01)
