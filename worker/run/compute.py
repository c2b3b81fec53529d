"""Execution of a run from its case to its outcome. The module builds or resumes the simulation, runs the time loop, and
makes the outcome.
"""

import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from conoid.cases import messages
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Outcome
from conoid.cases.output.checkpoints import Manifest
from conoid.cases.output.history import of_parts
from conoid.cases.reading.quantities import FIELD_UNITS
from conoid.cases.run import State

from .. import simulation
from ..accounts.timers import Timers
from ..errors import InputError, PhysicsError
from ..gauges import reference
from ..kernels.jit import cpu_time
from ..kernels.preload import preload
from ..migration import checkpoint
from ..migration.balance import Balance
from ..migration.route import route
from ..output import rewind
from ..output.history import History
from ..output.journal import Journal
from ..parallel.choice import Choice
from ..parallel.comm import Comm
from ..parallel.projecting import Projecting
from ..parallel.team import team
from ..scene.assembly import quiet
from ..simulation import Simulation
from .loop import Loop, Start
from .signals import Signals
from .summary import Times, sum_up

CHOSEN, ALL, PROJECT = "chosen", "all", "project"
"""Choices for the use of the threads of a rank. The function ``compute`` describes each choice."""

log = logging.getLogger("conoid.worker")


def compute(
    case: Case, meshes: Path, folder: Path, comm: Comm, journal: Journal | None, signals: Signals, began: float,
    restart: bool, use: str = CHOSEN,
) -> Outcome:  # fmt: skip
    """Runs the case in ``folder`` and returns its outcome. Collective.

    ``meshes``: folder to which the paths of mesh files are relative; ``restart``: True to resume from the latest
    checkpoint; ``use``: use of the threads. CHOSEN: as many threads as make the run faster. ALL: all threads. PROJECT:
    one thread, and the outcome has the estimated time with more threads. Raises ConoidError.
    """
    say = journal.starting if journal is not None else quiet
    threads = team(case.run.threads)  # an earlier run may have changed the settings of the team
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
        start = _rewound(folder, sim, journal, start)
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
    outcome = sum_up(loop, folder, failure, start, Times(cpu, setup, time.monotonic() - began))
    loop.snapshots.close()
    return outcome


def _resumed(case: Case, folder: Path, comm: Comm, journal: Journal | None) -> tuple[Simulation, Start]:
    """Returns the simulation of the latest complete checkpoint in ``folder``.

    Collective. If later checkpoints exist, they are damaged, and the journal gets a warning for each of them. Raises
    InputError on all ranks.
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
    log.info("continues from %s, step %d, t %.6g s", place.name, sim.clock.step, sim.clock.t)
    return sim, replace(Start(**parcel.known["start"]), resumed=True)


def _rewound(folder: Path, sim: Simulation, journal: Journal | None, start: Start) -> Start:
    """Removes output that an earlier process wrote after the step at which this process starts, including lines of the
    history. Returns ``start``, with a warning if lines of the history are missing.
    """
    lost = rewind.lost(rewind.rewind(folder, sim.clock.step, sim.clock.frame), start.lines)
    checkpoint.forget(folder, sim.clock.step)
    _warn(journal, lost)
    return replace(start, warnings=(*start.warnings, *lost))


def _warn(journal: Journal | None, texts: Sequence[str]) -> None:
    for text in texts:
        log.warning(text)
        if journal is not None:
            journal.write(messages.Log, level="warning", text=text)


def _announce(sim: Simulation, journal: Journal | None, setup: float) -> None:
    """Reports the size of the model and the distribution of its tets over the ranks. Collective."""
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
