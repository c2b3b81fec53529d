"""Probes that are the largest or smallest value of a field over tets."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from conoid.cases.model.schema import Case

from ..model.state import Floats
from .chosen import ChosenTets
from .fields import field
from .gauge import Scene


class Peaks:
    """Probes on this rank that are largest or smallest values. The probes have no state."""

    def __init__(self, case: Case, scene: Scene, numbers: Sequence[int]) -> None:
        """``numbers``: indices of the probes in the case."""
        self._fields = {k: case.probes[k].field for k in numbers}
        self._model, self._comm = scene.model, scene.comm
        self.tets = ChosenTets(case, scene.model, numbers)

    def measure(self, v: Floats) -> dict[int, float]:
        """Return the values of the probes; NaN if all tets of a probe were removed. A smallest value is computed as the
        maximum of the negative field, so that one message contains all values.
        """
        self.tets.changed()
        most = self._comm.maximum(np.array([self._own(k, name) for k, name in self._fields.items()])).tolist()
        return {
            k: math.nan if value == -math.inf else _sign(name) * value
            for (k, name), value in zip(self._fields.items(), most, strict=True)
        }

    def keep(self) -> Any:
        return None

    def resume(self, known: Any) -> None:
        pass

    def _own(self, number: int, name: str) -> float:
        """Return the value of this rank times the sign of the probe; minus infinity if the rank has no tet of the
        probe.
        """
        values = [_sign(name) * field(block, name[:-4], self._model, at) for block, at in self.tets.found(number)]
        return max((float(each.max()) for each in values), default=-math.inf)


def _sign(name: str) -> float:
    return -1.0 if name.endswith("_min") else 1.0
