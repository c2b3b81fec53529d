"""Times at which fragments were formed. The times are read from the genealogy of the fragments, to which each frame of
a run adds lines.
"""

from pathlib import Path

import numpy as np

from conoid.cases.output import fragments

from ..model.state import Floats, Ints


class Births:
    """Reader of the genealogy of a run, while the run writes the genealogy."""

    def __init__(self, folder: Path, end: float, frames: int) -> None:
        """``folder``: folder of the run; ``frames``: number of frames up to the time ``end``, s."""
        self._folder, self._end, self._frames = folder, end, frames
        self._known: dict[int, float] = {}
        self._read = 0

    def at(self, t: float, numbers: Ints, initial: int, *, kept: bool = True) -> Floats:
        """Return (g,) the times, s, at which fragments ``numbers`` were formed.

        The time of a fragment is that of the first frame up to time ``t`` that contains it, or ``t`` if there is no
        such frame. The ``initial`` fragments have the time 0. ``kept``: True if the run records fragments. If ``kept``
        is False, the time of all other fragments is NaN.
        """
        if not kept:
            return np.where(numbers < initial, 0.0, np.nan)
        self._catch_up()
        born = {number: time for number, time in self._known.items() if time <= t}
        return np.array([0.0 if number < initial else born.get(number, t) for number in numbers.tolist()])

    def _catch_up(self) -> None:
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
        """Return the time of a frame, which is equal to Clock.frame_time."""
        return self._end * (frame / self._frames) if frame < self._frames else self._end
