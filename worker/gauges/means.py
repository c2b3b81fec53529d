"""Probes that are mass-weighted means of a field over tets."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from conoid.cases.model.schema import Case

from ..model import rows
from ..model.state import Block, Floats, Ints
from ..parallel.fixed_point import Ragged, exact_totals
from .chosen import ChosenTets
from .fields import field
from .gauge import Scene


class Means:
    """Probes on this rank that are means. The probes have no state."""

    def __init__(self, case: Case, scene: Scene, numbers: Sequence[int]) -> None:
        """``numbers``: indices of the probes in the case."""
        self._fields = {k: case.probes[k].field for k in numbers}
        self._model, self._comm = scene.model, scene.comm
        self.tets = ChosenTets(case, scene.model, numbers)
        self._found: list[tuple[str, Block, Ints, slice, slice]] = []
        """Table with an entry for each mean and each block that has tets of this mean. An entry has the field, the
        block, the indices of the tets, and two slices of the summed values: field times mass, and mass."""
        self._starts = np.zeros(1, np.int64)
        """Index of the first value of each sum."""

    def measure(self, v: Floats) -> dict[int, float]:
        """Return the means; NaN if all tets of a probe were removed."""
        sums = exact_totals(self._comm, self._columns())[0].reshape(-1, 2).tolist()
        return {
            k: total / mass if mass > 0.0 else math.nan for k, (total, mass) in zip(self._fields, sums, strict=True)
        }

    def keep(self) -> Any:
        return None

    def resume(self, known: Any) -> None:
        pass

    def _columns(self) -> Ragged:
        """Return two sums over the tets of each mean: field times mass, and mass."""
        if self.tets.changed():
            self._place()
        values = np.empty(self._starts[-1])
        for name, block, places, product, weight in self._found:
            values[weight] = mass = block.at(rows.MASS, places)
            np.multiply(field(block, name, self._model, places), mass, out=values[product])
        return Ragged(values, self._starts)

    def _place(self) -> None:
        """Compute the positions of the summed values, so that the values of each mean are successive."""
        self._found, starts, end = [], [0], 0
        for k, name in self._fields.items():
            begin, there = end, []
            for block, places in self.tets.found(k):
                there.append((block, places, slice(end, end + len(places))))
                end += len(places)
            n = end - begin
            for block, places, at in there:
                self._found.append((name, block, places, at, slice(at.start + n, at.stop + n)))
            starts += [end, end + n]
            end += n
        self._starts = np.array(starts)
