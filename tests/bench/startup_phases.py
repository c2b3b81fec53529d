"""One worker's way to its first step, timed: ``python -m tests.bench.startup_phases LAUNCHED CASE``, seconds as JSON.

``LAUNCHED`` is the Unix time at which the process was launched. The order is that of the worker's own start. Each phase
has two numbers, seconds of wall time and of CPU time, that of child processes with it. Kernels are loaded where they
are called first: in the first pass, most of them.
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
    """Wall and CPU seconds between one stamp and the next, by name."""

    def __init__(self, start: float) -> None:
        self._last = (start, 0.0)
        self.seconds = {name: [0.0, 0.0] for name in PHASES}

    def stamp(self, name: str) -> None:
        """Books the time since the last stamp."""
        now = (time.time(), sum(os.times()[:4]))
        for clock in range(2):
            self.seconds[name][clock] += now[clock] - self._last[clock]
        self._last = now

    def around(self, work: Callable[..., Any], before: str, name: str) -> Callable[..., Any]:
        """``work``, whose time is booked to ``name``, and the time until it begins to ``before``."""

        def timed(*arguments: Any) -> Any:
            self.stamp(before)
            result = work(*arguments)
            self.stamp(name)
            return result

        return timed


def main(launched: float, case: str) -> None:
    """Goes the way and prints the seconds of each phase."""
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
