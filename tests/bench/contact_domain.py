"""Program under mpiexec that computes steps of the coarse long rod with one kind of contact domain after the other, and
prints as JSON the work of every rank.

The program measures the CPU time of the thread without waiting, because wall time is useless if there are fewer cores
than ranks. The order of the contact domains is box, arbitrary, arbitrary, box, so that a drift affects both domains in
the same way. The partition of the mesh is not changed.
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

from conoid.worker.kernels import store

store.use_cache()

from conoid.cases import load  # noqa: E402
from conoid.worker import simulation, step  # noqa: E402
from conoid.worker.contact.scene import layout  # noqa: E402
from conoid.worker.contact.scene.near_surface import NearSurface  # noqa: E402
from conoid.worker.parallel.comm import Comm  # noqa: E402
from conoid.worker.parallel.mpi import connect, leave  # noqa: E402

from .long_rod import COARSE  # noqa: E402


def main(steps: int, names: Sequence[str]) -> None:
    """Prints on rank 0 the numbers of every rank: a list of runs for each contact domain."""
    world = connect()
    found: dict[str, list[Any]] = {name: [] for name in names}
    for name in (*names, *reversed(names)):
        found[name].append(world.gather(_measured(name, steps, world)))
    if world.rank == 0:
        print(json.dumps(found))


def _measured(name: str, steps: int, world: Comm) -> dict[str, Any]:
    """Returns the numbers of one rank: for each search the time, us, and the numbers of its own and of received faces;
    CPU time, s, bytes and messages of contact."""
    data = load.apply_overrides(
        load.read_data(load.shipped_path("long_rod")), [*COARSE, "run.frames=0", f'contact.domain="{name}"']
    )
    sim = simulation.build(load.parse_case(data), Path(), world)
    step.prepare(sim)
    assert sim.contact is not None
    course: list[tuple[float, int, int]] = []
    looked: list[tuple[int, int]] = []
    searching, sent, seconds = 0.0, {"bytes": 0, "messages": 0}, sim.timers.seconds
    begin = seconds["contact"]
    with patch.object(layout, "build", _noted(layout.build, looked)):
        for _ in range(steps):
            world.sent.since_last()
            before, known = seconds["contact"], len(looked)
            step.first_half(sim)
            if len(looked) > known:
                course.append((1e6 * sim.clock.t, *looked[-1]))
                searching += seconds["contact"] - before
            fresh = world.sent.since_last()
            sent = {kind: number + fresh[kind] for kind, number in sent.items()}
            step.second_half(sim)
    spent = seconds["contact"] - begin
    sim.free()
    return {"course": course, "cpu": spent, "searching": searching, **sent}


def _noted(function: Any, looked: list[tuple[int, int]]) -> Any:
    """Wraps ``function`` so that the number of faces of each search, and the number of faces from other ranks, are
    stored."""

    def noted(sides: NearSurface, *rest: Any) -> Any:
        found = function(sides, *rest)
        every = len(found.faces.id)
        looked.append((every, every - sides.faces.n))
        return found

    return noted


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
    leave(0)
