"""Every shipped case, run whole by the worker's command line, reproduces each number that it carries."""

import subprocess
import sys
from pathlib import Path

import pytest

from conoid.cases import layout, load
from conoid.cases.library import material
from conoid.cases.outcome import Outcome, from_json

HEAVY = {
    "branching_plate", "breathing_facet", "demo", "free_tets", "glass_steel_bar", "glass_steel_demo", "hertz_spheres",
    "long_rod", "taylor_42crmo4", "taylor_copper", "taylor_copper_split",
}  # fmt: skip
"""Half a minute and more."""
NAMES = [pytest.param(name, marks=[pytest.mark.slow] * (name in HEAVY)) for name in sorted(load.shipped())]


def outcome(name: str, folder: Path) -> Outcome:
    words = [sys.executable, "-m", "conoid.worker", name, "--out", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return from_json((folder / layout.OUTCOME).read_bytes())


@pytest.mark.timeout(660)
@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_case_reproduces_its_references(name: str, tmp_path: Path) -> None:
    """The books close to 1 %, those of elastic bodies to 0.1 %."""
    case = load.read_case(load.shipped_path(name))
    end = outcome(name, tmp_path / "run")
    assert end.state == "succeeded"
    assert end.time == case.run.end_time
    assert len(end.reference) == len(case.reference)
    assert [check for check in end.reference if not check.passed] == []
    metals = [material(case, part.material) for part in case.parts]
    elastic = all(metal.strength is None and metal.eos is None for metal in metals)
    assert end.worst_residual < (1e-3 if elastic else 1e-2)
