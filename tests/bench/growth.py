"""How cost and memory grow with the mesh: elastic, without viscosity, a structured box, up to 2 million tets."""

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from conoid.worker.mesh.build import build as build_mesh

from .gather_scatter import GatherScatter
from .scene import SAMPLE_EVERY, Ride, box, case
from .stopwatch import take_turns
from .table import Cell, table


@dataclass(frozen=True)
class Growth:
    """One size: CPU ns a tet and step, and bytes of the process."""

    tets: int
    best: float
    median: float
    spread: float
    limit: float
    """The same for gather and scatter only, best."""
    base: int
    """Resident bytes with every library and kernel loaded, before the mesh."""
    peak: int
    """Largest resident bytes while the model was set up, its mesh found in the cache."""
    steady: int
    """Resident bytes while it steps."""

    def bytes_a_tet(self, smaller: "Growth") -> tuple[float, float]:
        """Bytes a tet between two sizes: at the peak, and steady."""
        more = self.tets - smaller.tets
        return (self.peak - smaller.peak) / more, (self.steady - smaller.steady) / more


def measure(sizes: Sequence[int], rounds: int = 4) -> list[Growth]:
    """Each size in a process of its own, so that its memory is its own; the mesh is in the cache by then."""
    return [_apart(size, rounds) for size in sizes]


def _apart(size: int, rounds: int) -> Growth:
    build_mesh(box(size, "structured"), Path())
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench.growth", str(size), str(rounds)],
        cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, text=True, timeout=1800, check=True,
    )  # fmt: skip
    return Growth(**json.loads(done.stdout))


def _here(size: int, rounds: int) -> Growth:
    base = _resident("VmRSS")
    ride = Ride(case("steel", "standard", box(size, "structured"), viscosity=False))
    peak = _resident("VmHWM")
    ride.stretch(1e-5)
    steps = SAMPLE_EVERY * max(1, round(4e6 / SAMPLE_EVERY / ride.tets))
    ride.steps(steps)
    steady = _resident("VmRSS")
    kernel = GatherScatter(ride.sim)
    work = {"step": lambda: ride.steps(steps), "limit": lambda: kernel.sweeps(steps)}
    times, per = take_turns(work, rounds), 1e9 / (steps * ride.tets)
    return Growth(
        tets=ride.tets, best=times["step"].best * per, median=times["step"].median * per, spread=times["step"].spread,
        limit=times["limit"].best * per, base=base, peak=peak, steady=steady,
    )  # fmt: skip


def _resident(name: str) -> int:
    """A line of /proc/self/status, bytes."""
    found = re.search(rf"{name}:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="utf-8"))
    return int(found[1]) * 1024 if found else 0


def report(sizes: Sequence[Growth]) -> str:
    """Cost and memory of each size; bytes a tet against the size before."""
    rows: list[list[Cell]] = []
    for before, now in zip([None, *sizes], sizes, strict=False):
        peak, steady = now.bytes_a_tet(before) if before else (None, None)
        rows.append([
            now.tets, f"{now.best:.0f} ({now.median:.0f})", f"{now.limit:.0f}", f"{now.best / sizes[0].best:.2f}",
            round(now.peak / 2**20), round(now.steady / 2**20), peak and round(peak), steady and round(steady),
        ])  # fmt: skip
    head = ["tets", "ns a tet, best (median)", "gather-scatter", "cost / first", "peak MiB", "steady MiB",
            "peak bytes a tet more", "steady bytes a tet more"]  # fmt: skip
    return table(head, rows) + f"\n\nBefore the mesh a process takes {sizes[0].base / 2**20:.0f} MiB.\n"


if __name__ == "__main__":
    print(json.dumps(asdict(_here(int(sys.argv[1]), int(sys.argv[2])))))
