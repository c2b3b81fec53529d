"""When fragments came into being, as the frames of a run tell."""

from pathlib import Path

import numpy as np

from conoid.cases import fragments

from ..state import Floats, Ints


class Births:
    """Reads the genealogy of a run as it grows."""

    def __init__(self, folder: Path, end: float, frames: int) -> None:
        """Of the run in ``folder`` with so many ``frames`` up to the time ``end``, s."""
        self._folder, self._end, self._frames = folder, end, frames
        self._known: dict[int, float] = {}
        self._read = 0

    def at(self, t: float, labels: Ints, first: Ints) -> Floats:
        """(g,) s, of fragments ``labels`` at time ``t``: the first frame up to then that has them, or ``t`` itself.

        0 for what was there at the start: the fragments of frame 0, or without frames the ``first`` tets of the parts.
        """
        self._catch_up()
        self._known = self._known or dict.fromkeys(first.tolist(), 0.0)
        born = {label: time for label, time in self._known.items() if time <= t}
        return np.array([born.get(label, t) for label in labels.tolist()])

    def _catch_up(self) -> None:
        start = fragments.path(self._folder, 0)
        if not self._known and start.exists():  # before any other frame
            self._known = {int(row["label"]): 0.0 for row in fragments.read(start)}
        path = fragments.genealogy(self._folder)
        if not path.exists():
            return
        with path.open("rb") as file:
            file.seek(self._read)
            whole = file.read()
        whole = whole[: whole.rfind(b"\n") + 1]
        self._read += len(whole)
        for line in whole.splitlines():
            frame, _, child, _ = line.split(b",")
            if frame.isdigit():
                self._known.setdefault(int(child), self._time(int(frame)))

    def _time(self, frame: int) -> float:
        """As Clock.frame_time."""
        return self._end * (frame / self._frames) if frame < self._frames else self._end
