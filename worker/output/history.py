"""The table history.csv. Each sample is one line, with clock, energy ledger, momenta, parts and probes. At the end of
the run the same data is written to history.parquet, if pyarrow is installed.
"""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from conoid.cases.messages import Energy
from conoid.cases.output import history, layout
from conoid.cases.reading import whole

from . import storage


class History:
    """Appends lines to history.csv and flushes each line."""

    def __init__(self, folder: Path, further: Mapping[str, str]) -> None:
        """``further``: names of the columns of parts and probes, with their units. If an earlier attempt of the run has
        written the file, its columns are kept.
        """
        self._path = folder / layout.HISTORY
        head = history.header({**history.COLUMNS, **further})
        there = _head(self._path) or head
        self._places = [k for k, name in enumerate(head) if name in there]
        self._file = io.TextIOWrapper(io.BufferedWriter(whole.appended(self._path)), "utf-8", newline="")
        self._writer = csv.writer(self._file)
        if not self._path.stat().st_size:
            self._writer.writerow(head)

    def write(self, step: int, t: float, dt: float, limiter: str, energy: Energy, extra: list[float]) -> None:
        """Write one line. ``extra``: momenta, values of parts, and values of probes.

        The text of each number gives the bit-identical number when it is read. Raises OSError if the line cannot be
        written or if the file was removed.
        """
        storage.require(self._file, self._path)
        values = [*msgspec.structs.astuple(energy), *extra]
        line = [step, repr(t), repr(dt), limiter, *(repr(float(v)) for v in values)]
        self._writer.writerow([line[k] for k in self._places])
        self._file.flush()

    def close(self) -> None:
        """Close the file. If pyarrow is installed, also write the table as history.parquet."""
        self._file.close()
        write_parquet(self._path)


def _head(path: Path) -> list[str]:
    """Return the names in the first line of a table; [] if there is no table."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return next(csv.reader(file), [])


def extremes(folder: Path, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return the smallest and the largest number in each of the columns ``names``; NaN if the column is empty or the
    file was removed.
    """
    found = dict.fromkeys(names, (math.nan, math.nan))
    path = folder / layout.HISTORY
    if not names or not path.exists():
        return found
    with path.open(newline="", encoding="utf-8") as file:
        head = {history.split(text)[0]: k for k, text in enumerate(next(csv.reader(file), []))}
        lines = list(csv.reader(file))
    for name in head.keys() & found.keys():
        values = [value for line in lines if not math.isnan(value := float(line[head[name]]))]
        if values:
            found[name] = min(values), max(values)
    return found


def write_parquet(path: Path) -> Path | None:
    """Write a history as a Parquet file into its folder. The metadata of the file contains the unit of each column.
    Return None if pyarrow is not installed.
    """
    try:
        import pyarrow
        from pyarrow import csv as tables
        from pyarrow import parquet
    except ModuleNotFoundError:
        return None
    with path.open(newline="", encoding="utf-8") as file:
        head = next(csv.reader(file))
    kinds = {"step": pyarrow.int64(), "limiter": pyarrow.string()}
    columns = {entry: kinds.get(history.split(entry)[0], pyarrow.float64()) for entry in head}
    read = tables.read_csv(path, convert_options=tables.ConvertOptions(column_types=columns, null_values=[]))
    fields = [
        pyarrow.field(name, columns[entry], metadata={"unit": unit} if unit else None)
        for entry, (name, unit) in zip(head, map(history.split, head), strict=True)
    ]
    target = path.with_name(layout.HISTORY_PARQUET)
    beside = target.with_suffix(".part")
    parquet.write_table(pyarrow.Table.from_arrays(read.columns, schema=pyarrow.schema(fields)), beside)
    beside.rename(target)
    return target
