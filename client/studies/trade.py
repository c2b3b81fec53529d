"""Error over cost: distance of each point from the best limit, Pareto front, and advice."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from conoid.cases.figures import duration, exact, si
from conoid.cases.warnings.damping import WORDS

from .convergence import Mesh, Series
from .quantities import Number
from .richardson import FORMAL, Trend
from .variants import Variant

_VAGUE = 0.3
"""Relative uncertainty above which a limit is not used as the target of errors (chosen value)."""


@dataclass(frozen=True)
class Worth:
    """A variant on one mesh, with its cost in CPU s and its relative error."""

    variant: Variant
    mesh: Mesh
    cost: float
    error: float


@dataclass(frozen=True)
class Target:
    """The limit from which errors are measured, with its relative uncertainty and its variant."""

    value: float
    uncertainty: float
    scale: float
    variant: Variant


def target(all_series: Sequence[Series], number: Number, own: Variant | None = None) -> Target | None:
    """Returns the limit that is the target of errors. The target is the limit of ``own``, the variant of the case, if
    this variant converges; otherwise the limit with the smallest uncertainty. The smallest uncertainty alone does not
    decide, because a pressure form that locks can converge to a wrong limit. The function returns None if no variant
    converges.
    """
    found = [(each.limits[number.name], each.variant) for each in all_series if _sure(each, number)]
    if not found:
        return None
    best, variant = min(found, key=lambda pair: (pair[1] != own, pair[0].uncertainty))
    scale = max(number.scale, abs(best.value))
    known = scale > 0.0 and best.uncertainty <= _VAGUE * scale
    return Target(best.value, best.uncertainty / scale, scale, variant) if known else None


def _sure(series: Series, number: Number) -> bool:
    return series.limits[number.name].trend in (Trend.CONVERGES, Trend.SETTLED)


def elsewhere(all_series: Sequence[Series], number: Number, goal: Target) -> list[Variant]:
    """Returns the variants whose limit differs from the target by more than the uncertainties of both limits."""
    return [
        each.variant
        for each in all_series
        if _sure(each, number)
        and abs(each.limits[number.name].value - goal.value)
        > each.limits[number.name].uncertainty + goal.uncertainty * goal.scale
    ]


def worths(all_series: Sequence[Series], number: Number, goal: Target) -> list[Worth]:
    """Returns all points of the study that have the quantity, the cheapest point first."""
    found = [
        Worth(each.variant, mesh, mesh.cpu, _error(mesh.samples[number.name].mean, each, number, goal) / goal.scale)
        for each in all_series
        for mesh in each.meshes
        if number.name in mesh.samples
    ]
    return sorted(found, key=lambda worth: (worth.cost, worth.error))


def _error(value: float, series: Series, number: Number, goal: Target) -> float:
    """Returns the distance of a value to the limit of its own variant, plus the distance of this limit to the
    target. Errors that cancel by chance therefore do not count as accuracy. If the variant has no limit, its
    uncertainty replaces the first distance.
    """
    own = series.limits[number.name]
    if _sure(series, number):
        return abs(value - own.value) + abs(own.value - goal.value)
    return abs(value - goal.value) + (0.0 if math.isnan(own.uncertainty) else own.uncertainty)


def front(points: Sequence[Worth]) -> list[Worth]:
    """Returns the Pareto front: points for which no other point costs at most as much and has at most the same
    error.
    """
    kept: list[Worth] = []
    for point in sorted(points, key=lambda worth: (worth.cost, worth.error)):
        if not kept or point.error < kept[-1].error:
            kept.append(point)
    return kept


def advice(all_series: Sequence[Series], number: Number, goal: Target, accuracy: float, own_size: float) -> str:
    """Returns one line of advice: the cheapest point that is accurate enough, or else the most accurate point, and
    what half of its element size would give. ``accuracy``: required relative error; ``own_size``: smallest element
    size of the case, m.
    """
    line = front(worths(all_series, number, goal))
    enough = [worth for worth in line if worth.error <= accuracy]
    chosen = enough[0] if enough else line[-1]
    name, size = chosen.variant.form, si(own_size * chosen.mesh.factor, "m")
    text = f"{name} at {size}: {number.name} within {_percent(chosen.error)} for {duration(chosen.cost)} of CPU time"
    text += f"; {name} {WORDS}" if name == "split" else ""
    order, growth = _order(all_series, number, chosen.variant), _growth(all_series, chosen.variant)
    if math.isnan(order):
        return f"{text}; no order was observed, so the errors on finer meshes are unknown"
    halved, dearer = chosen.error * (1.0 - 0.5**order), chosen.cost * 2.0**growth
    text += f"; half of this size would give {_percent(halved)} for {duration(dearer)}"
    if enough:
        return text
    share = (accuracy / chosen.error) ** (1.0 / order)
    wanted, cost = own_size * chosen.mesh.factor * share, chosen.cost * share**-growth
    return f"{text}; {_percent(accuracy)} would need about {si(wanted, 'm')} and {duration(cost)}"


def _order(all_series: Sequence[Series], number: Number, variant: Variant) -> float:
    found = next(each for each in all_series if each.variant == variant).limits[number.name]
    return min(found.order, FORMAL) if found.trend is Trend.CONVERGES else math.nan


def _growth(all_series: Sequence[Series], variant: Variant) -> float:
    """Returns the exponent of the cost as a power of 1 / size, from the finest and the coarsest mesh. With one mesh
    the theoretical value 4 is returned.
    """
    meshes = next(each for each in all_series if each.variant == variant).meshes
    fine, coarse = meshes[0], meshes[-1]
    if fine.size >= coarse.size or not (fine.cpu > 0.0 and coarse.cpu > 0.0):
        return 4.0
    return math.log(fine.cpu / coarse.cpu) / math.log(coarse.size / fine.size)


def _percent(share: float) -> str:
    return exact(100.0 * share, "%", 2)
