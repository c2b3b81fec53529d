"""Measures each rank of a run with a core of its own, and computes the time of the run on as many cores as ranks.

The command ``python -m tests.bench.alone CASE RANKS [KEY=VALUE ...]`` first runs the case on all ranks, with any number
of cores, and records the received data of each rank on a tape. After that each rank runs alone from its tape (tape.py),
and timeline.py computes the waiting times between the ranks. In ``conoid bench scale`` other ranks empty the caches of
the measured rank and work at the same time; here the measured rank runs alone. A tape takes up to 4 MB per step on 16
ranks of the glass bar.
"""

import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

from conoid.cases.outcome import from_json
from conoid.client.studies.projection import Network
from conoid.client.studies.scaling import CORES, mpiexec
from conoid.client.studies.study import table

from .tape import calls
from .timeline import Timeline

NETWORK = Network(latency=2e-6, bandwidth=5e9)


def recorded(case: str, ranks: int, changes: list[str], folder: Path) -> str:
    """Records the tapes of a run, and returns the digest of the run. Raises CalledProcessError if the run fails."""
    arguments = [case, "--out", str(folder / "run"), *(word for change in changes for word in ("--set", change))]
    run = [sys.executable, "-m", "mpi4py", "-m", "tests.bench.tape", "record", str(folder), *arguments]
    crowded = ["-genv", "MPIR_CVAR_ENABLE_HEAVY_YIELD", "1"] if ranks > CORES else []
    subprocess.run([*mpiexec(), "-n", str(ranks), *crowded, *run], check=True)
    for rank in range(ranks):
        alone = folder / f"alone-{rank}"
        (alone / "log").mkdir(parents=True)
        arguments[2] = str(alone)
        subprocess.run(
            [sys.executable, "-m", "tests.bench.tape", "replay", str(folder), str(rank), *arguments], check=True
        )
    return from_json((folder / "run" / "outcome.json").read_bytes()).digest


def measured(ranks: int, folder: Path) -> Timeline:
    """Returns the timeline of the ranks from the calls that each rank made when it ran alone."""
    timeline = Timeline([pickle.loads(calls(folder, rank).read_bytes()) for rank in range(ranks)], NETWORK)
    timeline.run()
    return timeline


def main(case: str, number: str, *changes: str) -> None:
    """Prints the table of the waiting times."""
    ranks = int(number)
    with tempfile.TemporaryDirectory() as passing:
        digest = recorded(case, ranks, list(changes), Path(passing))
        timeline = measured(ranks, Path(passing))
    work = [sum(call.work for call in each) for each in timeline.calls]
    row = [
        str(ranks), f"{max(timeline.now):.2f}", f"{sum(work) / ranks:.2f}", f"{max(work):.2f}",
        f"{sum(timeline.waited) / ranks:.2f}", f"{sum(map(len, timeline.calls)) / ranks:,.0f}", digest[:16],
    ]  # fmt: skip
    head = ("ranks", "s", "work of a rank s", "of the busiest s", "waits of a rank s", "calls of a rank", "digest")
    print(table(head, [row]))


if __name__ == "__main__":
    main(*sys.argv[1:])
