"""Simulations on several ranks of one process: steps that begin with a removal of tets, and runs that continue from
a checkpoint."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar
from unittest.mock import patch

import numpy as np

from conoid.cases.model import schema
from conoid.worker import simulation, step
from conoid.worker.accounts.timers import Timers
from conoid.worker.mesh.model import TetMesh
from conoid.worker.migration import checkpoint
from conoid.worker.migration.route import route
from conoid.worker.parallel.team import team
from conoid.worker.scene import assembly
from conoid.worker.simulation import Simulation

from ..contact.ranks import on_ranks

T = TypeVar("T")


def wear_out(sim: Simulation, gone: "np.ndarray") -> None:
    """Marks the tets with the given ids for removal in the next step."""
    assert sim.erosion is not None
    for part in sim.model.blocks:
        if len(part.worn):
            part.worn[np.isin(part.id, gone)] = True
    sim.erosion.due = True


def tick(sim: Simulation, gone: "np.ndarray | None" = None) -> float:
    """Makes a step that begins with the removal of the given tets; returns the energy residual of the step."""
    if gone is not None:
        wear_out(sim, gone)
    before = sim.model.nodes.v.copy()
    step.first_half(sim)
    residual = sim.ledger.close(before).residual
    step.second_half(sim)
    return residual


def on(ranks: int, case: schema.Case, meshes: Sequence[TetMesh], work: Callable[[Simulation], T]) -> list[T]:
    """Returns the result of ``work`` on the simulation of each rank."""
    ready = iter(meshes)
    with patch.object(assembly, "build_mesh", lambda *_, **__: next(ready)):
        return on_ranks(ranks, lambda comm: work(simulation.build(case, Path(), comm)))


def kept_again(sim: Simulation, case: schema.Case, folder: Path) -> Simulation:
    """Returns the simulation after a restart from a checkpoint; the case may differ in keys that a restart allows."""
    checkpoint.write(simulation.keep(sim), sim.case, folder, sim.clock.step, sim.clock.t, sim.comm)
    sim.free()
    place, manifest, _ = checkpoint.latest(folder)
    checkpoint.require_same(case, manifest)
    arrived = route(checkpoint.read(place, manifest, sim.comm), (1.0, 1.0, 1.0), sim.comm)
    resumed = simulation.resume(case, arrived, sim.comm, Timers(sim.comm, team(case.run.threads)))
    resumed.reduction.begin_again()
    return resumed
