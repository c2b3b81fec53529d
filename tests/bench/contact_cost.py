"""Cost of contact. One table has the CPU time of each phase for bodies in contact, another table has the data sent by
the two kinds of contact domain (box and arbitrary)."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from .table import Cell, table


@dataclass(frozen=True)
class Scene:
    """A shipped case with assignments of keys, on one rank."""

    name: str
    case: str
    assignments: tuple[str, ...]


def _bars(size: str, end: str) -> tuple[str, ...]:
    return *(f"parts[{k}].mesh.element_size={size}" for k in range(2)), f"run.end_time={end}", "run.frames=0"


SCENES = (
    Scene("bar_on_bar, elastic", "bar_on_bar", _bars("0.4 mm", "30 us")),
    Scene("bar_on_bar, elastic", "bar_on_bar", _bars("0.3125 mm", "30 us")),
    Scene("bar_on_bar, nodal pressure", "bar_on_bar", (*_bars("0.3125 mm", "30 us"), 'numerics.pressure="nodal"')),
    Scene("long_rod to 30 us", "long_rod", ("run.end_time=30 us", "run.frames=0")),
)


@dataclass(frozen=True)
class Cost:
    """Result of a scene."""

    scene: Scene
    outcome: Outcome

    @property
    def contact(self) -> float:
        """CPU time of contact over CPU time of the elements."""
        return self.outcome.phases["contact"][0] / self.outcome.phases["elements"][0]


def measure(scenes: Sequence[Scene]) -> Iterator[Cost]:
    """Runs every scene by the command line of the worker."""
    for scene in scenes:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
            words = [sys.executable, "-m", "conoid.worker", scene.case, "--out", folder]
            words += [word for assignment in scene.assignments for word in ("--set", assignment)]
            subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=3600)
            yield Cost(scene, from_json((Path(folder) / layout.OUTCOME).read_bytes()))


def report(costs: Sequence[Cost]) -> str:
    """Returns a table of the CPU time of each phase, s."""
    names = ("elements", "nodes", "contact", "output")
    head = ["scene", "tets", "steps", *(f"{name} s" for name in names), "contact / elements", "M upd/s", "residual"]
    return table(head, [_row(cost, names) for cost in costs])


def _row(cost: Cost, names: Sequence[str]) -> list[Cell]:
    o = cost.outcome
    return [
        cost.scene.name, o.elements, o.steps, *(round(o.phases[name][0], 1) for name in names), round(cost.contact, 2),
        f"{o.element_updates_per_second * 1e-6:.1f}", o.worst_residual,
    ]  # fmt: skip


STEPS = {8: 1500, 16: 400}
"""Number of time steps by the number of ranks; the paper of Moon, Kim and Lee uses 8 ranks."""
DOMAINS = ("box", "arbitrary")
PAPER = {
    "faces of a search": "1st: 7,284 / 5,467 = 1.33 (fig. 4)",
    "faces sent, a search": "1st, 6th: > 2 (fig. 6)", "contact, CPU s": "> 2 (fig. 5)",
}  # fmt: skip
"""Ratios box over arbitrary by Moon, Kim and Lee, for a long body that hits a steel block, on 8 processors."""
Run = list[dict[str, Any]]
"""Output of the program contact_domain for each rank."""


def domains(ranks: int, steps: int) -> dict[str, list[Run]]:
    """Runs both contact domains on the coarse long rod during penetration, each domain twice."""
    launch = [str(Path(sys.executable).with_name("mpiexec")), "-n", str(ranks), sys.executable, "-m", "mpi4py"]
    words = [*launch, "-m", "tests.bench.contact_domain", str(steps), *DOMAINS]
    crowded = {**os.environ, "MPIR_CVAR_ENABLE_HEAVY_YIELD": "1"}
    done = subprocess.run(words, capture_output=True, text=True, timeout=3600, check=True, env=crowded)
    found: dict[str, list[Run]] = json.loads(done.stdout.splitlines()[-1])
    return found


def kinds(runs: Sequence[Run], steps: int) -> dict[str, list[float]]:
    """Returns the mean of the runs with one contact domain for each rank."""

    def mean(number: Callable[[dict[str, Any]], float]) -> list[float]:
        return [statistics.fmean(map(number, same)) for same in zip(*runs, strict=True)]

    return {
        "faces of a search": mean(lambda rank: statistics.fmean(look[1] for look in rank["course"])),
        "faces sent, a search": mean(lambda rank: statistics.fmean(look[2] for look in rank["course"])),
        "contact, CPU s": mean(lambda rank: rank["cpu"]),
        "of it steps with a search": mean(lambda rank: rank["searching"]),
        "contact, kB sent a step": mean(lambda rank: 1e-3 * rank["bytes"] / steps),
        "contact, messages a step": mean(lambda rank: rank["messages"] / steps),
    }


def domain_report(found: dict[str, list[Run]], steps: int) -> str:
    """Returns a table of the ratio box over arbitrary: mean over the ranks, slowest rank, first and sixth rank, ratio
    of the means, and the value of the paper."""
    box, other = (kinds(found[name], steps) for name in DOMAINS)
    rows: list[list[Cell]] = []
    for kind, one in box.items():
        two = other[kind]
        pairs = [(f(one), f(two)) for f in (statistics.fmean, max, lambda of: of[0], lambda of: of[5])]
        ratios = [f"{a / b:.2f}" if b else "-" for a, b in pairs[:2]]
        rows.append([kind, *(f"{_short(a)} / {_short(b)}" for a, b in pairs), *ratios, PAPER.get(kind, "-")])
    head = ["box / arbitrary", "mean of the ranks", "worst rank", "1st", "6th", "ratio of means", "of worst", "paper"]
    return table(head, rows)


def _short(number: float) -> str:
    return f"{number:,.0f}" if number >= 100.0 else f"{number:.3g}"
