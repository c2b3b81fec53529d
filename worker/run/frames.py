"""Frames of a run. The module writes the files of the whole field and the messages about them. The module gives a
warning if files of frames were removed.
"""

from pathlib import Path

from conoid.cases import messages

from ..output import frames
from ..output.counts import Counter
from ..output.damage import damage
from ..output.losses import Losses
from ..output.wanted import wanted
from ..simulation import Simulation
from .notices import Notices


class Frames:
    """Writes the frames of a run. Every method is collective except ``report_losses``."""

    def __init__(self, folder: Path, notices: Notices, counter: Counter) -> None:
        """``folder``: folder of the run; ``counter``: object that finds the fragments of a frame."""
        self._folder, self._notices, self._counter = folder, notices, counter
        self._losses = Losses(folder) if notices.journal is not None else None
        self.lost: list[str] = []
        """Warnings about output files that were removed during the run; only on rank 0."""

    def write(self, sim: Simulation) -> None:
        """Write the frame of the present time. Write also the message of the frame, unless the journal already has
        it.
        """
        clock, index, journal = sim.clock, sim.clock.frame, self._notices.journal
        sim.count_nodes()
        self.report_losses(sim)
        path = self._written(sim, index)
        self.report_losses(sim)  # from now on a removal of the new file is detected
        clock.frame += 1
        if path is not None and journal is not None and index not in journal.frames:
            journal.frames.add(index)
            self._notices.write(clock, messages.Frame, index=index, path=path)

    def _written(self, sim: Simulation, index: int) -> str | None:
        """Write the frame file and the record of the fragments. Return the path of the file in the run's folder on rank
        0.
        """
        t, record = sim.clock.t, sim.record
        cohesion = sim.fracture.cohesion if sim.fracture is not None else None
        damaged = damage(sim.case, sim.model, cohesion, sim.comm)
        more = wanted(sim, index)
        if record is None:
            return frames.write(self._folder, index, t, sim.model, sim.comm, None, damaged, more)
        self._counter.find(sim)
        record.number()
        path = frames.write(self._folder, index, t, sim.model, sim.comm, record.numbers, damaged, more)
        record.write(self._folder, index, t)
        return path

    def report_losses(self, sim: Simulation) -> None:
        """Write warnings about output files that have been removed since the last call."""
        for text in self._losses.found() if self._losses is not None else ():
            self.lost.append(text)
            self._notices.write(sim.clock, messages.Log, level="warning", text=text)
