"""Curves of a run: energy, fragments, time step and columns of the history, also for two runs in one figure. The
module needs matplotlib.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conoid.cases.figures import counted, exact, shared_unit
from conoid.cases.output import history
from conoid.cases.output.fragments import DUST

from ..columns import Columns, by_part
from ..errors import ClientError, UsageError
from ..local.atomic import whole
from .compare import Material

_INK, _FAINT = "#1d2733", "#b5bcc4"
_COLOURS = (
    "#4c78a8", "#f58518", "#54a24b", "#e45756", "#72b7b2", "#b279a2", "#eeca3b", "#9d755d", "#ff9da6", "#8c96a3",
)  # fmt: skip
_LEDGER = (
    "elastic", "cohesive", "plastic", "viscous", "contact", "friction", "eroded", "fracture", "stepping", "averaging",
)  # fmt: skip
_DASHES = ("-", "--", ":")
_LIMITERS = 6
"""Largest number of limits of the time step that have colours of their own (chosen value)."""
_PROBES = 8
"""Largest number of curves in a panel (chosen value)."""


def save(figure: Figure, out: Path) -> Path:
    """Writes a figure as PNG, or in the format of the file's ending. Raises ClientError, UsageError if the ending is
    unknown.
    """
    try:
        with whole(out) as part:
            figure.savefig(part, dpi=100)
    except ValueError as error:
        raise UsageError(f"{out}: cannot be written: {error}") from None
    return out


def energy(course: Columns) -> Figure:
    """Draws four panels: the energy balance; its terms without the kinetic energy; the residual; and, for several
    parts, the kinetic and the internal energy of each part.
    """
    parts = {name: _largest(some) for name, some in by_part(course).items()}
    figure, (left, middle, right, *others) = _panels(3 + len(parts))
    _balance(left, course)
    terms = {name: course.numbers(name) for name in _LEDGER if name in course and any(course.numbers(name))}
    _energies(middle, course, terms, "without the kinetic term")
    times, label = _time(course)
    positive = [value if value > 0.0 else math.nan for value in course.numbers("residual")]
    right.semilogy(times, positive, color=_INK, linewidth=1.2)
    _name(right, "residual of the ledger", "relative to the largest energy input", label)
    for axes, (name, some) in zip(others, parts.items(), strict=True):
        _energies(axes, course, some, f"{name} energy of each part")
    return figure


def _balance(axes: Axes, course: Columns) -> None:
    """Draws the kinetic energy, the energy that came in, and the sum of all terms."""
    came = [a + b for a, b in zip(course.numbers("initial"), course.numbers("external"), strict=True)]
    there = ("kinetic", *(name for name in _LEDGER if name in course))
    total = [math.fsum(values) for values in zip(*(course.numbers(name) for name in there), strict=True)]
    times, label = _time(course)
    worth, unit = shared_unit([*came, *total], "J")
    curves = (
        ("kinetic", course.numbers("kinetic"), "#4c78a8", "-"), ("initial + external", came, _INK, "-"),
        ("sum of all terms", total, "#e45756", "--"),
    )  # fmt: skip
    for name, values, colour, dash in curves:
        axes.plot(times, [value / worth for value in values], dash, color=colour, label=name, linewidth=1.3)
    _name(axes, "energy", f"energy, {unit}", label, ylim=(0, None))


def _energies(axes: Axes, course: Columns, curves: Mapping[str, Sequence[float]], title: str) -> None:
    """Draws energies in one unit, each with a colour of its own."""
    times, label = _time(course)
    worth, unit = shared_unit([value for values in curves.values() for value in values], "J")
    for (name, values), colour in zip(curves.items(), _COLOURS * len(curves), strict=False):
        axes.plot(times, [value / worth for value in values], color=colour, label=name, linewidth=1.4)
    _name(axes, title, f"energy, {unit}", label)


def _largest(curves: dict[str, Sequence[float]]) -> dict[str, Sequence[float]]:
    """Returns the curves with the largest maxima, as many as one panel can have."""
    chosen = sorted(curves, key=lambda name: -max(curves[name], default=0.0))[:_PROBES]
    return {name: curves[name] for name in curves if name in chosen}


def steps(course: Columns) -> Figure:
    """Draws the length of the time step in the colour of the condition that limits it."""
    figure, (axes,) = _panels(1)
    held = [_limiter(text) for text in course["limiter"] if isinstance(text, str)] or [""] * course.rows
    often = sorted(set(held), key=lambda name: -held.count(name))[:_LIMITERS]
    times, label = _time(course)
    worth, unit = shared_unit(course.numbers("dt"), "s")
    points = list(zip(times, [dt / worth for dt in course.numbers("dt")], held, strict=True))
    axes.plot([t for t, _, _ in points], [dt for _, dt, _ in points], color=_FAINT, linewidth=0.7)
    for name, colour in zip((*often, "others"), (*_COLOURS[:_LIMITERS], _FAINT), strict=False):
        some = [(t, dt) for t, dt, by in points if by == name or (name == "others" and by not in often)]
        if some:
            axes.plot(*zip(*some, strict=True), ".", markersize=3, color=colour, label=name or "not known")
    _name(axes, "time step, coloured by its limiter", f"dt, {unit}", label, ylim=(0, None))
    return figure


def _limiter(text: str) -> str:
    """Returns the condition that limits the time step, and its part: ``stability: glass`` for ``stability: tet 12 of
    glass``.
    """
    what, _, where = text.partition(":")
    return f"{what}: {where.rpartition(' of ')[2].strip()}" if where else what


def fragments(tables: Sequence[Columns]) -> Figure:
    """Draws the number of fragments in each frame, the mass fraction of the largest fragment, and N(m) of the last
    frame with its fitted laws.
    """
    if not tables or not any(table.rows for table in tables):
        raise ClientError("the run has no tables of fragments, because no part of it can break")
    figure, (left, right) = _panels(2)
    counted = [table for table in tables if table.rows]
    worth, unit = shared_unit([table.numbers("t")[0] for table in counted], "s")
    t = [table.numbers("t")[0] / worth for table in counted]
    whole = [sum(tets >= DUST for tets in table.numbers("tets")) for table in counted]
    left.plot(t, [table.rows for table in counted], ".-", color=_COLOURS[0], label="all")
    left.plot(t, whole, ".-", color=_COLOURS[1], label=f"of {DUST} tets or more")
    left.set_yscale("symlog", linthresh=1.0)
    distribution(right, {"": counted[-1]})
    _name(left, "fragments", "number", f"time, {unit}", ylim=(0, None))
    return figure


def distribution(axes: Axes, tables: Mapping[str, Columns]) -> None:
    """Draws N(m), the number of fragments with the mass m or more, with two logarithmic axes."""
    for (name, table), colour in zip(tables.items(), _COLOURS, strict=False):
        masses = sorted((1e3 * mass for mass in table.numbers("mass") if mass > 0.0), reverse=True)
        when = exact(table.numbers("t")[0], "s", 4) if table.rows else ""
        label = ", ".join(filter(None, [name, when, counted(len(masses), "fragment")]))
        axes.step(masses, range(1, len(masses) + 1), where="post", color=colour, label=label, linewidth=1.4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _name(axes, "N(m): fragments of mass m or more", "N", "m, g")


def columns(course: Columns, names: Sequence[str] = ()) -> Figure:
    """Draws columns of a history, with one panel for each unit. By default the columns of the probes are drawn.
    Raises ClientError.
    """
    return overlaid({"": course}, names or probes(course) or ["momentum_x", "momentum_y", "momentum_z"])


def probes(course: Columns) -> list[str]:
    """Returns the names of the history columns that belong to probes."""
    return [name for name in course if name not in history.COLUMNS and history.part_of(name) is None]


def overlaid(runs: Mapping[str, Columns], names: Sequence[str], spare: int = 0) -> Figure:
    """Draws columns of several runs: a panel for each unit, a colour for each column, a dash pattern for each run.
    The last ``spare`` panels stay empty. Raises ClientError.
    """
    groups = _by_unit(runs, names)
    figure, panels = _panels(len(groups) + spare)
    for (unit, some), axes in zip(groups.items(), panels, strict=False):
        what = ", ".join(some) if len(some) < 4 else f"{some[0]}, {some[1]} and {len(some) - 2} more"
        _overlay(axes, runs, some, unit, what if len(runs) == 1 else _dashed(runs))
    return figure


def _overlay(axes: Axes, runs: Mapping[str, Columns], names: Sequence[str], unit: str, title: str) -> None:
    """Draws columns with equal units of several runs."""
    curves = [course.numbers(name) for name in names for course in runs.values() if name in course]
    worth, unit = shared_unit([value for curve in curves for value in curve], unit)
    second, when = shared_unit([t for course in runs.values() for t in course.numbers("t")], "s")
    for name, colour in zip(names, _COLOURS * len(names), strict=False):
        for (run, course), dash in zip(runs.items(), _DASHES, strict=False):
            if name in course:
                key = name if run == next(iter(runs)) else None
                times = [t / second for t in course.numbers("t")]
                values = [value / worth for value in course.numbers(name)]
                axes.plot(times, values, dash, color=colour, label=key, linewidth=1.3)
    _name(axes, title, unit or "1", f"time, {when}")


def _dashed(runs: Mapping[str, Columns]) -> str:
    """Adds a legend that assigns dash patterns to runs."""
    return ", ".join(f"{run} {mark}" for run, mark in zip(runs, ("——", "– –", "· ·"), strict=False))


def comparison(material: Material) -> Figure:
    """Draws two runs: the columns of both histories in the same panels, and the masses of the fragments of both
    runs.
    """
    figure = overlaid(material.histories, material.columns, 1 if material.fragments else 0)
    if material.fragments:
        distribution(figure.axes[-1], material.fragments)
    return figure


def _by_unit(runs: Mapping[str, Columns], names: Sequence[str]) -> dict[str, list[str]]:
    """Returns the names of columns by unit, in their order. A unit has at most as many names as a panel can have
    curves.
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        course = next((course for course in runs.values() if name in course), next(iter(runs.values())))
        course.numbers(name)
        unit = course.units[name]
        groups.setdefault(unit, [])
        if len(groups[unit]) < _PROBES:
            groups[unit].append(name)
    return groups


def _panels(n: int) -> tuple[Figure, list[Axes]]:
    across = min(n, 3)
    down = -(-n // across)
    figure = Figure(figsize=(5.2 * across if across > 1 else 7.5, 3.8 * down), layout="constrained")
    axes: Any = figure.subplots(down, across, squeeze=False)
    every = list(axes.flat)
    for unused in every[n:]:
        unused.remove()
    return figure, every[:n]


def _name(axes: Axes, title: str, ylabel: str, xlabel: str, **limits: Any) -> None:
    axes.set(xlabel=xlabel, ylabel=ylabel, **limits)
    axes.set_title(title, fontsize=10, color=_INK)
    axes.spines[["top", "right"]].set_visible(False)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, frameon=False)


def _time(course: Columns) -> tuple[list[float], str]:
    """Returns the times of a history in a unit that suits them, and the label of the axis."""
    worth, unit = shared_unit(course.numbers("t"), "s")
    return [t / worth for t in course.numbers("t")], f"time, {unit}"
