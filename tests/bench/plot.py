"""Speed against error, drawn: what a quantity of a Taylor bar costs, how it approaches its limit; paths of cracks."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from .accuracy import BARS, Answer
from .cracks import Run
from .scene import FORMS

_TITLES = {"taylor_copper": "Copper, 227 m/s", "taylor_42crmo4": "42CrMo4 steel, 287 m/s"}
_COLOURS = {"standard": "#999999", "nodal": "#1b6ca8", "split": "#c8553d"}
_MARKS = {"standard": "s", "nodal": "o", "split": "^"}


def speed_and_error(answers: Sequence[Answer], path: Path, limits: dict[tuple[str, str], float] | None = None) -> None:
    """Final length and foot radius of both bars against the CPU time, one line a pressure form, as a PNG.

    The band is the tolerance of the case's reference; ``limits`` are answers of another method, by bar and quantity.
    """
    figure, axes = plt.subplots(2, 2, figsize=(10, 7), sharex="row", layout="constrained")
    for row, bar in enumerate(BARS):
        for column, (quantity, name) in enumerate((("radius", "foot radius"), ("extent", "length"))):
            ax = axes[row][column]
            _panel(ax, [a for a in answers if a.plan.bar == bar and a.checks], quantity)
            if limits and (bar, quantity) in limits:
                ax.axhline(limits[bar, quantity], color="black", linestyle=":", linewidth=1, label="axisymmetric quads")
            ax.set_ylabel(f"final {name}, mm")
            ax.set_title(f"{_TITLES[bar]}: {name}", fontsize=10)
        axes[row][0].legend(fontsize=8, frameon=False)
    for ax in axes[1]:
        ax.set_xlabel("CPU time of the run, s (one core)")
    figure.savefig(path, dpi=120)
    plt.close(figure)


def paths(runs: Sequence[Run], path: Path) -> None:
    """The open facets of plates with a slit, a panel a mesh, coloured by when they opened, as a PNG."""
    figure, axes = plt.subplots(
        -(-len(runs) // 3), 3, figsize=(10, 4.6), sharex=True, sharey=True, layout="constrained"
    )
    for ax, run in zip(axes.ravel(), runs, strict=False):
        crack = run.crack
        x, y = 1e3 * crack.centre[:, 0], 1e3 * crack.centre[:, 1]
        dots = ax.scatter(x, y, c=1e6 * crack.time, s=5, cmap="viridis", vmin=14, vmax=80)
        ax.plot([0, 1e3 * crack.begin], [0, 0], color="black", linewidth=1)
        ax.set(title=run.plan.name, xlim=(40, 1e3 * crack.end), ylim=(-20, 20), aspect="equal")
        ax.title.set_fontsize(10)
    figure.supxlabel("x, mm", fontsize=10)
    figure.supylabel("y, mm", fontsize=10)
    figure.colorbar(dots, ax=axes, label="open since, us", shrink=0.8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _panel(ax: Axes, answers: Sequence[Answer], quantity: str) -> None:
    for form in FORMS:
        for safety in sorted({a.plan.safety for a in answers}, reverse=True):
            plain = [a for a in answers if a.plan.form == form and a.plan.safety == safety]
            plain = [a for a in plain if a.plan.generator == "structured" and a.plan.viscosity]
            plain.sort(key=lambda a: a.tets)
            if plain:
                _line(ax, plain, quantity, form, safety)
    reference = next((c for a in answers for c in a.checks if c.name.startswith(quantity)), None)
    if reference is not None:
        low, high = (1000 * (reference.expected + sign * reference.tolerance) for sign in (-1, 1))
        ax.axhspan(low, high, color="#e8e4d8", zorder=0, label="reference and tolerance")
    ax.set_xscale("log")
    ax.grid(alpha=0.3)


def _line(ax: Axes, answers: Sequence[Answer], quantity: str, form: str, safety: float) -> None:
    whole = safety == max(a.plan.safety for a in answers) and safety > 0.5
    cost, value = [a.cpu for a in answers], [1000 * a.value(quantity) for a in answers]
    ax.plot(
        cost, value, color=_COLOURS[form], marker=_MARKS[form], markersize=5, linewidth=1.2 if whole else 0.8,
        markerfacecolor=_COLOURS[form] if whole else "white", linestyle="-" if whole else "--",
        label=f"{form}, dt safety {safety:g}",
    )  # fmt: skip
    if whole and form == "nodal":
        for a, x, y in zip(answers, cost, value, strict=True):
            ax.annotate(f"{a.tets / 1000:.3g}k", (x, y), textcoords="offset points", xytext=(3, -10), fontsize=7)
