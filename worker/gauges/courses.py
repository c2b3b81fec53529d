"""Probes of the motion of walls: position and velocity at time n."""

from typing import Any

from conoid.cases.model.measures import COURSES, kind
from conoid.cases.model.schema import Case, Wall

from ..model.state import Floats
from .gauge import Scene

_AXES = "xyz"


class Courses:
    """Probes of the motion of walls. The probes have no state, and all ranks have equal walls."""

    def __init__(self, case: Case, scene: Scene) -> None:
        self._scene, names = scene, [wall.name for _, wall in case.boundaries_of(Wall)]
        self._probes = {
            k: (kind(probe.field), names.index(probe.wall or ""), _AXES.index(probe.field[-1]))
            for k, probe in enumerate(case.probes) if kind(probe.field) in COURSES
        }  # fmt: skip

    def measure(self, v: Floats) -> dict[int, float]:
        walls, clock = self._scene.moving, self._scene.clock
        share = 0.5 * clock.last_dt / clock.mean_dt if clock.mean_dt > 0.0 else 0.0
        speed = walls.before + share * (walls.speed - walls.before)
        values = {"wall_position": walls.shapes.point, "wall_velocity": speed}
        return {k: float(values[what][wall, axis]) for k, (what, wall, axis) in self._probes.items()}

    def keep(self) -> Any:
        return None

    def resume(self, known: Any) -> None:
        pass
