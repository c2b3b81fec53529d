"""history.csv: one line per sample: clock, ledger, momentum, probes. At its end the same as history.parquet, where
pyarrow is there.
"""

import csv
from collections.abc import Mapping
from pathlib import Path

import msgspec

from conoid.cases import history, layout
from conoid.cases.messages import Energy


class History:
    """Writes the lines, flushed one by one, behind those that are there."""

    def __init__(self, folder: Path, probes: Mapping[str, str]) -> None:
        """``probes``: names of further columns, with their units."""
        self._path = folder / layout.HISTORY
        new = not self._path.exists()
        self._file = self._path.open("a", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        if new:
            self._writer.writerow(history.header({**history.COLUMNS, **probes}))

    def write(self, step: int, t: float, dt: float, limiter: str, energy: Energy, extra: list[float]) -> None:
        """One line; ``extra`` is momentum and probes. Numbers are written so that they read back to the same bits."""
        values = [*msgspec.structs.astuple(energy), *extra]
        self._writer.writerow([step, repr(t), repr(dt), limiter, *(repr(float(v)) for v in values)])
        self._file.flush()

    def close(self) -> None:
        """Closes the file, and writes it as Parquet where that can be."""
        self._file.close()
        write_parquet(self._path)


def write_parquet(path: Path) -> Path | None:
    """A history as Parquet beside it, with the unit of each column in its metadata; None where pyarrow is missing."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        return None
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    kinds = {"step": (pyarrow.int64(), int), "limiter": (pyarrow.string(), str)}
    fields, arrays = [], []
    for at, (name, unit) in enumerate(map(history.split, head)):
        kind, read = kinds.get(name, (pyarrow.float64(), float))
        fields.append(pyarrow.field(name, kind, metadata={"unit": unit} if unit else None))
        arrays.append(pyarrow.array([read(row[at]) for row in rows], kind))
    target = path.with_name(layout.HISTORY_PARQUET)
    beside = target.with_suffix(".part")
    parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields)), beside)
    beside.rename(target)
    return target
