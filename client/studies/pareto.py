"""Picture of error over cost: one panel for each quantity that converges, with the Pareto front. The module needs
matplotlib.
"""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conoid.cases.figures import exact

from . import trade
from .converged import Book
from .quantities import Number
from .trade import Target

_COLOURS = ("#4c78a8", "#f58518", "#54a24b", "#e45756", "#72b7b2", "#b279a2")
_PANELS = 6
"""Largest number of quantities in the picture (chosen value)."""
_LEAST = 1e-6
"""Relative error that is drawn for an error of 0, because the axis is logarithmic (chosen value)."""


def figure(book: Book) -> Figure:
    """Draws error over cost for each quantity. Quantities without differences between the meshes are left out if
    other quantities have differences.
    """
    goals = book.goals()
    shown = (book.moving() or list(goals))[:_PANELS]
    across = max(1, min(len(shown), 3))
    down = max(1, -(-len(shown) // across))
    made = Figure(figsize=(4.6 * across, 3.7 * down), layout="constrained")
    for index, name in enumerate(shown):
        _panel(made.add_subplot(down, across, index + 1), book, *goals[name])
    made.suptitle(f"{book.case}: error over cost", fontsize=11)
    return made


def _panel(axes: Axes, book: Book, number: Number, goal: Target) -> None:
    points = trade.worths(book.series, number, goal)
    errors = [_percent(p.error) for p in points] + [_percent(goal.uncertainty)]
    axes.set(xscale="log", yscale="log", ylim=(0.3 * min(errors), 3.0 * max(errors)))
    axes.set(xlabel="CPU time, s", ylabel="from the limit, %")
    for colour, series in zip(_COLOURS * len(book.series), book.series, strict=False):
        mine = sorted((p for p in points if p.variant == series.variant), key=lambda p: p.mesh.size)
        axes.plot([p.cost for p in mine], [_percent(p.error) for p in mine], "o-", color=colour, markersize=4,
                  linewidth=1.0, label=str(series.variant))  # fmt: skip
        for p in (mine[0], mine[-1]) if mine else ():
            axes.annotate(exact(book.own_size * p.mesh.factor, "m", 3), (p.cost, _percent(p.error)), fontsize=7,
                          xytext=(3, 4), textcoords="offset points")  # fmt: skip
    front = trade.front(points)
    axes.plot([p.cost for p in front], [_percent(p.error) for p in front], color="#1d2733", linewidth=3.5, alpha=0.18,
              label="Pareto front")  # fmt: skip
    axes.axhspan(_percent(0.0), _percent(goal.uncertainty), color="#e8e4d8", zorder=0, label="uncertainty of the limit")
    axes.set_title(number.name, fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, frameon=False)


def _percent(share: float) -> float:
    return 100.0 * max(share, _LEAST)
