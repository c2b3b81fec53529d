"""Mean time step of bars that flatten on a wall, compared with the estimate of cases/estimates/shrinkage.py.

The command ``python -m tests.bench.flattening`` runs square bars of two metals on one rank. The length of a bar is one
to four times its width.
"""

import json
import math
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path
from typing import Any

from conoid.cases.estimates.estimate import estimate
from conoid.cases.estimates.impact import impact_speeds
from conoid.cases.estimates.shrinkage import shrinkage
from conoid.cases.load import parse_case
from conoid.cases.outcome import from_json

from .table import Cell, table

WIDTH, SIZE = 3e-3, 0.75e-3
"""Width of a bar and element size, m."""
METALS = {150e6: (100.0, 200.0, 300.0), 800e6: (200.0, 400.0)}
"""Yield stress, Pa, and impact speeds, m/s; the hardening modulus is 300 MPa."""
LENGTHS = (1, 2, 4)
"""Length of a bar over its width."""
GAP = 1e-5
"""Initial distance between bar and wall, m."""


def data_of(yield_stress: float, length: int, speed: float) -> dict[str, Any]:
    """Returns the case of a bar that hits a wall. The end time of the run is 1.5 times length over speed; the bar has
    rebounded by this time."""
    metal = {
        "density": 8900.0, "elastic": {"young": 207e9, "poisson": 0.31},
        "strength": {"model": "linear_hardening", "yield_stress": yield_stress, "hardening": 300e6},
    }  # fmt: skip
    mesh = {
        "shape": "box", "low": [0.0, 0.0, GAP], "high": [WIDTH, WIDTH, GAP + length * WIDTH], "element_size": SIZE,
        "generator": "structured",
    }  # fmt: skip
    return {
        "name": "flattening", "materials": {"metal": metal},
        "run": {"end_time": 1.5 * length * WIDTH / speed, "frames": 0, "snapshots": 0, "ranks": 1},
        "parts": [{"name": "bar", "material": "metal", "velocity": [0.0, 0.0, -speed], "mesh": mesh}],
        "boundaries": [{"kind": "wall", "point": [0.0, 0.0, 0.0], "normal": [0, 0, 1]}],
    }  # fmt: skip


def measured(data: dict[str, Any]) -> list[Cell]:
    """Returns the ratio of the initial to the mean time step, the exponent k that follows from this ratio, and the
    estimated ratio."""
    case = parse_case(data)
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
        place = Path(folder) / "case.json"
        place.write_text(json.dumps(data), encoding="utf-8")
        command = [sys.executable, "-m", "conoid.worker", str(place), "--out", f"{folder}/run"]
        subprocess.run(command, check=True, capture_output=True)
        outcome = from_json((Path(folder) / "run" / "outcome.json").read_bytes())
    (part,), (speed,), first = case.parts, impact_speeds(case), estimate(case).dt
    made = case.materials["metal"]
    assert first is not None
    assert made.strength is not None
    shrunk = (outcome.steps or 0) * first / case.run.end_time
    strain = made.density * speed**2 / (2.0 * made.strength.flow_stress())
    expected = shrinkage(case, part, speed)
    return [outcome.steps, shrunk, math.log(shrunk) / strain, expected, expected / shrunk, round(outcome.cpu, 1)]


def main() -> int:
    """Runs all bars, the short bars first."""
    head = ["MPa", "length/width", "m/s", "steps", "step fell by", "k", "expected", "off by", "CPU s"]
    rows: list[list[Cell]] = []
    for length, (stress, speeds) in product(LENGTHS, METALS.items()):
        rows += [
            [f"{1e-6 * stress:.0f}", length, f"{speed:.0f}", *measured(data_of(stress, length, speed))]
            for speed in speeds
        ]
    print(table(head, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
