"""Tets that a probe measures: the tets whose centre is in the region of the probe at the start."""

from collections.abc import Sequence

import numpy as np

from conoid.cases.checks.on import bits
from conoid.cases.model.schema import Case, Probe
from conoid.cases.shapes.region import Region

from ..model.state import Block, Floats, Ints, Model
from ..scene.marks import held


class ChosenTets:
    """Tets on this rank that are measured by at least one probe of a case."""

    def __init__(self, case: Case, model: Model, numbers: Sequence[int]) -> None:
        """``numbers``: indices of the probes in the case."""
        self._model = model
        centres = [_centres(block, model) for block in model.blocks] if numbers else []
        self.ids = {
            k: [_inside(case, case.probes[k], block, model, x) for block, x in zip(model.blocks, centres, strict=True)]
            for k in numbers
        }
        """Global ids of the tets of each probe, one array for each block."""
        self._counted: list[int] | None = None
        """Number of tets of each block at the last selection of tets."""
        self._found: dict[int, list[tuple[Block, Ints]]] = {}

    def count(self, number: int) -> int:
        """Return the number of tets on this rank, at the start, that a probe measures."""
        return sum(len(ids) for ids in self.ids[number])

    def changed(self) -> bool:
        """Return True if tets were removed since the last call; True at the first call. If tets were removed, the tets
        of the probes are selected again.
        """
        if self._counted == (counted := [block.n for block in self._model.blocks]):
            return False
        self._counted = counted
        self._found = {number: list(self._places(number)) for number in self.ids}
        return True

    def found(self, number: int) -> list[tuple[Block, Ints]]:
        """Return the blocks that have tets of a probe, and the places of these tets in each block."""
        return self._found[number]

    def _places(self, number: int) -> list[tuple[Block, Ints]]:
        there = []
        for block, ids in zip(self._model.blocks, self.ids[number], strict=True):
            places = np.flatnonzero(np.isin(block.id, ids)) if len(ids) else ids
            if len(places):
                there.append((block, places))
        return there


def _centres(block: Block, model: Model) -> Floats:
    """Return (3, tets) the centres of the tets in the initial configuration, m."""
    return np.array([x[block.tets].sum(axis=1) for x in model.nodes.x0.T.copy()]) / 4.0


def _inside(case: Case, probe: Probe, block: Block, model: Model, centres: Floats) -> "np.ndarray":
    if model.parts[block.part] != probe.part:
        return np.zeros(0, np.int64)
    inside = np.full(block.n, True) & Region.of(probe).holds(centres, model.slack[block.part])
    if probe.on is not None:
        inside &= held(model.nodes.marks, bits(case)[probe.on])[block.tets].any(axis=1)
    return np.asarray(block.id[inside])
