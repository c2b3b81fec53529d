"""What a run keeps of its fragments: a table a frame, and who came from whom."""

import csv
from pathlib import Path

import numpy as np

from conoid.cases import fragments as tables

from ..migration.parcel import Parcel, length
from ..parallel.comm import Comm
from ..state import Ints, Model
from . import connectivity, fragments
from .stage import Fracture


class Record:
    """The fragments of a run, from frame to frame; all ranks take part in everything."""

    def __init__(self, model: Model, fracture: Fracture, comm: Comm) -> None:
        self._model, self._fracture, self._comm = model, fracture, comm
        self.labels: list[Ints] = []
        """For each block (n,) the fragment of each tet when they were last found."""
        self._before: tuple[Ints, Ints] | None = None
        self.count = 0
        """Fragments when they were last found."""

    def keep(self, parcel: Parcel) -> None:
        """Adds the fragments of the last frame to a parcel."""
        parcel.known["record"] = self.count, self._before is not None
        if self._before is not None:
            order = np.argsort(self._before[0])
            ids, labels = self._before[0][order], self._before[1][order]
            for table in parcel.tets.values():
                table["fragment"] = labels[np.searchsorted(ids, table["id"])]

    def resume(self, parcel: Parcel) -> None:
        """Takes them back."""
        self.count, looked = parcel.known["record"]
        if looked:
            tables = [table for table in parcel.tets.values() if length(table)]
            self._before = _flat([table["id"] for table in tables]), _flat([table["fragment"] for table in tables])

    def look(self) -> None:
        """Finds the fragments as they are."""
        cohesion = self._fracture.cohesion
        held = cohesion.facets.tets if cohesion is not None else np.zeros((0, 2), np.int64)
        self.labels = connectivity.labels(self._model, held, self._comm)
        self.count = connectivity.count(self._model, self.labels, self._comm)

    def write(self, folder: Path, index: int, t: float) -> None:
        """Writes the table of frame ``index`` and adds to the genealogy."""
        rows = fragments.table(self._model, self.labels, self._comm)
        now = _flat([block.id for block in self._model.blocks]), _flat(self.labels)
        family = fragments.genealogy(self._before, now, self._comm) if self._before is not None else None
        self._before = now
        if rows is not None:
            fragments.write(folder, index, t, self._model.parts, rows)
        if family is not None:
            _append(tables.genealogy(folder), index, family[family[:, 0] != family[:, 1]])


def _flat(columns: list[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, np.int64), *columns])


def _append(path: Path, index: int, family: Ints) -> None:
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(tables.GENEALOGY)
        writer.writerows([index, *row] for row in family.tolist())
