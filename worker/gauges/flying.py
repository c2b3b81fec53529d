"""Probes of fragments: velocity and mass of the heaviest fragment of a part beyond a plane."""

from typing import Any

import numpy as np

from conoid.cases.model.schema import Case

from ..fracture import connectivity, fragments
from ..model.state import Floats, Ints
from .gauge import Scene
from .sums import ahead, way


def held(scene: Scene) -> Ints:
    """Return (m, 2) pairs of tets that the cohesion of a broken facet still connects."""
    cohesion = scene.fracture.cohesion if scene.fracture is not None else None
    return cohesion.facets.tets if cohesion is not None else np.zeros((0, 2), np.int64)


class Flying:
    """Probes of fragments beyond a plane. The probes have no state."""

    def __init__(self, case: Case, scene: Scene) -> None:
        self._scene = scene
        self._probes = {k: probe for k, probe in enumerate(case.probes) if probe.field.startswith("fragment_")}

    def measure(self, v: Floats) -> dict[int, float]:
        scene, found = self._scene, dict.fromkeys(self._probes, 0.0)
        rows = fragments.table(scene.model, connectivity.labels(scene.model, held(scene), scene.comm), scene.comm)
        for k, probe in self._probes.items() if rows is not None else ():
            assert rows is not None
            assert probe.beyond is not None
            there = rows["part"] == scene.model.parts.index(probe.part)
            some = rows[there & (ahead(probe.beyond, rows["centre"]) > 0.0)]
            if len(some):
                first = some[np.argmax(some["mass"])]
                along = float(first["velocity"]["xyz".index(probe.beyond.axis)]) * way(probe.beyond)
                found[k] = float(first["mass"]) if probe.field == "fragment_mass" else along
        answer: dict[int, float] = scene.comm.broadcast(found)
        return answer

    def keep(self) -> Any:
        return None

    def resume(self, known: Any) -> None:
        pass
