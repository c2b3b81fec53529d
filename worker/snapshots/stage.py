"""When a snapshot is due, and what it costs the solver: a copy (``share``), which a side thread takes (``courier``).

All ranks copy between the same two halves of a step, where frames are written too: rank 0 asks in the reduction of the
step before.
"""

import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases import messages
from conoid.cases.output import fields, layout

from ..clock import Clock
from ..output.journal import Journal
from ..simulation import Simulation
from .courier import Courier
from .share import copied

_APART = 1.0
"""s of wall time between two that are due by simulated time. Chosen: as often as people look."""
_SHARE = 1.0 / 200.0
"""Of the time of a run that copies may take."""
_CROWDED = 1.0 / 20.0
"""The same of a core, for the process that makes snapshots, where ranks have all cores: all wait for the one that
shares its core. Chosen: a run takes a twentieth longer at most, and a body of 150,000 tets is still seen every 6 s."""

_EARLY = 1e-6
"""Of the time between two snapshots: far more than what rounding does."""


class Snapshots:
    """The snapshots of a run; ``journal`` exists on rank 0 only."""

    def __init__(self, sim: Simulation, folder: Path, journal: Journal | None) -> None:
        """All ranks take part; numbers go on from those in the journal."""
        self._folder, self._journal, self._case, self._comm = folder, journal, sim.case, sim.comm
        self._n: int = sim.comm.broadcast(journal.snapshots if journal is not None else 0)
        self._courier = Courier(folder, sim.comm.rank)
        self.next_time = math.inf
        """Until then, in simulated time, s, none is due but one that is asked for."""
        self._wait(self._place(sim.clock) + 1)
        self._taken = self._took = self._packed = 0.0
        self._crowded = len(os.sched_getaffinity(0)) <= sim.comm.size
        self._dropped = 0
        self._asked_for = False
        self._counting = fields.counting(sim.case)
        if sim.comm.rank == 0:
            _clear(folder, self._n)
        sim.comm.barrier()

    def due(self, clock: Clock, now: float, *, look: bool) -> bool:
        """Whether one is to be made of the next state; asked on rank 0. ``look``: whether somebody asks for one."""
        self._asked_for = self._asked_for or (look and (self._folder / layout.SNAPSHOT_REQUEST).exists())
        if self._courier.under_way:
            return False
        apart = pause(self._took, self._packed, crowded=self._crowded)
        return self._asked_for or (self._place(clock) >= self._next and now - self._taken >= apart)

    @property
    def asked_for(self) -> bool:
        """Whether somebody has asked for one that is not made yet."""
        return self._asked_for

    def look(self, sim: Simulation, *, due: bool, ending: bool) -> None:
        """Gives away a copy of the present state when one is due, or when it is the first or the last."""
        wanted = self._case.run.snapshots > 0
        first = wanted and sim.clock.step == 0
        if not (due or first or (wanted and ending)):
            return
        began = time.monotonic()
        cohesion = sim.fracture.cohesion if sim.fracture is not None else None
        held = cohesion.facets.tets if cohesion is not None else np.zeros((0, 2), np.int64)
        known = (sim.record.of_frame(), (sim.record.initial, sim.record.next)) if sim.record is not None else ()
        given = copied(sim.model, held, self._counting, *known)
        self._courier.send(self._task(sim, first=first, ending=ending), given)
        self._n += 1
        self._taken = time.monotonic()
        self._took = self._taken - began

    def tell(self) -> None:
        """Reports those that have been made since the last call; on rank 0."""
        answers = self._courier.answers
        while answers:
            answer, data = answers.popleft()
            self._courier.under_way -= 1
            if self._journal is None:
                continue
            if "error" in answer:
                self._dropped += 1 + answer["dropped"]
                text = f"snapshot {answer['n']} was not made: {answer['error']}"
                self._journal.write(messages.Log, answer["step"], answer["t"], level="warning", text=text)
                continue
            self._packed = answer["cpu"]
            told = {name: answer[name] for name in messages.Snapshot.__struct_fields__ if name in answer}
            told.update(step=answer["step"], t=answer["t"], blob=data)
            self._journal.write(messages.Snapshot, **told)

    def close(self) -> None:
        """Waits for the last, and reports it; all ranks take part, and leave their cores to it."""
        self._courier.close()
        self.tell()
        self._comm.await_all()

    def _wait(self, place: int) -> None:
        """The next one is due at the evenly spaced time of that number; a little earlier it is asked whether it is."""
        self._next = place
        run = self._case.run
        if run.snapshots:
            self.next_time = (place - _EARLY) / run.snapshots * run.end_time

    def _place(self, clock: Clock) -> int:
        """How many evenly spaced times have come."""
        run = self._case.run
        return math.floor(clock.t / run.end_time * run.snapshots) if run.snapshots else -1

    def _task(self, sim: Simulation, *, first: bool, ending: bool) -> dict[str, Any]:
        clock, run = sim.clock, sim.case.run
        cause = "asked for" if self._asked_for else "start" if first else "end" if ending else "run.snapshots"
        if sim.comm.rank == 0 and self._asked_for:
            (self._folder / layout.SNAPSHOT_REQUEST).unlink(missing_ok=True)
        self._asked_for = False
        place = self._place(clock)
        passed = max(0, place - self._next) + self._dropped
        self._wait(max(self._next, place + 1))
        self._dropped = 0
        return {
            "n": self._n, "step": clock.step, "t": clock.t, "ranks": sim.comm.size, "parts": sim.model.parts,
            "end": run.end_time, "frames": run.frames, "cause": cause, "dropped": passed,
        }  # fmt: skip


def pause(copying: float, packing: float, *, crowded: bool) -> float:
    """Wall time between two snapshots, s, of which the last took the solver ``copying``, s of wall time, and the
    process that makes them ``packing``, s of CPU time; ``crowded``: no core is left to that.
    """
    return max(_APART, copying / _SHARE, packing / _CROWDED if crowded else 0.0)


def _clear(folder: Path, n: int) -> None:
    """Takes away what a killed worker left behind, and snapshots from ``n`` on, of which the journal does not tell."""
    place = folder / layout.SNAPSHOTS
    place.mkdir(exist_ok=True)
    for path in place.iterdir():
        if path.suffix not in {".snap", layout.TETS_SUFFIX} or not path.stem.isdigit() or int(path.stem) >= n:
            path.unlink(missing_ok=True)
