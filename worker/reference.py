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
from .state import Block, Floats, Tets

_AXES = {"x": 0, "y": 1, "z": 2}
_STRESSES = ("stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy")


def thicknesses(sim: Simulation) -> list[float]:
    """For every reference that asks for a penetration: what there is to be pierced, m; zero for the others.

    All ranks take part, all get the same answer.
    """
    return [_thickness(sim, spec) if spec.quantity == "penetration" else 0.0 for spec in sim.case.reference]


def measure(sim: Simulation, folder: Path, thick: list[float]) -> list[Check]:
    """Every reference of the case, measured; ``thick`` as ``thicknesses`` gave it at the start.

    All ranks take part, all get the same answer.
    """
    fields = {probe.name: probe.field for probe in sim.case.probes}
    pairs = zip(sim.case.reference, thick, strict=True)
    return [_check(spec, _measured(sim, spec, folder, start), fields.get(spec.probe or "")) for spec, start in pairs]


def _check(spec: Reference, value: float, field_name: str | None) -> Check:
    return Check(
        name=_name(spec), value=value, expected=spec.value, tolerance=spec.tolerance,
        passed=abs(value - spec.value) <= spec.tolerance, unit=unit_of(spec.quantity, field_name), source=spec.source,
    )  # fmt: skip


def _name(spec: Reference) -> str:
    return " ".join(word for word in (spec.quantity, spec.part, spec.probe, spec.axis) if word)


def _measured(sim: Simulation, spec: Reference, folder: Path, thick: float) -> float:
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
        return thick - _thickness(sim, spec)
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
    chosen = nodes.owned if spec.part is None else nodes.owned & (nodes.part == sim.model.parts.index(spec.part))
    if sim.erosion is not None:
        chosen = chosen & ~sim.erosion.removed
    mass = nodes.mass[chosen]
    momentum, total = exact_sums(sim.comm, np.column_stack([mass * nodes.v[chosen, _AXES[spec.axis or "z"]], mass]))
    return float(momentum / total)


def _largest(sim: Simulation, spec: Reference) -> float:
    names = _STRESSES if spec.quantity == "stress_max" else (spec.quantity.removesuffix("_max"),)
    fields = (field(b, name, sim.model, np.arange(b.n)) for b in _blocks(sim, spec.part) for name in names)
    return _maximum(sim.comm, [float(np.abs(values).max(initial=0.0)) for values in fields])


_LINES = (0.1, 0.3, 0.5)
"""Distances from the axis, of the radius of the part, at which the thickness that is left is measured."""


def _thickness(sim: Simulation, spec: Reference) -> float:
    """The mean of what lines along the axis pass of the other parts, m.

    The lines lie between the two directions across the axis, where every sector of a body is modelled.
    """
    nodes, axis = sim.model.nodes, _AXES[spec.axis or "z"]
    own = np.delete(nodes.x0[nodes.part == sim.model.parts.index(spec.part or "")], axis, axis=1)
    radius = _maximum(sim.comm, np.hypot(*own.T))
    at = [float(share * radius / np.sqrt(2.0)) for share in _LINES]
    others = [block for block in sim.model.blocks if sim.model.parts[block.part] != spec.part]
    chords = [np.column_stack([chord_lengths(nodes.x, block.tets, axis, (c, c)) for c in at]) for block in others]
    return float(exact_sums(sim.comm, np.concatenate([np.zeros((0, len(_LINES))), *chords])).mean())


def chord_lengths(x: Floats, tets: Tets, axis: int, at: tuple[float, float]) -> Floats:
    """(n,) length of a line along ``axis`` inside each tet, m; ``at``: where it passes the two directions across.

    The line is moved aside by some 1e-6 of its distance from the axis: in a face it would belong to two tets.
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    aside = 1e-6 * max(map(abs, at))
    at = (at[0] + aside, at[1] + 0.618 * aside)
    low, high = (f(f(x[tets[:, 0]], x[tets[:, 1]]), f(x[tets[:, 2]], x[tets[:, 3]])) for f in (np.minimum, np.maximum))
    met = np.flatnonzero(
        (low[:, i] <= at[0]) & (high[:, i] >= at[0]) & (low[:, j] <= at[1]) & (high[:, j] >= at[1])
    )  # fmt: skip
    corners = x[tets[met]]
    point = np.zeros(3)
    point[i], point[j] = at
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    start = np.einsum("pi,pij->pj", point - corners[:, 0], inverse)
    start = np.column_stack([1.0 - start.sum(axis=1), start])
    slope = np.column_stack([-inverse[:, axis].sum(axis=1), inverse[:, axis]])
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -start / slope
    enters = np.where(slope > 0.0, crossing, np.where((slope == 0.0) & (start < 0.0), np.inf, -np.inf)).max(axis=1)
    leaves = np.where(slope < 0.0, crossing, np.inf).min(axis=1)
    lengths = np.zeros(len(tets))
    lengths[met] = np.maximum(leaves - enters, 0.0)
    return lengths


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
