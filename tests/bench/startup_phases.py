"""Times the start of one worker: the command ``python -m tests.bench.startup_phases LAUNCHED CASE`` prints seconds as
JSON.

The argument ``LAUNCHED`` is the Unix time of the launch of the process. The order of the phases is that of the worker.
Each phase has its wall time and its CPU time, which includes the CPU time of child processes. A kernel is loaded at its
first call; most kernels are loaded in the first pass.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

PHASES = (
    "interpreter and contract",
    "MPI",
    "kernels hashed and compiled",
    "numba",
    "meshes",
    "cut",
    "model",
    "first pass",
    "first step",
)


class Stamps:
    """Wall time and CPU time of each phase, s, by name."""

    def __init__(self, start: float) -> None:
        self._last = (start, 0.0)
        self.seconds = {name: [0.0, 0.0] for name in PHASES}

    def stamp(self, name: str) -> None:
        """Adds the time since the previous call to a phase."""
        now = (time.time(), sum(os.times()[:4]))
        for clock in range(2):
            self.seconds[name][clock] += now[clock] - self._last[clock]
        self._last = now

    def around(self, work: Callable[..., Any], before: str, name: str) -> Callable[..., Any]:
        """Returns ``work`` with timing: its time is added to the phase ``name``, the time before its call to the phase
        ``before``."""

        def timed(*arguments: Any) -> Any:
            self.stamp(before)
            result = work(*arguments)
            self.stamp(name)
            return result

        return timed


def main(launched: float, case: str) -> None:
    """Runs all phases of a start, and prints the times of the phases."""
    stamps = Stamps(launched)
    from conoid.cases import load
    from conoid.worker.parallel.mpi import connect
    from conoid.worker.run import main as worker

    scene = load.read_case(load.shipped_path(case))
    stamps.stamp("interpreter and contract")
    comm = connect()
    stamps.stamp("MPI")
    worker.ready_kernels(comm, None)
    stamps.stamp("kernels hashed and compiled")
    from conoid.worker import simulation, step
    from conoid.worker.run import compute
    from conoid.worker.scene import assembly, domain

    assert compute
    stamps.stamp("numba")
    assembly.assemble = stamps.around(assembly.assemble, "model", "meshes")
    domain.cut = stamps.around(domain.cut, "meshes", "cut")
    sim = simulation.build(scene, Path(), comm)
    stamps.stamp("model")
    step.prepare(sim)
    stamps.stamp("first pass")
    step.first_half(sim)
    step.second_half(sim)
    stamps.stamp("first step")
    print(json.dumps(stamps.seconds))


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2])
