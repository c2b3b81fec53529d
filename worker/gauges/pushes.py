"""Forces and impulses of contact and walls on parts. Impulses are measured since the start; forces are means since the
last sample.
"""

from typing import Any

import numpy as np

from conoid.cases.model.measures import PUSHES, Probe, kind
from conoid.cases.model.schema import Case, Wall

from ..boundaries.boundaries import Boundary
from ..model.state import Floats
from ..parallel.fixed_point import exact_sums
from .gauge import Scene

_AXES = "xyz"


class Pushes:
    """Probes of forces and impulses on this rank."""

    def __init__(self, case: Case, scene: Scene) -> None:
        self._scene = scene
        self._probes = {k: probe for k, probe in enumerate(case.probes) if kind(probe.field) in PUSHES}
        self._names = [wall.name for _, wall in case.boundaries_of(Wall)]
        self._given, self._since = np.zeros(len(self._probes)), 0.0
        """(probes,) impulses at the last sample, N s; and simulated time of the last sample, s."""

    def measure(self, v: Floats) -> dict[int, float]:
        now, t = self._impulses(), self._scene.clock.t
        passed = t - self._since
        forces = (now - self._given) / passed if passed > 0.0 else np.zeros_like(now)
        if passed > 0.0:
            self._given, self._since = now, t
        found = zip(self._probes.items(), now.tolist(), forces.tolist(), strict=True)
        return {k: impulse if "_impulse_" in probe.field else force for (k, probe), impulse, force in found}

    def keep(self) -> Any:
        return self._given, self._since

    def resume(self, known: Any) -> None:
        self._given, self._since = known

    def _impulses(self) -> Floats:
        """Return (probes,) the impulse since the start on the part of each probe, along the axis of the probe, N s."""
        parts, contact = self._scene.model.parts, self._scene.contact
        of = {probe.by is None for probe in self._probes.values() if probe.field.startswith("contact_")}
        every = contact.impulses() if contact is not None and True in of else None
        pairs = contact.books.between(self._scene.comm) if contact is not None and False in of else None
        walls, found = self._of_walls(), np.zeros(len(self._probes))
        for place, probe in enumerate(self._probes.values()):
            if not probe.field.startswith("contact_"):
                found[place] = walls[place]
                continue
            axis, part = _AXES.index(probe.field[-1]), parts.index(probe.part)
            if probe.by is None:
                found[place] = every[part, axis] if every is not None else 0.0
            elif pairs is not None:
                found[place] = pairs[part, parts.index(probe.by), axis]
        return found

    def _of_walls(self) -> Floats:
        """Return (probes,) the impulses of walls, N s; zero for probes that have no walls."""
        if not any(probe.field.startswith("wall_") for probe in self._probes.values()):
            return np.zeros(len(self._probes))
        tables = [np.zeros((0, len(self._probes))), *(self._given_by(walls) for walls in self._scene.walls)]
        found = exact_sums(self._scene.comm, np.concatenate(tables))
        for place, probe in enumerate(self._probes.values()):
            if self._scene.rigid is not None and probe.field.startswith("wall_"):
                part = self._scene.model.parts.index(probe.part) if probe.part else None
                found[place] += self._scene.rigid.of_walls(self._of(probe), part)[_AXES.index(probe.field[-1])]
        return found

    def _given_by(self, walls: Boundary) -> Floats:
        """Return (n, probes) the impulses of walls on each node of the walls, N s. Only nodes that this rank owns are
        included.
        """
        nodes, columns = self._scene.model.nodes, np.zeros((len(walls.nodes), len(self._probes)))
        for place, probe in enumerate(self._probes.values()):
            if probe.field.startswith("wall_"):
                some = [3 * k + _AXES.index(probe.field[-1]) for k in self._of(probe)]
                share = nodes.mass_of(self._scene.model.parts.index(probe.part)) if probe.part else nodes.mass
                mine = (nodes.owned * share / nodes.mass)[walls.nodes]
                assert walls.given is not None
                columns[:, place] = walls.given[:, some].sum(axis=1) * mine
        return columns

    def _of(self, probe: Probe) -> list[int]:
        """Return the walls whose impulses a probe measures."""
        return [k for k, name in enumerate(self._names) if probe.wall in (None, name)]
