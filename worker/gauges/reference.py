"""Comparison of a finished run with published or derived numbers, which are the tables ``[[reference]]`` of a case."""

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

from conoid.cases.model.schema import Reference
from conoid.cases.outcome import Check
from conoid.cases.output import history, layout
from conoid.cases.reading.quantities import unit_of

from ..model.state import Block, Floats
from ..parallel.comm import Comm
from ..parallel.fixed_point import exact_sums
from ..simulation import Simulation
from . import penetration
from .fields import field

_AXES = {"x": 0, "y": 1, "z": 2}
_STRESSES = ("stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy")


def thicknesses(sim: Simulation) -> list[list[list[float]]]:
    """Return the initial thicknesses, m, for each line and part, for every reference that is a penetration; [] for
    other references.

    Collective, equal on all ranks.
    """
    parts = len(sim.model.parts)
    return [
        penetration.thickness(_passed(sim, spec)[0], parts).tolist() if spec.quantity == "penetration" else []
        for spec in sim.case.reference
    ]


def measure(sim: Simulation, folder: Path, thick: list[list[list[float]]]) -> list[Check]:
    """Return the result of every reference of the case. ``thick``: the result of ``thicknesses`` at the start.

    Collective, equal on all ranks.
    """
    fields = {probe.name: probe.field for probe in sim.case.probes}
    pairs = zip(sim.case.reference, thick, strict=True)
    return [_check(spec, _measured(sim, spec, folder, start), fields.get(spec.probe or "")) for spec, start in pairs]


def _check(spec: Reference, value: float, field_name: str | None) -> Check:
    return Check(
        name=spec.title, value=value, expected=spec.value, tolerance=spec.tolerance,
        passed=abs(value - spec.value) <= spec.tolerance, unit=unit_of(spec.quantity, field_name), source=spec.source,
    )  # fmt: skip


def _measured(sim: Simulation, spec: Reference, folder: Path, thick: list[list[float]]) -> float:
    quantity = spec.quantity
    if quantity.startswith("probe_"):
        value = _probe(folder, spec) if sim.comm.rank == 0 else 0.0
        return float(sim.comm.broadcast(value))
    if quantity == "worst_residual":
        return sim.ledger.worst
    if quantity == "contact_time":
        return _maximum(sim.comm, [each.last_push for each in sim.pushing])
    if quantity == "contact_loss":
        return sim.ledger.lost
    if quantity == "speed_mean":
        return _mean_speed(sim, spec)
    if quantity in ("extent", "radius"):
        return _size(sim, spec)
    if quantity == "penetration":
        rows, radius = _passed(sim, spec)
        return penetration.depth(rows, np.array(thick), radius)
    return _largest(sim, spec)


def _maximum(comm: Comm, values: npt.ArrayLike) -> float:
    return float(comm.maximum(np.array([np.max(values, initial=-np.inf)]))[0])


def _blocks(sim: Simulation, part: str | None) -> list[Block]:
    return [b for b in sim.model.blocks if part is None or sim.model.parts[b.part] == part]


def _size(sim: Simulation, spec: Reference) -> float:
    axis = _AXES[spec.axis or "z"]
    corners = [np.zeros(0, np.uint32), *(block.tets.reshape(-1) for block in _blocks(sim, spec.part))]
    x = sim.model.nodes.x[np.concatenate(corners)]
    if spec.quantity == "extent":
        return _maximum(sim.comm, x[:, axis]) + _maximum(sim.comm, -x[:, axis])
    across = np.delete(x, axis, axis=1)
    return _maximum(sim.comm, np.hypot(across[:, 0], across[:, 1]))


def _mean_speed(sim: Simulation, spec: Reference) -> float:
    nodes = sim.model.nodes
    chosen = nodes.owned if sim.erosion is None else nodes.owned & ~sim.erosion.removed
    mass = (nodes.mass if spec.part is None else nodes.mass_of(sim.model.parts.index(spec.part)))[chosen]
    momentum, total = exact_sums(sim.comm, np.column_stack([mass * nodes.v[chosen, _AXES[spec.axis or "z"]], mass]))
    return float(momentum / total) if total > 0.0 else float("nan")


def _largest(sim: Simulation, spec: Reference) -> float:
    names = _STRESSES if spec.quantity == "stress_max" else (spec.quantity.removesuffix("_max"),)
    fields = (field(b, name, sim.model, np.arange(b.n)) for b in _blocks(sim, spec.part) if b.n for name in names)
    return _maximum(sim.comm, [float(np.abs(values).max()) for values in fields])


def _passed(sim: Simulation, spec: Reference) -> tuple[Floats, float]:
    return penetration.passed_by(sim.model, spec.part or "", spec.axis or "z", sim.comm)


def _probe(folder: Path, spec: Reference) -> float:
    with (folder / layout.HISTORY).open(newline="", encoding="utf-8") as file:
        head, *lines = csv.reader(file)
    names = [history.split(text)[0] for text in head]
    t_at, probe_at = names.index("t"), names.index(spec.probe or "")
    rows = [(float(line[t_at]), float(line[probe_at])) for line in lines]
    until = np.inf if spec.until is None else spec.until
    inside = [(t, value) for t, value in rows if spec.since <= t <= until]
    if not inside:
        return float("nan")
    t, values = np.array(inside).T
    if spec.quantity == "probe_last":
        return float(values[-1])
    if spec.quantity == "probe_max":
        return float(values.max())
    if spec.quantity == "probe_min":
        return float(values.min())
    return float(np.trapezoid(values, t) / (t[-1] - t[0])) if len(t) > 1 else float(values[0])
