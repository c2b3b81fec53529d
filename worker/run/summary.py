"""The outcome of a run. The module collects the reason of the end, the sizes, the costs, the results and the warnings
of a run from all ranks.
"""

import math
import resource
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.estimates.stages import without
from conoid.cases.outcome import Made, Measured, Outcome, Sharing
from conoid.cases.reading.quantities import FIELD_UNITS
from conoid.cases.run import Cause, State
from conoid.cases.warnings.compression import borne

from ..accounts import digest
from ..accounts.timers import Spent, by_phase
from ..contact.checks import common_volume, inside
from ..errors import PhysicsError
from ..gauges import reference, unreached, unstrained
from ..model.state import Ints
from ..output.counts import fragments, of_bodies
from ..output.history import extremes
from ..parallel.projecting import Projecting
from ..parallel.team import team
from ..simulation import Simulation
from .loop import Loop, Start
from .stops import STOPS, reason

_UNKNOWN = (math.nan, math.nan)


@dataclass(frozen=True)
class Times:
    """Times of a run on this rank, s."""

    cpu: float
    """CPU time of the time loop, including the other threads of the rank, s."""
    setup: float
    """Wall time before the time loop, s."""
    elapsed: float
    """Wall time of the whole run, s."""


def sum_up(loop: Loop, folder: Path, failure: PhysicsError | None, start: Start, times: Times) -> Outcome:
    """Return the outcome of a run in ``folder`` that has ended. ``failure``: the error that ended the run, or None.

    Collective.
    """
    sim, complete = loop.sim, failure is None and not loop.stopped
    sim.timers.since_last()
    costs = _costs(loop, start, times)
    more = sim.walls.words() + (sim.rigid.words() if sim.rigid is not None else b"")
    hexdigest = digest.digest(sim.model, sim.comm, sim.elements.nodal, more)
    checks = reference.measure(sim, folder, start.thick) if complete else []
    eroded = start.elements - sim.model.elements_global
    sim.count_nodes()
    count, labels = fragments(sim)
    contact, warnings = _penetration(sim, labels if sim.record is not None else of_bodies(sim))
    compressed = sim.crushing.found() if sim.crushing is not None else []
    stiff = list(unstrained.found(sim, folder, eroded)) if complete else []
    short = list(unreached.found(sim)) if complete else []
    return Outcome(
        **_end(loop, failure), **costs, **contact, digest=hexdigest or "",
        steps=sim.clock.step, time=sim.clock.t, elements=start.elements, eroded=eroded,
        eroded_mass=sim.ledger.eroded_mass, nodes_initial=start.nodes, nodes=sim.model.nodes_global,
        fragments=count, broken=sim.fracture.broken if sim.fracture is not None else 0,
        first_break=sim.fracture.first if sim.fracture is not None else math.nan,
        energy=loop.samples.energy, worst_residual=sim.ledger.worst,
        made=[Made(line=name, share=made.share, time=made.t) for name, made in sim.ledger.making.ranked()],
        compressed=compressed, without=without(sim.case), reference=checks, probes=_probes(loop, folder),
        warnings=[*borne(compressed), *start.warnings, *_warnings(loop, eroded), *warnings, *short, *stiff],
    )  # fmt: skip


def _end(loop: Loop, failure: PhysicsError | None) -> dict[str, Any]:
    """Return state, cause and message for the end of the run."""
    state: State = State.SUCCEEDED
    cause: Cause | None = None
    message = ""
    if loop.stopped:
        state, cause, message = *STOPS[loop.stopped][:2], reason(loop.sim, loop.stopped)
    if failure is not None:
        state, cause, message = State.FAILED, failure.cause, str(failure)
    return {"state": state, "cause": cause, "message": message}


def _costs(loop: Loop, start: Start, times: Times) -> dict[str, Any]:
    """Return the times and the memory that the run has used. If a quantity differs between ranks, the result has one
    number for each rank.
    """
    sim = loop.sim
    spent: list[Spent] = sim.comm.gather(sim.timers.spent) or []
    cpu = sum(sim.comm.gather(times.cpu) or [])
    memory = sim.comm.gather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    projected = sim.timers.spent.projected
    return {
        "ranks": sim.comm.size, "threads": sim.case.run.threads, "elapsed": times.elapsed, "setup": times.setup,
        "cpu": cpu, "peak_memory": memory or [],
        "element_updates_per_second": (loop.updates - start.updates) / cpu if cpu > 0.0 else 0.0,
        "rebalances": loop.balance.events, "balancing_cost": loop.balance.spent, "balancing_saved": loop.balance.saved,
        "phases": by_phase([each.cpu for each in spent]), "serial": by_phase([each.serial for each in spent]),
        "parallel": by_phase([each.parallel for each in spent]), "helped": [each.helped for each in spent],
        "projected": {crew: by_phase([each.projected[crew] for each in spent]) for crew in projected},
        "sharing": _sharing(sim),
    }  # fmt: skip


def _sharing(sim: Simulation) -> Sharing | None:
    """Return the number of parallel regions and the number of tasks of this rank, if the costs of parallel regions were
    measured.
    """
    made = team(sim.case.run.threads).projecting
    if not isinstance(made, Projecting):
        return None
    costs = made.costs
    return Sharing(
        steps=max(sim.clock.step, 1), regions=made.regions, colours=made.colours, tasks=made.tasks,
        turn=1e-9 * costs.turn, call=1e-9 * costs.call, wake=1e-9 * costs.wake,
    )  # fmt: skip


def _penetration(sim: Simulation, labels: list[Ints]) -> tuple[dict[str, Any], list[str]]:
    """Return three things: the number of nodes inside of other bodies, the common volume of bodies, and warnings about
    penetration.
    """
    if sim.contact is None:
        return {}, []
    nodes = inside.look(sim.contact, sim.model, labels, sim.comm)
    common = common_volume.measure(sim.contact, sim.model, labels, sim.comm)
    found = {
        "inside": nodes.nodes, "deepest": nodes.deepest, "overlapping": common.large, "overlap": common.share,
    }  # fmt: skip
    return found, [*nodes.warnings, *common.warnings, *sim.contact.sweep_count.warnings]


def _probes(loop: Loop, folder: Path) -> list[Measured]:
    """Return the last value of each probe. On rank 0, also return the extremes of each probe in the whole history."""
    probes = loop.sim.case.probes
    ends = extremes(folder, [probe.name for probe in probes]) if loop.sim.comm.rank == 0 else {}
    found = []
    for probe, value in zip(probes, loop.samples.measured, strict=False):
        least, most = ends.get(probe.name, _UNKNOWN)
        found.append(Measured(name=probe.name, value=value, unit=FIELD_UNITS[probe.field], least=least, most=most))
    return found


def _warnings(loop: Loop, eroded: int) -> list[str]:
    """Return the warnings that occurred in steps; ``eroded``: number of removed tets."""
    sim = loop.sim
    return [
        *loop.warnings, *loop.frames.lost, *sim.ledger.warnings(sim.case.numerics.dt_safety),
        *(sim.erosion.warnings(eroded) if sim.erosion is not None else []),
        *(sim.fracture.warnings if sim.fracture is not None else []),
    ]  # fmt: skip
