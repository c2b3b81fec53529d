"""Cost of fracture on one rank, on finer and finer meshes: the first table has a body that may fracture but does not,
the second table has a glass bar that shatters.

The second table has speed against error: the effect of the mesh on the fragments, and the cost.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases import load
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import fragments, layout
from conoid.worker import simulation, step
from conoid.worker.parallel.comm import SerialComm

from .table import Cell, table

SIZES = ("3.0 mm", "2.4 mm", "1.8 mm", "1.4 mm")
"""Element sizes of the glass bar, from coarse to fine."""
_BOX = (
    'parts[0].mesh={shape="box",low=["0 mm","0 mm","0 mm"],high=["10 mm","10 mm","30 mm"],element_size="0.5 mm",'
    'generator="structured"}',
    'parts[0].fracture={model="instant"}', 'contact="none"', "numerics.pressure=standard", "run.end_time=1",
    "reference=[]",
)  # fmt: skip
_BLOCK = 10
"""Number of steps with the fracture test of the faces, and of steps without this test, in alternation."""


@dataclass(frozen=True)
class Armed:
    """Speed of a spinning elastic box, in millions of element updates per CPU second."""

    tets: int
    without: float
    armed: float


def armed(blocks: int) -> Armed:
    """Measures the speed with and without the fracture test of the faces, in alternation within one run; no facet
    breaks.
    """
    data = load.apply_overrides(load.read_data(load.shipped_path("free_spin")), _BOX)
    data["parts"][0]["material"] = "soda_lime"
    case = load.parse_case(data)
    sim = simulation.build(case, Path(), SerialComm())
    step.prepare(sim)
    (block,) = sim.model.blocks
    on = block.hot, block.weakest
    seconds: dict[bool, list[float]] = {False: [], True: []}
    for k in range(2 * blocks):
        tested = k % 2 == 1
        block.hot, block.weakest = on if tested else (on[0][:0], on[1][:0])
        start = time.thread_time()
        for _ in range(_BLOCK):
            step.first_half(sim)
            step.second_half(sim)
        seconds[tested].append((time.thread_time() - start) / _BLOCK)
    rate = {way: 1e-6 * block.n / statistics.median(times) for way, times in seconds.items()}
    return Armed(block.n, rate[False], rate[True])


@dataclass(frozen=True)
class Shattered:
    """Results of a glass bar after 60 us."""

    size: str
    outcome: Outcome
    summary: fragments.Summary


def shatter(sizes: Sequence[str]) -> Iterator[Shattered]:
    """Runs glass_steel_demo with the given element sizes by the command line of the worker."""
    for size in sizes:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
            words = [sys.executable, "-m", "conoid.worker", "glass_steel_demo", "--out", folder]
            words += ["--set", "run.frames=1", "--set", "run.ranks=1", "--set", "reference=[]"]
            words += [w for k in (0, 1) for w in ("--set", f'parts[{k}].mesh.element_size="{size}"')]
            subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=3600)
            rows = fragments.read(fragments.path(Path(folder), 1))
            columns = ([row[name] for row in rows] for name in ("tets", "mass", "extent"))
            tets, masses, extents = ([float(v) for v in column] for column in columns)
            summary = fragments.summary([int(t) for t in tets], masses, extents)
            yield Shattered(size, from_json((Path(folder) / layout.OUTCOME).read_bytes()), summary)


def report(cost: Armed | None, bars: Sequence[Shattered]) -> str:
    """Returns the two tables of the study."""
    texts = []
    if cost is not None:
        row: list[Cell] = [cost.tets, f"{cost.without:.1f}", f"{cost.armed:.1f}", f"{cost.without / cost.armed:.2f}"]
        texts.append(table(["tets", "M upd/s without", "armed", "ratio"], [row]))
    head = [
        "size", "tets", "nodes at first", "nodes", "fragments", "of 10 tets and more", "largest, of the mass", "steps",
        "CPU s", "contact s", "M upd/s", "residual",
    ]  # fmt: skip
    rows = [_row(b) for b in bars]
    texts.append(table(head, rows))
    return "\n\n".join(texts)


def _row(b: Shattered) -> list[Cell]:
    return [
        b.size, b.outcome.elements, b.outcome.nodes_initial, b.outcome.nodes, b.outcome.fragments,
        b.summary.fragments, f"{b.summary.largest_share:.2f}", b.outcome.steps, round(b.outcome.cpu, 1),
        round(b.outcome.phases["contact"][0], 1), f"{b.outcome.element_updates_per_second * 1e-6:.2f}",
        b.outcome.worst_residual,
    ]  # fmt: skip
