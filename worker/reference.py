"""``[[reference]]``: the finished run beside published or derived numbers."""

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

from conoid.cases import layout
from conoid.cases.outcome import Check
from conoid.cases.quantities import unit_of
from conoid.cases.schema import Reference

from .parallel.comm import Comm
from .parallel.fixed_point import exact_sums
from .probes import field
from .simulation import Simulation
from .state import Block

_AXES = {"x": 0, "y": 1, "z": 2}
_STRESSES = ("stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy")


def measure(sim: Simulation, folder: Path) -> list[Check]:
    """Every reference of the case, measured; all ranks take part, all get the same answer."""
    fields = {probe.name: probe.field for probe in sim.case.probes}
    return [_check(spec, _measured(sim, spec, folder), fields.get(spec.probe or "")) for spec in sim.case.reference]


def _check(spec: Reference, value: float, field_name: str | None) -> Check:
    return Check(
        name=_name(spec), value=value, expected=spec.value, tolerance=spec.tolerance,
        passed=abs(value - spec.value) <= spec.tolerance, unit=unit_of(spec.quantity, field_name), source=spec.source,
    )  # fmt: skip


def _name(spec: Reference) -> str:
    return " ".join(word for word in (spec.quantity, spec.part, spec.probe, spec.axis) if word)


def _measured(sim: Simulation, spec: Reference, folder: Path) -> float:
    quantity = spec.quantity
    if quantity.startswith("probe_"):
        value = _probe(folder, spec) if sim.comm.rank == 0 else 0.0
        return float(sim.comm.broadcast(value))
    if quantity == "worst_residual":
        return sim.ledger.worst
    if quantity == "contact_time":
        return _maximum(sim.comm, [b.last_push for b in sim.boundaries])
    if quantity == "contact_loss":
        return sim.ledger.lost
    if quantity == "speed_mean":
        return _mean_speed(sim, spec)
    if quantity in ("extent", "radius"):
        return _size(sim, spec)
    return _largest(sim, spec)


def _maximum(comm: Comm, values: npt.ArrayLike) -> float:
    return float(comm.maximum(np.array([np.max(values, initial=-np.inf)]))[0])


def _nodes(sim: Simulation, part: str | None) -> "np.ndarray":
    nodes = sim.model.nodes
    return np.ones(nodes.n, bool) if part is None else nodes.part == sim.model.parts.index(part)


def _blocks(sim: Simulation, part: str | None) -> list[Block]:
    return [b for b in sim.model.blocks if part is None or sim.model.parts[b.part] == part]


def _size(sim: Simulation, spec: Reference) -> float:
    axis = _AXES[spec.axis or "z"]
    x = sim.model.nodes.x[_nodes(sim, spec.part)]
    if spec.quantity == "extent":
        return _maximum(sim.comm, x[:, axis]) + _maximum(sim.comm, -x[:, axis])
    across = np.delete(x, axis, axis=1)
    return _maximum(sim.comm, np.hypot(across[:, 0], across[:, 1]))


def _mean_speed(sim: Simulation, spec: Reference) -> float:
    nodes = sim.model.nodes
    chosen = _nodes(sim, spec.part) & nodes.owned
    mass = nodes.mass[chosen]
    momentum, total = exact_sums(sim.comm, np.column_stack([mass * nodes.v[chosen, _AXES[spec.axis or "z"]], mass]))
    return float(momentum / total)


def _largest(sim: Simulation, spec: Reference) -> float:
    names = _STRESSES if spec.quantity == "stress_max" else (spec.quantity.removesuffix("_max"),)
    values = [float(np.abs(field(b, name, sim.model)).max()) for b in _blocks(sim, spec.part) for name in names]
    return _maximum(sim.comm, values)


def _probe(folder: Path, spec: Reference) -> float:
    with (folder / layout.HISTORY).open(newline="", encoding="utf-8") as file:
        rows = [(float(row["t"]), float(row[spec.probe or ""])) for row in csv.DictReader(file)]
    until = np.inf if spec.until is None else spec.until
    inside = [(t, value) for t, value in rows if spec.since <= t <= until]
    if not inside:
        return float("nan")
    t, values = np.array(inside).T
    if spec.quantity == "probe_max":
        return float(values.max())
    if spec.quantity == "probe_min":
        return float(values.min())
    return float(np.trapezoid(values, t) / (t[-1] - t[0])) if len(t) > 1 else float(values[0])
