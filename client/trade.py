"""Error over cost: how far each point is from the best limit, which points are worth their cost, and advice."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .convergence import Mesh, Series
from .figures import duration, si
from .quantities import Number
from .richardson import FORMAL, Trend
from .variants import Variant


@dataclass(frozen=True)
class Worth:
    """A variant on a mesh: what it costs, CPU s, and how far its value is from the limit, relative."""

    variant: Variant
    mesh: Mesh
    cost: float
    error: float


@dataclass(frozen=True)
class Target:
    """The limit that errors are measured from, its own uncertainty (relative), and whose it is."""

    value: float
    uncertainty: float
    scale: float
    variant: Variant


def target(all_series: Sequence[Series], number: Number) -> Target | None:
    """The limit with the smallest uncertainty among those that converge or have settled; None where none does."""
    found = [
        (each.limits[number.name], each.variant)
        for each in all_series
        if each.limits[number.name].trend in (Trend.CONVERGES, Trend.SETTLED)
    ]
    if not found:
        return None
    best, variant = min(found, key=lambda pair: pair[0].uncertainty)
    scale = max(number.scale, abs(best.value))
    return Target(best.value, best.uncertainty / scale, scale, variant) if scale > 0.0 else None


def worths(all_series: Sequence[Series], number: Number, goal: Target) -> list[Worth]:
    """Every point that has the quantity, the cheapest first."""
    found = [
        Worth(each.variant, mesh, mesh.cpu, abs(mesh.samples[number.name].mean - goal.value) / goal.scale)
        for each in all_series
        for mesh in each.meshes
        if number.name in mesh.samples
    ]
    return sorted(found, key=lambda worth: (worth.cost, worth.error))


def front(points: Sequence[Worth]) -> list[Worth]:
    """The Pareto front: no other point costs at most as much and has at most its error."""
    kept: list[Worth] = []
    for point in sorted(points, key=lambda worth: (worth.cost, worth.error)):
        if not kept or point.error < kept[-1].error:
            kept.append(point)
    return kept


def advice(all_series: Sequence[Series], number: Number, goal: Target, accuracy: float, own_size: float) -> str:
    """One line: the cheapest point that is accurate enough, or the best one, and what half its size would buy.

    ``accuracy`` is relative, ``own_size`` the smallest element size of the case, m.
    """
    line = front(worths(all_series, number, goal))
    enough = [worth for worth in line if worth.error <= accuracy]
    chosen = enough[0] if enough else line[-1]
    name, size = chosen.variant.form, si(own_size * chosen.mesh.factor, "m")
    said = f"{name} at {size}: {number.name} within {_percent(chosen.error)} for {duration(chosen.cost)} of CPU time"
    order, growth = _order(all_series, number, chosen.variant), _growth(all_series, chosen.variant)
    if math.isnan(order):
        return f"{said}; no order was observed, so nothing is known of finer meshes"
    halved, dearer = chosen.error * (1.0 - 0.5**order), chosen.cost * 2.0**growth
    said += f"; halving the size buys {_percent(halved)} for {duration(dearer)}"
    if enough:
        return said
    share = (accuracy / chosen.error) ** (1.0 / order)
    wanted, cost = own_size * chosen.mesh.factor * share, chosen.cost * share**-growth
    return f"{said}; {_percent(accuracy)} would need about {si(wanted, 'm')} and {duration(cost)}"


def _order(all_series: Sequence[Series], number: Number, variant: Variant) -> float:
    found = next(each for each in all_series if each.variant == variant).limits[number.name]
    return min(found.order, FORMAL) if found.trend is Trend.CONVERGES else math.nan


def _growth(all_series: Sequence[Series], variant: Variant) -> float:
    """Exponent of the cost in 1 / size, from the finest and the coarsest mesh; 4, that of theory, from one mesh."""
    meshes = next(each for each in all_series if each.variant == variant).meshes
    fine, coarse = meshes[0], meshes[-1]
    if fine.size >= coarse.size or not (fine.cpu > 0.0 and coarse.cpu > 0.0):
        return 4.0
    return math.log(fine.cpu / coarse.cpu) / math.log(coarse.size / fine.size)


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
