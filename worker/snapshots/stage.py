"""Schedule of the snapshots.

For a snapshot the solver only copies its data (share.py). A side thread writes the copy (courier.py). All ranks make
the copy between the two halves of the same step, where frames are also written. Rank 0 requests the copy in the
reduction of the previous step.
"""

import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases import messages
from conoid.cases.model.boundaries import Wall
from conoid.cases.output import fields, layout

from ..clock import Clock
from ..output.journal import Journal
from ..simulation import Simulation
from .courier import Courier
from .share import copied

_APART = 1.0
"""Smallest wall time between two scheduled snapshots, s. Chosen value: users do not need more frequent snapshots."""
_SHARE = 1.0 / 200.0
"""Fraction of the time of a run that copies may take."""
_CROWDED = 1.0 / 20.0
"""Fraction of a core that the process that makes snapshots may use, if ranks use all cores. All ranks wait for the rank
on the core of this process. Chosen value: a run takes at most a twentieth longer, and a body of 150,000 tets still has
a snapshot every 6 s."""

_EARLY = 1e-6
"""Largest time by which a snapshot may be early, divided by the time between two snapshots. The largest time is far
above round-off."""


class Snapshots:
    """Snapshots of a run. ``journal``: None on all ranks except 0."""

    def __init__(self, sim: Simulation, folder: Path, journal: Journal | None) -> None:
        """Start with the number that follows that of the last snapshot in the journal. Collective."""
        self._folder, self._journal, self._case, self._comm = folder, journal, sim.case, sim.comm
        self._n: int = sim.comm.broadcast(journal.snapshots if journal is not None else 0)
        self._courier = Courier(folder, sim.comm.rank)
        self.next_time = math.inf
        """Simulated time before which no snapshot is scheduled, s. A user may request snapshots before the scheduled
        time."""
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
        """Return whether a snapshot of the next state must be made; only rank 0 calls this method.

        ``look``: True to check for a request of a user.
        """
        self._asked_for = self._asked_for or (look and (self._folder / layout.SNAPSHOT_REQUEST).exists())
        if self._courier.under_way:
            return False
        apart = pause(self._took, self._packed, crowded=self._crowded)
        return self._asked_for or (self._place(clock) >= self._next and now - self._taken >= apart)

    @property
    def asked_for(self) -> bool:
        """True if a snapshot is requested and not yet made."""
        return self._asked_for

    def look(self, sim: Simulation, *, due: bool, ending: bool) -> None:
        """Copy the present state if a snapshot is ``due``, or if the state is the first or the last state of the
        run.
        """
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
        """Write the messages about finished snapshots; only on rank 0."""
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
            values = {name: answer[name] for name in messages.Snapshot.__struct_fields__ if name in answer}
            values.update(step=answer["step"], t=answer["t"], blob=data)
            self._journal.write(messages.Snapshot, **values)

    def close(self) -> None:
        """Wait for the last snapshot and write the message about it.

        Collective. The waiting ranks do not use their cores, so the packer can use them.
        """
        self._courier.close()
        self.tell()
        self._comm.await_all()

    def _wait(self, place: int) -> None:
        """Set the number of the next of the evenly spaced times of snapshots. Also set the simulated time at which the
        step is compared with the time of the snapshot, which is slightly earlier.
        """
        self._next = place
        run = self._case.run
        if run.snapshots:
            self.next_time = (place - _EARLY) / run.snapshots * run.end_time

    def _place(self, clock: Clock) -> int:
        """Return the number of evenly spaced times of snapshots that have been reached."""
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
        walls = sim.walls.places(len(sim.case.boundaries_of(Wall)))
        return {
            "n": self._n, "step": clock.step, "t": clock.t, "ranks": sim.comm.size, "parts": sim.model.parts,
            "end": run.end_time, "frames": run.frames, "cause": cause, "dropped": passed,
            "walls": [] if walls is None else walls.tolist(),
        }  # fmt: skip


def pause(copying: float, packing: float, *, crowded: bool) -> float:
    """Return the wall time between two snapshots, s.

    ``copying``: wall time of the last copy in the solver, s; ``packing``: CPU time of the process that makes the
    snapshots, s; ``crowded``: True if no core is free for this process.
    """
    return max(_APART, copying / _SHARE, packing / _CROWDED if crowded else 0.0)


def _clear(folder: Path, n: int) -> None:
    """Remove files of a killed worker. Also remove snapshots with numbers from ``n`` on, which are not in the
    journal.
    """
    place = folder / layout.SNAPSHOTS
    place.mkdir(exist_ok=True)
    for path in place.iterdir():
        if path.suffix not in {".snap", layout.TETS_SUFFIX} or not path.stem.isdigit() or int(path.stem) >= n:
            path.unlink(missing_ok=True)
