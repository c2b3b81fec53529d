"""Record of the fragments of a run: persistent fragment numbers, one table for each frame, and the genealogy of the
fragments.
"""

import csv
from pathlib import Path

import numpy as np

from conoid.cases.output import fragments as tables

from ..migration.parcel import Parcel, length
from ..model.ids import places
from ..model.state import Ints, Model
from ..parallel.comm import Comm
from ..parallel.team import Team
from . import fragments
from .connectivity import Connectivity, count
from .numbers import UNKNOWN, numbered
from .stage import Fracture


class Record:
    """The fragments of a run; their numbers persist from frame to frame. All methods are collective."""

    def __init__(self, model: Model, fracture: Fracture, comm: Comm, threads: Team) -> None:
        self._connectivity = Connectivity(model, comm, threads)
        self._model, self._fracture, self._comm = model, fracture, comm
        self.labels: list[Ints] = []
        """Label of the fragment of each tet (``connectivity``) at the last ``update``: one array (n,) for each block of
        tets."""
        self.numbers: list[Ints] = []
        """Number of the fragment of each tet in the last frame: one array (n,) for each block of tets. A fragment has
        the same number as long as it exists."""
        self._before: tuple[Ints, Ints] = np.zeros(0, np.int64), np.zeros(0, np.int64)
        """Ids of the tets, ascending, and their fragment numbers in the last frame."""
        self._family: Ints = np.zeros((0, 3), np.int64)
        self.count = 0
        """Number of fragments at the last ``update``."""
        self.initial = self.next = 0
        """Number of fragments at the start, which have the smallest numbers; and next free number of a fragment."""

    def keep(self, parcel: Parcel) -> None:
        """Adds the numbers of the last frame to a parcel (a checkpoint or migration message)."""
        parcel.known["record"] = self.count, self.initial, self.next
        if self.next:
            for table in parcel.tets.values():
                table["fragment"] = self._last(table["id"])

    def resume(self, parcel: Parcel) -> None:
        """Restores the numbers of the last frame from a parcel (a checkpoint or migration message)."""
        self.count, self.initial, self.next = parcel.known["record"]
        if self.next:
            tables = [table for table in parcel.tets.values() if length(table)]
            self._remember(_flat([table["id"] for table in tables]), _flat([table["fragment"] for table in tables]))

    def update(self) -> None:
        """Finds the present fragments and their labels."""
        cohesion = self._fracture.cohesion
        held = cohesion.facets.tets if cohesion is not None else np.zeros((0, 2), np.int64)
        self.labels = self._connectivity.labels(held)
        self.count = count(self._model, self.labels, self._comm)

    def number(self) -> None:
        """Gives numbers to the fragments that the last ``update`` found. The method must be called at the start and at
        frames only. The times of frames are equal in every run of a case, so the numbers are reproducible.
        """
        ids = _flat([block.id for block in self._model.blocks])
        found, self._family = numbered(self._last(ids), _flat(self.labels), self.next, self._comm)
        self.next = max(self.next, 1 + int(self._family[:, 1].max(initial=UNKNOWN)))
        self.initial = self.initial or self.next
        self._remember(ids, found)
        self.numbers = np.split(found, np.cumsum([block.n for block in self._model.blocks])[:-1])

    def of_frame(self) -> list[Ints]:
        """Returns the fragment number of each tet in the last frame: one array (n,) for each block of tets."""
        return [self._last(block.id) for block in self._model.blocks]

    def write(self, folder: Path, index: int, t: float) -> None:
        """Writes the fragment table of frame ``index`` and appends the changes to the genealogy."""
        rows = fragments.table(self._model, self.numbers, self._comm)
        if rows is not None:
            fragments.write(folder, index, t, self._model.parts, rows)
            born = (self._family[:, 0] != self._family[:, 1]) & (self._family[:, 0] != UNKNOWN)
            if index:
                _append(tables.genealogy(folder), index, self._family[born])

    def _last(self, ids: Ints) -> Ints:
        at = places(self._before[0], ids)
        return np.where(at >= 0, self._before[1][at], UNKNOWN) if len(self._before[0]) else np.full(len(ids), UNKNOWN)

    def _remember(self, ids: Ints, numbers: Ints) -> None:
        order = np.argsort(ids)
        self._before = ids[order], numbers[order]


def _flat(columns: list[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, np.int64), *columns])


def _append(path: Path, index: int, family: Ints) -> None:
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(tables.GENEALOGY)
        writer.writerows([index, *row] for row in family.tolist())
