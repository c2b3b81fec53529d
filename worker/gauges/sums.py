"""Probes of sums over nodes: mass, momentum, energy and centre of mass. The sum covers all nodes or the nodes beyond
a plane.
"""

import math
from typing import Any

import numpy as np

from conoid.cases.checks.on import bits
from conoid.cases.model.measures import SUMS, Beyond, Probe, kind
from conoid.cases.model.schema import Case
from conoid.cases.shapes.region import Region

from ..model.state import Flags, Floats
from ..parallel.fixed_point import exact_sums
from ..scene.marks import held
from .gauge import Scene

_AXES = "xyz"


def ahead(beyond: Beyond, x: Floats) -> Floats:
    """Return (n,) the distances, m, by which points (n, 3) lie beyond a plane."""
    return np.asarray((x[:, _AXES.index(beyond.axis)] - beyond.at) * way(beyond))


def way(beyond: Beyond) -> float:
    """Return the sign of the direction along the axis that points away from the plane."""
    return 1.0 if beyond.side == "above" else -1.0


class NodeSums:
    """Probes on this rank that are sums over nodes. The probes have no state."""

    def __init__(self, case: Case, scene: Scene) -> None:
        self._scene, self._bits = scene, bits(case)
        self._probes = {k: probe for k, probe in enumerate(case.probes) if kind(probe.field) in SUMS}

    def measure(self, v: Floats) -> dict[int, float]:
        columns = [column for probe in self._probes.values() for column in self._columns(probe, v)]
        sums = iter(exact_sums(self._scene.comm, np.column_stack(columns)).tolist())
        found = {k: _value(probe, next(sums), next(sums)) for k, probe in self._probes.items()}
        return found | self._of_bodies(v)

    def before(self, number: int, v: Floats) -> tuple[float, float]:
        """Return the share of the mass of a probe that is not beyond its plane, and the mean velocity, m/s, of this
        mass towards the plane. ``v`` (nodes, 3): velocities. Collective.
        """
        probe = self._probes[number]
        assert probe.beyond is not None
        part = self._scene.model.parts.index(probe.part)
        mass = np.where(self.present(probe), self._scene.model.nodes.mass_of(part), 0.0)
        short = np.where(ahead(probe.beyond, self._scene.model.nodes.x) > 0.0, 0.0, mass)
        along = short * v[:, _AXES.index(probe.beyond.axis)] * way(probe.beyond)
        whole, left, momentum = exact_sums(self._scene.comm, np.column_stack([mass, short, along])).tolist()
        return (left / whole if whole > 0.0 else 0.0), (momentum / left if left > 0.0 else 0.0)

    def keep(self) -> Any:
        return None

    def resume(self, known: Any) -> None:
        pass

    def started(self, probe: Probe) -> Flags:
        """Return (nodes,) True for each node that this rank owns, that was in the box of a probe at the start, and that
        is in the set of the probe.
        """
        model, nodes = self._scene.model, self._scene.model.nodes
        part = model.parts.index(probe.part)
        inside = Region.of(probe).holds(nodes.x0.T, model.slack[part])
        if probe.on is not None:
            inside = inside & held(nodes.marks, self._bits[probe.on])
        return np.asarray(nodes.owned & nodes.in_part(part) & inside)

    def present(self, probe: Probe) -> Flags:
        """Return (nodes,) the flags of ``started`` without the nodes that have been removed."""
        found, erosion = self.started(probe), self._scene.erosion
        return found if erosion is None else np.asarray(found & ~erosion.removed)

    def chosen(self, probe: Probe) -> Flags:
        """Return (nodes,) True for each node that belongs to the probe and is owned by this rank."""
        found = self.present(probe)
        if probe.beyond is not None:
            found &= ahead(probe.beyond, self._scene.model.nodes.x) > 0.0
        return found

    def _of_bodies(self, v: Floats) -> dict[int, float]:
        """Return the values of probes of whole rigid parts. Probes of rigid parts are not sums over nodes, because
        inertia and centre of a rigid part may differ from the sums over its nodes.
        """
        found: dict[int, float] = {}
        rigid, clock = self._scene.rigid, self._scene.clock
        if rigid is None:
            return found
        between = 0.5 * clock.last_dt / clock.mean_dt if v is not self._scene.model.nodes.v else rigid.share
        for k, probe in self._probes.items():
            body = int(rigid.of_part[self._scene.model.parts.index(probe.part)])
            whole = probe.low is None and probe.on is None and probe.beyond is None
            if body >= 0 and whole and kind(probe.field) != "mass":
                found[k] = rigid.account.quantity(body, kind(probe.field), _AXES.find(probe.field[-1]), between)
        return found

    def _columns(self, probe: Probe, v: Floats) -> tuple[Floats, Floats]:
        """Return two columns (nodes,): the terms of the sum of a probe, and the terms of its divisor."""
        nodes, field = self._scene.model.nodes, kind(probe.field)
        mass = np.where(self.chosen(probe), nodes.mass_of(self._scene.model.parts.index(probe.part)), 0.0)
        if field in ("mass", "residual_mass"):
            return mass, mass
        if field == "kinetic_energy":
            return 0.5 * mass * (v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1] + v[:, 2] * v[:, 2]), mass
        if field == "residual_velocity":
            assert probe.beyond is not None
            return mass * v[:, _AXES.index(probe.beyond.axis)] * way(probe.beyond), mass
        return mass * (nodes.x if field == "centre" else v)[:, _AXES.index(probe.field[-1])], mass


def _value(probe: Probe, total: float, mass: float) -> float:
    field = kind(probe.field)
    if field == "residual_velocity":
        return total / mass if mass > 0.0 else 0.0
    if field in ("centre", "centre_velocity"):
        return total / mass if mass > 0.0 else math.nan
    return total
