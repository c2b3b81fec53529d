"""Probes, which are the columns of history.csv. Probes that are measured in the same way form a group."""

import logging
from collections.abc import Callable
from typing import Any

import numpy as np

from conoid.cases.model.measures import COURSES, FRAGMENTS, PEAKS, PUSHES, SHAPES, SUMS, kind
from conoid.cases.model.schema import Case

from ..errors import InputError
from ..model.state import Floats
from .courses import Courses
from .flying import Flying
from .gauge import Gauge, Scene
from .means import Means
from .peaks import Peaks
from .pushes import Pushes
from .shapes import Shapes
from .sums import NodeSums

log = logging.getLogger("conoid.worker")

_OTHER: tuple[tuple[tuple[str, ...], Callable[[Case, Scene], Gauge]], ...] = (
    (PUSHES, Pushes), (COURSES, Courses), (SUMS, NodeSums), (FRAGMENTS, Flying), (SHAPES, Shapes),
)  # fmt: skip
"""Fields that are not measured over tets, and the class that measures each of them."""


class Probes:
    """Probes of a case on this rank."""

    def __init__(self, case: Case, scene: Scene) -> None:
        self.names = [probe.name for probe in case.probes]
        self._model, self._comm = scene.model, scene.comm
        kinds = [kind(probe.field) for probe in case.probes]
        other = {name for fields, _ in _OTHER for name in fields}
        peaks = [k for k, name in enumerate(kinds) if name in PEAKS]
        means = [k for k, name in enumerate(kinds) if name not in PEAKS and name not in other]
        over_tets = [make(case, scene, numbers) for make, numbers in ((Means, means), (Peaks, peaks)) if numbers]
        self._tets = {number: gauge.tets for gauge in over_tets for number in gauge.tets.ids}
        """The tets of all probes that are measured over tets."""
        self._gauges: list[Gauge] = [*over_tets, *(make(case, scene) for names, make in _OTHER if {*kinds} & {*names})]
        self._sums = NodeSums(case, scene)
        self.sums = any(isinstance(gauge, NodeSums) for gauge in self._gauges)
        """True if a probe is a sum over nodes. A probe that is a sum over nodes needs the velocities at time n."""

    def require_tets(self, case: Case) -> None:
        """Raise InputError on every rank if a probe over tets has no tet, or if a sum over a box or a set has no
        node.
        """
        some = [k for k, probe in enumerate(case.probes) if kind(probe.field) in SUMS]
        boxes = [k for k in some if case.probes[k].low is not None or case.probes[k].on is not None]
        tets = [self._tets[k].count(k) for k in self._tets]
        nodes = [int(self._sums.started(case.probes[k]).sum()) for k in boxes]
        counts = self._comm.sum(np.array([*tets, *nodes], np.int64)).tolist()
        for k, count in sorted(zip([*self._tets, *boxes], counts, strict=True)):
            what, where = ("tet", "its centre") if k in self._tets else ("node", "its place")
            if self._comm.rank == 0:
                log.info("probes[%d] has %d %ss", k, count, what)
            if count == 0:
                probe = case.probes[k]
                both = "" if probe.on is None else f" and a node in {probe.on!r}"
                if what == "node":
                    both = "" if probe.on is None else f" and is in {probe.on!r}"
                raise InputError(
                    f"probes[{k}]: no {what} of part {probe.part!r} has {where} between low and high{both}"
                )

    def before(self, number: int, v: Floats) -> tuple[float, float]:
        """Return what ``NodeSums.before`` returns for the probe with this ``number``. Collective."""
        return self._sums.before(number, v)

    def keep(self) -> list[Any]:
        """Return the state of the gauges for a checkpoint. All ranks return equal values."""
        return [gauge.keep() for gauge in self._gauges]

    def resume(self, known: list[Any]) -> None:
        """Restore the state of the gauges from the value that ``keep`` returned."""
        for gauge, own in zip(self._gauges, known, strict=True):
            gauge.resume(own)

    def measure(self, v: Floats | None = None) -> Floats:
        """Return (probes,) the present values, equal for any number of ranks.

        Collective. ``v`` (nodes, 3): velocities at time n, for probes that are sums. The argument is needed if the
        velocities of the model are half a step ahead.
        """
        found: dict[int, float] = {}
        for gauge in self._gauges:
            found |= gauge.measure(self._model.nodes.v if v is None else v)
        return np.array([found[k] for k in range(len(self.names))])
