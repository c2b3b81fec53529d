"""Under mpiexec: steps of the coarse long rod with one contact domain after the other; JSON of what was sent.

The timed part of a search is between its messages: what a rank does for itself. With fewer cores than ranks, times of
whole steps say little.
"""

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

from conoid.worker import kernels

kernels.use_cache()

import numpy as np  # noqa: E402

from conoid.cases import load  # noqa: E402
from conoid.worker import simulation, step  # noqa: E402
from conoid.worker.contact import scene  # noqa: E402
from conoid.worker.parallel import comm  # noqa: E402

from .long_rod import COARSE  # noqa: E402

_STEPS = 1000


def main(names: Sequence[str]) -> None:
    """Prints the numbers of every rank for every domain, on rank 0."""
    world = comm.connect()
    found = {name: world.gather(_measured(name, world)) for name in names}
    if world.rank == 0:
        print(json.dumps(found))


def _measured(name: str, world: comm.Comm) -> dict[str, float]:
    data = load.apply_overrides(
        load.read_data(load.shipped_path("long_rod")), [*COARSE, "run.frames=0", f'contact.domain="{name}"']
    )
    sim = simulation.build(load.parse_case(data), Path(), world)
    step.prepare(sim)
    spent: list[float] = []
    seen: list[tuple[float, ...]] = []
    with patch.object(scene, "_node_face", _timed(scene._node_face, spent)):
        known = -1
        for _ in range(_STEPS):
            step.first_half(sim)
            assert sim.contact is not None
            if sim.contact.searches != known:
                known = sim.contact.searches
                seen.append(_looked(sim))
            step.second_half(sim)
    means = np.array(seen).mean(axis=0)
    sim.free()
    return {
        "faces sent": float(means[0]), "nodes copied in a step": float(means[1]),
        "bytes sent in a step": float(means[2]), "ms to find nodes on faces": 1e3 * sum(spent) / len(spent),
    }  # fmt: skip


def _looked(sim: simulation.Simulation) -> tuple[float, ...]:
    assert sim.contact is not None
    now = sim.contact._scene
    assert now is not None
    copied = sum(len(some.nodes) for some in now.copies.receives)
    assert sim.case.contact is not None
    sums = now.shared_shares.bytes_sent + sim.case.contact.sweeps * now.shared_impulse.bytes_sent
    return float(now.faces_sent), float(copied), float(now.copies.bytes_sent + sums)


def _timed(function: Any, spent: list[float]) -> Any:
    def timed(*arguments: Any) -> Any:
        begin = time.thread_time()
        result = function(*arguments)
        spent.append(time.thread_time() - begin)
        return result

    return timed


if __name__ == "__main__":
    main(sys.argv[1:])
    comm.leave(0)
