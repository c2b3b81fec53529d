"""Removal of output that was written after the step of a checkpoint. A resumed run writes the removed output again."""

import csv
import io
import os
from pathlib import Path

from conoid.cases.output import fragments, layout
from conoid.cases.reading import whole

_TEXTS = frozenset({"limiter"})
"""Columns of the tables that contain text."""


def rewind(folder: Path, step: int, frame: int) -> int:
    """Remove lines from the history and the genealogy in a run's folder. Return the number of lines that remain in the
    history.

    The removed lines are lines of the history from ``step`` on, lines of the genealogy from ``frame`` on, and damaged
    lines. At step 0 all lines are removed. Raises OSError.
    """
    kept = _keep_below(folder / layout.HISTORY, step)
    _keep_below(fragments.genealogy(folder), frame)
    for last in (layout.OUTCOME, layout.HISTORY_PARQUET):
        (folder / last).unlink(missing_ok=True)
    return kept


def lost(kept: int, written: int) -> list[str]:
    """Return a warning if the history has fewer lines than were written up to the checkpoint."""
    if kept >= written:
        return []
    what = f"{layout.HISTORY} has {kept} of the {written} lines that were written up to the checkpoint"
    return [f"{what}: largest and smallest values of probes, and references that use them, may miss an extreme"]


def _keep_below(path: Path, limit: int) -> int:
    """Keep the header of a table, and its complete lines whose first column is below ``limit``. Return the number of
    lines that were kept. A table without a header is removed."""
    if not os.path.lexists(path):
        return 0
    with io.TextIOWrapper(io.BufferedReader(whole.opened(path)), "utf-8", "replace", newline="") as file:
        head, *rows = list(csv.reader(file)) or [[]]
    if limit == 0 or not head or head[0] not in ("step", "frame"):
        path.unlink()
        return 0
    numbers = [k for k, name in enumerate(head) if name not in _TEXTS]
    rows = [row for row in rows if len(row) == len(head) and _below(row, limit, numbers)]
    _write(path, [head, *rows])
    return len(rows)


def _below(row: list[str], limit: int, numbers: list[int]) -> bool:
    try:
        return int(row[0]) < limit and all(float(row[k]) is not None for k in numbers)
    except ValueError:
        return False


def _write(path: Path, rows: list[list[str]]) -> None:
    with path.open("rb") as file:
        ending = "\r\n" if b"\r\n" in file.read(4096) else "\n"
    beside = path.with_suffix(".part")
    with beside.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator=ending).writerows(rows)
        file.flush()
        os.fsync(file.fileno())
    beside.rename(path)
