"""history.csv: one line per sample: clock, ledger, momentum, probes."""

import csv
from pathlib import Path

import msgspec

from conoid.cases import layout
from conoid.cases.messages import Energy

_CLOCK = ["step", "t", "dt", "limiter"]
_MOMENTUM = ["momentum_x", "momentum_y", "momentum_z"]


class History:
    """Writes the lines, flushed one by one, behind those that are there."""

    def __init__(self, folder: Path, probes: list[str]) -> None:
        path = folder / layout.HISTORY
        new = not path.exists()
        self._file = path.open("a", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        if new:
            self._writer.writerow([*_CLOCK, *Energy.__struct_fields__, *_MOMENTUM, *probes])

    def write(self, step: int, t: float, dt: float, limiter: str, energy: Energy, extra: list[float]) -> None:
        """One line; ``extra`` is momentum and probes. Numbers are written so that they read back to the same bits."""
        values = [*msgspec.structs.astuple(energy), *extra]
        self._writer.writerow([step, repr(t), repr(dt), limiter, *(repr(float(v)) for v in values)])
        self._file.flush()

    def close(self) -> None:
        """Closes the file."""
        self._file.close()
