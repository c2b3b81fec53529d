"""What contact costs: bodies that meet, with their phases; and what the contact domain sends, box against arbitrary."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases import layout
from conoid.cases.outcome import Outcome, from_json

from .table import Cell, table


@dataclass(frozen=True)
class Scene:
    """A shipped case with assignments, on one rank."""

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
    """How a scene went."""

    scene: Scene
    outcome: Outcome

    @property
    def contact(self) -> float:
        """Contact over elements, CPU time."""
        return self.outcome.phases["contact"][0] / self.outcome.phases["elements"][0]


def measure(scenes: Sequence[Scene]) -> Iterator[Cost]:
    """Every scene by the worker's command line."""
    for scene in scenes:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
            words = [sys.executable, "-m", "conoid.worker", scene.case, "--out", folder]
            words += [word for assignment in scene.assignments for word in ("--set", assignment)]
            subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=3600)
            yield Cost(scene, from_json((Path(folder) / layout.OUTCOME).read_bytes()))


def report(costs: Sequence[Cost]) -> str:
    """A table of phases, in CPU seconds."""
    names = ("elements", "nodes", "contact", "output")
    head = ["scene", "tets", "steps", *(f"{name} s" for name in names), "contact / elements", "M upd/s", "residual"]
    return table(head, [_row(cost, names) for cost in costs])


def _row(cost: Cost, names: Sequence[str]) -> list[Cell]:
    o = cost.outcome
    return [
        cost.scene.name, o.elements, o.steps, *(round(o.phases[name][0], 1) for name in names), round(cost.contact, 2),
        f"{o.element_updates_per_second * 1e-6:.1f}", o.worst_residual,
    ]  # fmt: skip


RANKS = 8
DOMAINS = ("box", "arbitrary")


def domains(ranks: int = RANKS) -> dict[str, list[dict[str, float]]]:
    """Both domains on the long rod, coarse and on its way: for every rank the means over the searches."""
    launch = [str(Path(sys.executable).with_name("mpiexec")), "-n", str(ranks), sys.executable, "-m", "mpi4py"]
    words = [*launch, "-m", "tests.bench.contact_domain", *DOMAINS]
    done = subprocess.run(words, capture_output=True, text=True, timeout=1800, check=True)
    found: dict[str, list[dict[str, float]]] = json.loads(done.stdout.splitlines()[-1])
    return found


def domain_report(found: dict[str, list[dict[str, float]]]) -> str:
    """Means over the ranks, and the largest of them, box beside arbitrary."""
    rows: list[list[Cell]] = []
    for kind in found["box"][0]:
        one, other = ([rank[kind] for rank in found[name]] for name in DOMAINS)
        rows.append([
            kind, float(sum(one) / len(one)), float(sum(other) / len(other)), max(one), max(other),
            f"{sum(other) / sum(one):.2f}" if sum(one) else "-",
        ])  # fmt: skip
    return table(["a search, a rank", "box", "arbitrary", "box, worst rank", "arbitrary, worst", "ratio"], rows)
