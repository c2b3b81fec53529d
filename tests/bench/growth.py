"""Growth of cost and memory with the mesh: an elastic structured box without viscosity, of 50,000 to 5 million tets.

In the variant ``armed`` the box is of glass that may fracture and may be in contact with itself; the stretch is so
small that no facet breaks.
"""

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from conoid.cases.model import schema
from conoid.worker.mesh.build import build as build_mesh

from .gather_scatter import GatherScatter
from .scene import SAMPLE_EVERY, Ride, box, case
from .stopwatch import take_turns
from .table import Cell, table


@dataclass(frozen=True)
class Growth:
    """Result for one mesh size: CPU time per tet and step, ns, and memory of the process, bytes."""

    armed: bool
    tets: int
    best: float
    median: float
    spread: float
    limit: float
    """CPU time of gather and scatter alone per tet and step, ns; the fastest measurement."""
    base: int
    """Resident memory of the process with all libraries and kernels loaded, before the mesh is loaded, bytes."""
    peak: int
    """Largest resident memory during the setup of the model, with the mesh in the cache, bytes."""
    steady: int
    """Resident memory during the steps, bytes."""

    def bytes_a_tet(self, smaller: "Growth") -> tuple[float, float]:
        """Returns the increase of memory per tet between two mesh sizes, bytes: the increase at the peak, and during
        the steps.
        """
        more = self.tets - smaller.tets
        return (self.peak - smaller.peak) / more, (self.steady - smaller.steady) / more

    @property
    def bytes_each(self) -> tuple[float, float]:
        """Returns the memory per tet without the memory of a process without a mesh, bytes: the values at the peak, and
        during the steps."""
        return (self.peak - self.base) / self.tets, (self.steady - self.base) / self.tets


def measure(sizes: Sequence[int], rounds: int = 4) -> list[Growth]:
    """Measures elastic boxes first, armed boxes afterwards. Each box runs in a new process for a correct measurement of
    memory; the mesh of the box is in the cache."""
    return [_apart(size, rounds, armed) for armed in (False, True) for size in sizes]


def _apart(size: int, rounds: int, armed: bool) -> Growth:
    build_mesh(box(size, "structured"), Path())
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench.growth", str(size), str(rounds), str(int(armed))],
        cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, text=True, timeout=1800, check=True,
    )  # fmt: skip
    return Growth(**json.loads(done.stdout))


def here(size: int, rounds: int, armed: bool) -> Growth:
    """Measures one box in this process, which must not have loaded another mesh. Raises RuntimeError if a facet
    breaks.
    """
    base = _resident("VmRSS")
    ride = Ride(scene(size, armed))
    peak = _resident("VmHWM")
    ride.stretch(1e-7 if armed else 1e-5)
    steps = SAMPLE_EVERY * max(1, round(4e6 / SAMPLE_EVERY / ride.tets))
    ride.steps(steps)
    steady = _resident("VmRSS")
    kernel = GatherScatter(ride.sim)
    work = {"step": lambda: ride.steps(steps), "limit": lambda: kernel.sweeps(steps)}
    times, per = take_turns(work, rounds), 1e9 / (steps * ride.tets)
    if ride.sim.fracture is not None and ride.sim.fracture.broken:
        raise RuntimeError("the glass has broken; this measures what does not")
    return Growth(
        armed=armed, tets=ride.tets, best=times["step"].best * per, median=times["step"].median * per,
        spread=times["step"].spread, limit=times["limit"].best * per, base=base, peak=peak, steady=steady,
    )  # fmt: skip


def scene(size: int, armed: bool) -> schema.Case:
    """Returns the case of a stretched box: of steel, or of glass with fracture and contact."""
    plain = case("soda_lime" if armed else "steel", "standard", box(size, "structured"), viscosity=False)
    parts = tuple(part.model_copy(update={"fracture": schema.Fracture()}) for part in plain.parts)
    return plain.model_copy(update={"parts": parts}) if armed else plain


def _resident(name: str) -> int:
    """Returns the value of a line of /proc/self/status, bytes."""
    found = re.search(rf"{name}:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="utf-8"))
    return int(found[1]) * 1024 if found else 0


def report(sizes: Sequence[Growth]) -> str:
    """Returns a table of cost and memory for each mesh size; the memory per tet is the increase from the previous mesh
    size.
    """
    rows: list[list[Cell]] = []
    for before, now in zip([None, *sizes], sizes, strict=False):
        first = next(s for s in sizes if s.armed == now.armed)
        peak, steady = now.bytes_a_tet(before) if before and now is not first else (None, None)
        rows.append([
            "armed" if now.armed else "elastic", now.tets, f"{now.best:.0f} ({now.median:.0f})", f"{now.limit:.0f}",
            f"{now.best / first.best:.2f}", round(now.peak / 2**20), round(now.steady / 2**20),
            peak and round(peak), steady and round(steady),
        ])  # fmt: skip
    head = ["box", "tets", "ns a tet, best (median)", "gather-scatter", "cost / first", "peak MiB", "steady MiB",
            "peak bytes a tet more", "steady bytes a tet more"]  # fmt: skip
    return table(head, rows) + f"\n\nBefore the mesh a process takes {sizes[0].base / 2**20:.0f} MiB.\n"


if __name__ == "__main__":
    print(json.dumps(asdict(here(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "1"))))
