"""Charts from the journal of a run. Only this module and ``curves`` import matplotlib, because it loads slowly."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conoid.cases.figures import counted, percent, shared_unit
from conoid.cases.messages import AnyMessage, Balance, Load

from ..errors import ClientError
from .curves import save

_COLOURS = {
    "elements": "#4c78a8", "nodes": "#72b7b2", "contact": "#f58518", "fracture": "#e45756", "output": "#54a24b",
    "exchange": "#b5bcc4",
}  # fmt: skip
"""Colours of the phases, in the order in a bar from bottom to top."""
_RANKS = ["#4c78a8", "#f58518", "#54a24b", "#e45756", "#72b7b2", "#b279a2", "#eeca3b", "#9d755d"]
_INK, _FAINT = "#1d2733", "#b5bcc4"
_NAMED = len(_RANKS)
"""Largest number of ranks that have colours of their own in a chart. If a run has more ranks, only the ranks with the
most and the fewest nodes at the end have a colour."""
PAPER = {
    "glass_steel_bar": (
        "Moon, Kim and Lee, fig. 17: 18 cuts on 16 processors, domain 4, by the impact, grows most; "
        "fig. 18: contact and its communication take most of the time"
    ),
}
"""Results of the paper for comparison; the keys are the names of cases."""


@dataclass
class Course:
    """Loads of the ranks of a run over time."""

    times: list[float] = field(default_factory=list)
    """Times of the load messages, s."""
    outside: list[list[int]] = field(default_factory=list)
    """Number of surface nodes of each rank at the times of the load messages."""
    cuts: list[float] = field(default_factory=list)
    """Times at which the load balance changed, s."""
    seconds: dict[str, list[float]] = field(default_factory=dict)
    """CPU time of each rank by phase, s."""


def course(messages: Sequence[AnyMessage]) -> Course:
    """Returns the loads of the ranks over time. Raises ClientError if the journal has no loads.

    A run that continued from a checkpoint computes some times twice. The first loads of these times are dropped;
    their CPU time is counted.
    """
    made = Course()
    for message in messages:
        if isinstance(message, Load):
            while made.times and made.times[-1] >= message.t:
                made.times.pop()
                made.outside.pop()
            made.times.append(message.t)
            made.outside.append(message.outside)
            for name, seconds in message.phases.items():
                before = made.seconds.get(name, [0.0] * len(seconds))
                made.seconds[name] = [a + b for a, b in zip(before, seconds, strict=True)]
        elif isinstance(message, Balance):
            made.cuts = [t for t in made.cuts if t < message.t] + [message.t]
    if not made.times:
        raise ClientError("the run has no messages with the loads of its ranks")
    return made


def balance(balances: Course, title: str, case: str, out: Path) -> None:
    """Writes a PNG file: surface nodes of each rank with the changes of the load balance, and CPU time by phase and
    rank.
    """
    figure = balance_figure(balances)
    figure.suptitle(title, fontsize=11, color=_INK)
    figure.supxlabel(PAPER.get(case, ""), fontsize=8, color=_INK)
    save(figure, out)


def balance_figure(balances: Course) -> Figure:
    """Draws the surface nodes of each rank with the changes of the load balance, and the CPU time by phase and rank."""
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    _outside(left, balances)
    _phases(right, balances.seconds)
    for axes in (left, right):
        axes.set_title(axes.get_title(), fontsize=10, color=_INK)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _outside(axes: Axes, balances: Course) -> None:
    second, unit = shared_unit(balances.times, "s")
    last = balances.outside[-1]
    ranks = len(last)
    named = range(ranks) if ranks <= _NAMED else (last.index(max(last)), last.index(min(last)))
    for t in balances.cuts:
        axes.axvline(
            t / second, color=_FAINT, linewidth=0.8, linestyle=":", label="cut" if t == balances.cuts[0] else None
        )
    palette = iter(_RANKS)
    for rank in sorted(range(ranks), key=lambda r: r in named):
        points = [
            (t / second, row[rank])
            for t, row in zip(balances.times, balances.outside, strict=True)
            if len(row) == ranks
        ]
        style: dict[str, Any] = (
            {"color": next(palette), "label": f"rank {rank}"} if rank in named else {"color": _FAINT}
        )
        axes.plot(*zip(*points, strict=True), linewidth=1.5 if rank in named else 0.7, **style)
    axes.set(xlabel=f"time, {unit}", ylabel="outside nodes", ylim=(0, None), xlim=(0, None))
    title = f"surface nodes: {counted(len(balances.cuts), 'cut')} on {counted(ranks, 'rank')}"
    axes.set_title(title if ranks else "no parts in contact")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, frameon=False)


def _phases(axes: Axes, seconds: dict[str, list[float]]) -> None:
    ranks = len(next(iter(seconds.values())))
    low = [0.0] * ranks
    total = sum(map(sum, seconds.values())) or 1.0
    for name in _COLOURS:
        spent = seconds.get(name, [0.0] * ranks)
        label = f"{name}{' and waiting' if name == 'exchange' else ''} {percent(sum(spent) / total, 0)}"
        axes.bar(range(ranks), spent, bottom=low, color=_COLOURS[name], label=label)
        low = [a + b for a, b in zip(low, spent, strict=True)]
    axes.set(xlabel="rank", ylabel="CPU time, s", xticks=range(0, ranks, max(1, ranks // 16)))
    axes.set_title("CPU time by phase")
    axes.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
