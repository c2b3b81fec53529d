"""From a case to an outcome, with the kernels loaded: build, advance, run the outputs, sum up."""

import logging
import math
import resource
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from conoid.cases import messages
from conoid.cases.estimates.stages import without
from conoid.cases.model.joined import bodies
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Made, Measured, Outcome, Sharing
from conoid.cases.output.checkpoints import Manifest
from conoid.cases.output.history import of_parts
from conoid.cases.reading.quantities import FIELD_UNITS
from conoid.cases.run import State
from conoid.cases.warnings.compression import borne

from .. import simulation
from ..accounts import digest
from ..accounts.timers import Timers, by_phase
from ..contact import common_volume
from ..contact.inside import look
from ..errors import InputError, PhysicsError
from ..gauges import reference, unstrained
from ..kernels.jit import cpu_time
from ..kernels.preload import preload
from ..migration import checkpoint
from ..migration.balance import Balance
from ..migration.route import route
from ..output import rewind
from ..output.history import History, extremes
from ..output.journal import Journal
from ..parallel.choice import Choice
from ..parallel.comm import Comm
from ..parallel.projecting import Projecting
from ..parallel.team import team
from ..scene.assembly import quiet
from ..simulation import Simulation
from .loop import STOPS, Loop, Start
from .signals import Signals

CHOSEN, ALL, PROJECT = "chosen", "all", "project"
"""What is done with the threads of a rank."""

_UNKNOWN = (math.nan, math.nan)

log = logging.getLogger("conoid.worker")


def compute(
    case: Case, meshes: Path, folder: Path, comm: Comm, journal: Journal | None, signals: Signals, began: float,
    restart: bool, use: str = CHOSEN,
) -> Outcome:  # fmt: skip
    """Runs the case in ``folder`` on all ranks; relative mesh paths start at ``meshes``.

    With ``restart`` from the latest checkpoint that is there. ``use`` of the threads: CHOSEN, as many
    as make it faster; ALL; PROJECT, one, and what more would take is in the outcome. Raises ConoidError.
    """
    say = journal.starting if journal is not None else quiet
    threads = team(case.run.threads)  # of a process that may have had other runs
    threads.most = threads.threads
    threads.projecting = Projecting(threads.threads) if use == PROJECT else None
    if comm.size > 1:
        preload(case)
    if restart:
        say("reading the latest checkpoint")
        sim, start = _resumed(case, folder, comm, journal)
    else:
        sim = simulation.build(case, meshes, comm, say)
        thick = reference.thicknesses(sim)
        start = Start(sim.model.elements_global, sim.model.nodes_global, thick, warnings=sim.warnings)
    if comm.rank == 0:
        rewind.rewind(folder, sim.clock.step, sim.clock.frame)
        checkpoint.forget(folder, sim.clock.step)
    probes = {probe.name: FIELD_UNITS[probe.field] for probe in case.probes}
    columns = {**of_parts(sim.model.parts), **probes}
    history = History(folder, columns) if comm.rank == 0 else None
    setup = time.monotonic() - began
    _announce(sim, journal, setup)
    loop = Loop(sim, folder, journal, history, signals, Balance.of(sim), start)
    if use == CHOSEN and threads.threads > 1:
        loop.choice = Choice(threads)
    cpu = cpu_time() + threads.helped
    failure = None
    try:
        loop.run()
    except PhysicsError as error:
        failure = error
    cpu = cpu_time() + threads.helped - cpu
    loop.sim.free()
    if comm.rank == 0 and failure is None and not loop.stopped:
        checkpoint.forget(folder)
    if history is not None:
        history.close()
    outcome = _sum_up(loop, folder, failure, start, cpu, setup, time.monotonic() - began)
    loop.snapshots.close()
    return outcome


def _resumed(case: Case, folder: Path, comm: Comm, journal: Journal | None) -> tuple[Simulation, Start]:
    """The run in ``folder`` as its latest checkpoint that is whole has it; all ranks take part. The journal gets a
    warning of each later one, which is damaged. Raises InputError on all alike.
    """
    found: tuple[Path, Manifest] | None = None
    failure: InputError | None = None
    if comm.rank == 0:
        try:
            place, manifest, damaged = checkpoint.latest(folder)
            _warn(journal, damaged)
            checkpoint.require_same(case, manifest)
            found = place, manifest
        except InputError as error:
            failure = error
    found, failure = comm.broadcast((found, failure))
    if failure is not None:
        raise failure
    assert found is not None
    place, manifest = found
    parcel = checkpoint.read(place, manifest, comm)
    timers = Timers(comm, team(case.run.threads))
    sim = simulation.resume(case, route(parcel, case.run.cut_scale, comm), comm, timers)
    sim.reduction.begin_again()
    log.info("goes on from %s, step %d, t %.6g s", place.name, sim.clock.step, sim.clock.t)
    return sim, replace(Start(**parcel.known["start"]), resumed=True)


def _warn(journal: Journal | None, texts: Sequence[str]) -> None:
    for text in texts:
        log.warning(text)
        if journal is not None:
            journal.write(messages.Log, level="warning", text=text)


def _announce(sim: Simulation, journal: Journal | None, setup: float) -> None:
    """Reports how large the model is and how it is spread; all ranks take part."""
    model, nodes = sim.model, sim.model.nodes
    sizes = np.zeros(len(model.parts), np.int64)
    for block in model.blocks:
        sizes[block.part] += block.n
    log.info("%d tets, %d nodes here; set-up %.2f s", sizes.sum(), nodes.n, setup)
    parts = dict(zip(model.parts, (int(n) for n in sim.comm.sum(sizes)), strict=True))
    flat = int(sim.comm.sum(np.array([sum(int(block.flat.sum()) for block in model.blocks)]))[0])
    if journal is None:
        return
    if flat:
        journal.write(messages.Log, level="info", text=f"{flat} flat tets have a pressure of their own")
    for text in (*sim.warnings, *(sim.fracture.warnings if sim.fracture is not None else [])):
        journal.write(messages.Log, level="warning", text=text)
    journal.write(messages.Status, state=State.RUNNING)
    journal.write(
        messages.Started, ranks=sim.comm.size, elements=model.elements_global, nodes=model.nodes_global,
        end_time=sim.case.run.end_time, setup=setup, parts=parts, threads=sim.case.run.threads,
    )  # fmt: skip


def _sharing(sim: Simulation) -> Sharing | None:
    """Of what regions are made on this rank, where that was asked for."""
    made = team(sim.case.run.threads).projecting
    if not isinstance(made, Projecting):
        return None
    costs = made.costs
    return Sharing(
        steps=max(sim.clock.step, 1), regions=made.regions, colours=made.colours, tasks=made.tasks,
        turn=1e-9 * costs.turn, call=1e-9 * costs.call, wake=1e-9 * costs.wake,
    )  # fmt: skip


def _probes(loop: Loop, folder: Path) -> list[Measured]:
    """Their last values, and on rank 0 the extremes of the history, which one that was restarted goes on writing."""
    probes = loop.sim.case.probes
    ends = extremes(folder, [probe.name for probe in probes]) if loop.sim.comm.rank == 0 else {}
    found = []
    for probe, value in zip(probes, loop.measured, strict=False):
        least, most = ends.get(probe.name, _UNKNOWN)
        found.append(Measured(name=probe.name, value=value, unit=FIELD_UNITS[probe.field], least=least, most=most))
    return found


def _sum_up(
    loop: Loop,
    folder: Path,
    failure: PhysicsError | None,
    start: Start,
    cpu: float,
    setup: float,
    elapsed: float,
) -> Outcome:
    sim = loop.sim
    sim.timers.since_last()
    spent = sim.comm.gather(sim.timers.spent)
    total_cpu = sum(sim.comm.gather(cpu) or [])
    memory = sim.comm.gather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    more = sim.walls.words() + (sim.rigid.words() if sim.rigid is not None else b"")
    hexdigest = digest.digest(sim.model, sim.comm, sim.elements.nodal, more)
    checks = reference.measure(sim, folder, start.thick) if failure is None and not loop.stopped else []
    eroded = start.elements - sim.model.elements_global
    sim.count_nodes()
    body = np.array(bodies(sim.case))
    fragments, labels = len(np.unique(body)), [np.full(block.n, body[block.part]) for block in sim.model.blocks]
    if sim.record is not None:
        sim.record.look()
        fragments, labels = sim.record.count, sim.record.labels
    inside = look(sim.contact, sim.model, labels, sim.comm) if sim.contact else None
    common = common_volume.measure(sim.contact, sim.model, labels, sim.comm) if sim.contact else None
    compressed = sim.crushing.found() if sim.crushing is not None else []
    stiff = list(unstrained.told(sim, folder, eroded)) if failure is None and not loop.stopped else []
    state, cause, message = State.SUCCEEDED, None, ""
    if loop.stopped:
        state, cause, message = *STOPS[loop.stopped][:2], loop.reason()
    if failure is not None:
        state, cause, message = State.FAILED, failure.cause, str(failure)
    return Outcome(
        state=state, cause=cause, message=message, steps=sim.clock.step, time=sim.clock.t, ranks=sim.comm.size,
        elapsed=elapsed, setup=setup, cpu=total_cpu, digest=hexdigest or "", elements=start.elements,
        eroded=eroded, eroded_mass=sim.ledger.eroded_mass,
        nodes_initial=start.nodes, nodes=sim.model.nodes_global, fragments=fragments,
        broken=sim.fracture.broken if sim.fracture is not None else 0,
        inside=inside.nodes if inside else 0, deepest=inside.deepest if inside else 0.0,
        overlapping=common.large if common else 0, overlap=common.share if common else 0.0, energy=loop.energy,
        worst_residual=sim.ledger.worst,
        made=[Made(line=name, share=made.share, time=made.t) for name, made in sim.ledger.making.ranked()],
        compressed=compressed,
        rebalances=loop.balance.events, balancing_cost=loop.balance.spent,
        balancing_saved=loop.balance.saved,
        threads=sim.case.run.threads, phases=by_phase([each.cpu for each in spent or []]),
        serial=by_phase([each.serial for each in spent or []]),
        parallel=by_phase([each.parallel for each in spent or []]), helped=[each.helped for each in spent or []],
        projected={
            crew: by_phase([each.projected[crew] for each in spent or []]) for crew in sim.timers.spent.projected
        }, sharing=_sharing(sim),
        without=without(sim.case), peak_memory=memory or [],
        element_updates_per_second=(loop.updates - start.updates) / total_cpu if total_cpu > 0.0 else 0.0,
        reference=checks,
        probes=_probes(loop, folder),
        warnings=[
            *borne(compressed), *start.warnings, *loop.warnings, *loop.lost,
            *sim.ledger.warnings(sim.case.numerics.dt_safety),
            *(sim.erosion.warnings(eroded) if sim.erosion is not None else []),
            *(sim.fracture.warnings if sim.fracture is not None else []), *(inside.warnings if inside else []),
            *(common.warnings if common else []), *(sim.contact.need.warnings if sim.contact else []), *stiff,
        ],
    )  # fmt: skip
