"""Every shipped case, run to its end by the command line of the worker, reproduces each of its reference values."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from conoid.cases import load
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout
from conoid.cases.reading.library import material

HEAVY = {
    "branching_plate", "breathing_facet", "demo", "free_tets", "glass_steel_bar", "glass_steel_demo", "hertz_spheres",
    "long_rod", "plugging_weldox", "taylor_42crmo4", "taylor_copper", "taylor_copper_split",
}  # fmt: skip
"""Cases that take half a minute or more."""
MANY = Path(__file__).parents[1] / "parallel" / "many.py"
NAMES = [pytest.param(name, marks=[pytest.mark.slow] * (name in HEAVY)) for name in sorted(load.shipped())]


Outcomes = Callable[[str], Outcome]


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> Outcomes:
    """Returns the outcome of a case; the light cases are run one after the other in one process, which starts only
    once."""
    root = tmp_path_factory.mktemp("shipped")

    def outcome(name: str) -> Outcome:
        if not (root / name).exists():
            alike = [name] if name in HEAVY else [each for each in sorted(load.shipped()) if each not in HEAVY]
            (root / "runs.json").write_text(json.dumps([[each, "--out", str(root / each)] for each in alike]))
            words = [sys.executable, str(MANY), str(root / "runs.json")]
            (root / "printed").write_text(subprocess.run(words, capture_output=True, text=True, timeout=600).stderr)
        assert (root / name / layout.OUTCOME).exists(), (root / "printed").read_text()
        return from_json((root / name / layout.OUTCOME).read_bytes())

    return outcome


@pytest.mark.timeout(660)
@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_case_reproduces_its_references(name: str, outcomes: Outcomes) -> None:
    """The energy balance closes to 1 %, and for elastic bodies to 0.1 %."""
    case = load.read_case(load.shipped_path(name))
    end = outcomes(name)
    assert end.state == "succeeded", end.message
    assert end.time == case.run.end_time
    assert len(end.reference) == len(case.reference)
    assert [check for check in end.reference if not check.passed] == []
    metals = [material(case, part.material) for part in case.parts]
    elastic = all(metal.strength is None and metal.eos is None for metal in metals)
    assert end.worst_residual < (1e-3 if elastic else 1e-2)
