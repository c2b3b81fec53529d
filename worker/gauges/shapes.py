"""Probes of shapes: depth of penetration, size of holes and cones. Shapes are measured with rays, lines and faces."""

import math
from typing import Any

import numpy as np

from conoid.cases.model.measures import SHAPES, Probe
from conoid.cases.model.schema import Case

from ..fracture import connectivity, fragments
from ..mesh.faces import FACES, areas
from ..model.state import Block, Floats
from ..output.damage import damage
from ..parallel.fixed_point import exact_sums
from . import penetration, rays
from .flying import held
from .gauge import Scene

_AXES = "xyz"
_DAMAGED = 0.5
"""Damage above which a tet counts as broken. Chosen value: damage increases from 0 to 1 within few steps."""


class Shapes:
    """Probes of shapes on this rank.

    At the start each probe measures the initial state: thicknesses, distances along rays, areas of faces.
    """

    def __init__(self, case: Case, scene: Scene) -> None:
        self._case, self._scene = case, scene
        self._probes = {k: probe for k, probe in enumerate(case.probes) if probe.field in SHAPES}
        self._start: dict[int, Any] = {}

    def measure(self, v: Floats) -> dict[int, float]:
        return {k: self._of(k, probe) for k, probe in self._probes.items()}

    def keep(self) -> Any:
        return [self._start.get(k) for k in self._probes]

    def resume(self, known: Any) -> None:
        self._start = {k: own for k, own in zip(self._probes, known, strict=True) if own is not None}

    def _of(self, k: int, probe: Probe) -> float:
        if probe.field == "penetration":
            return self._penetration(k, probe)
        return self._cone(k, probe) if probe.field == "cone_angle" else self._hole(k, probe)

    def _penetration(self, k: int, probe: Probe) -> float:
        model = self._scene.model
        rows, radius = penetration.passed_by(model, probe.part, probe.axis or "z", self._scene.comm)
        if k not in self._start:
            self._start[k] = penetration.thickness(rows, len(model.parts))
        return penetration.depth(rows, self._start[k], radius)

    def _hole(self, k: int, probe: Probe) -> float:
        origin = self._origin(probe, probe.at or 0.0)
        if k not in self._start:
            self._start[k] = np.isfinite(self._reach(probe, self._scene.model.nodes.x0, origin))
        far = self._reach(probe, self._scene.model.nodes.x, origin)[self._start[k]]
        if not np.isfinite(far).all() or not len(far):
            return math.nan
        if probe.field == "hole_width":
            return 2.0 * float(far.min())
        return 2.0 * math.sqrt(math.fsum((far * far).tolist()) / len(far))

    def _cone(self, k: int, probe: Probe) -> float:
        axis = _AXES.index(probe.axis or "z")
        if k not in self._start:
            low, high = self._ends(probe, axis)
            middle = self._reach(probe, self._scene.model.nodes.x0, self._origin(probe, 0.5 * (low + high)))
            share = float(np.isfinite(middle).mean())
            self._start[k] = low, high, share, self._areas(probe, axis, (low, high), None)
        low, high, share, start = self._start[k]
        left = self._areas(probe, axis, (low, high), self._sound(probe))
        r, wide = (math.sqrt(max(a - b, 0.0) / (math.pi * share)) for a, b in zip(start, left, strict=True))
        return 2.0 * math.atan2(wide - r, high - low)

    def _blocks(self, probe: Probe) -> list[Block]:
        return [block for block in self._scene.model.blocks if self._scene.model.parts[block.part] == probe.part]

    def _origin(self, probe: Probe, at: float) -> Floats:
        found = np.array(probe.centre or (0.0, 0.0, 0.0))
        found[_AXES.index(probe.axis or "z")] = at
        return found

    def _reach(self, probe: Probe, x: Floats, origin: Floats) -> Floats:
        axis = _AXES.index(probe.axis or "z")
        found = [rays.reach(x, block.tets, origin, axis) for block in self._blocks(probe) if block.n]
        nearest = np.min([np.full(rays.RAYS, np.inf), *found], axis=0)
        return -self._scene.comm.maximum(-nearest)

    def _ends(self, probe: Probe, axis: int) -> tuple[float, float]:
        """Return the lowest and the highest coordinate of the part along the axis at the start, m."""
        nodes = self._scene.model.nodes
        x = nodes.x0[nodes.in_part(self._scene.model.parts.index(probe.part)), axis]
        low, high = self._scene.comm.maximum(np.array([-x.min(initial=np.inf), x.max(initial=-np.inf)]))
        return -float(low), float(high)

    def _areas(self, probe: Probe, axis: int, ends: tuple[float, float], sound: Any) -> list[float]:
        """Return the initial areas, m^2, of the faces of tets at the two ends of the part.

        ``sound``: for each block of the part, (n,) True for each tet that is included; None if all tets are included.
        """
        x, near, columns = self._scene.model.nodes.x0, self._scene.model.slack, []
        for b, block in enumerate(self._blocks(probe)):
            for corners in FACES:
                faces = block.tets[:, corners].astype(np.int32)
                own = areas(x, faces)
                at = [(np.abs(x[faces][:, :, axis] - end) <= near[block.part]).all(axis=1) for end in ends]
                whole = np.ones(block.n, bool) if sound is None else sound[b]
                columns.append(np.column_stack([np.where(flags & whole, own, 0.0) for flags in at]))
        return [float(v) for v in exact_sums(self._scene.comm, np.concatenate([np.zeros((0, 2)), *columns]))]

    def _sound(self, probe: Probe) -> Any:
        """Return, for each block of the part, (n,) True for each tet that is undamaged and belongs to the heaviest
        fragment of the part.
        """
        scene, model = self._scene, self._scene.model
        cohesion = scene.fracture.cohesion if scene.fracture is not None else None
        damaged = damage(self._case, model, cohesion, scene.comm)
        labels = connectivity.labels(model, held(scene), scene.comm)
        rows, name = fragments.table(model, labels, scene.comm), -1
        if rows is not None:
            own = rows[rows["part"] == model.parts.index(probe.part)]
            name = int(own["label"][np.argmax(own["mass"])]) if len(own) else -1
        name = scene.comm.broadcast(name)
        of_part = [b for b, block in enumerate(model.blocks) if model.parts[block.part] == probe.part]
        whole = [damaged[b] <= _DAMAGED if damaged is not None else np.ones(len(labels[b]), bool) for b in of_part]
        return [flags & (labels[b] == name) for b, flags in zip(of_part, whole, strict=True)]
