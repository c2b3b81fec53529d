"""Removal of output after the step of a checkpoint. A resumed run writes this output again."""

import csv
import os
from pathlib import Path

from conoid.cases.output import fragments, layout


def rewind(folder: Path, step: int, frame: int) -> None:
    """Remove lines from the history and the genealogy in a run's folder.

    Removed are lines of the history from ``step`` on and lines of the genealogy from ``frame`` on; all lines at step
    0.
    """
    _keep_below(folder / layout.HISTORY, step)
    _keep_below(fragments.genealogy(folder), frame)
    for last in (layout.OUTCOME, layout.HISTORY_PARQUET):
        (folder / last).unlink(missing_ok=True)


def _keep_below(path: Path, limit: int) -> None:
    """Keep the header of a table and its complete lines with a first column below ``limit``."""
    if not path.exists():
        return
    if limit == 0:
        path.unlink()
        return
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    beside = path.with_suffix(".part")
    with beside.open("w", newline="", encoding="utf-8") as file:
        ending = "\r\n" if b"\r\n" in path.read_bytes()[:4096] else "\n"
        writer = csv.writer(file, lineterminator=ending)
        writer.writerow(head)
        writer.writerows(row for row in rows if len(row) == len(head) and int(row[0]) < limit)
        file.flush()
        os.fsync(file.fileno())
    beside.rename(path)
