"""Charts of the benchmarks: cost and error of a Taylor bar; growth with the mesh; paths of cracks."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from .accuracy import BARS, Answer
from .contact_cost import DOMAINS, kinds
from .contact_cost import Run as Ranks
from .cracks import Run
from .growth import Growth
from .scene import FORMS

_TITLES = {"taylor_copper": "Copper, 227 m/s", "taylor_42crmo4": "42CrMo4 steel, 287 m/s"}
_COLOURS = {"standard": "#999999", "nodal": "#1b6ca8", "split": "#c8553d"}
_MARKS = {"standard": "s", "nodal": "o", "split": "^"}


def speed_and_error(answers: Sequence[Answer], path: Path, limits: dict[tuple[str, str], float] | None = None) -> None:
    """Draws the final length and foot radius of both bars over the CPU time as a PNG, one curve for each pressure form.
    The shaded band is the tolerance of the reference in the case; ``limits`` has the results of another method, by bar
    and quantity.
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


def paths(runs: Sequence[Run], path: Path, across: tuple[float, float] = (-20, 20)) -> None:
    """Draws the open facets of plates with a slit as a PNG, one panel for each mesh, coloured by the time of opening.
    The argument ``across`` is the range of y, mm.
    """
    size = 10, 2.4 + 0.055 * (across[1] - across[0])
    figure, axes = plt.subplots(-(-len(runs) // 3), 3, figsize=size, sharex=True, sharey=True, layout="constrained")
    for ax, run in zip(axes.ravel(), runs, strict=False):
        crack = run.crack
        x, y = 1e3 * crack.centre[:, 0], 1e3 * crack.centre[:, 1]
        dots = ax.scatter(x, y, c=1e6 * crack.time, s=5, cmap="viridis", vmin=14, vmax=80)
        ax.plot([0, 1e3 * crack.begin], [0, 0], color="black", linewidth=1)
        ax.set(title=run.plan.name, xlim=(40, 1e3 * crack.end), ylim=across, aspect="equal")
        ax.title.set_fontsize(10)
    figure.supxlabel("x, mm", fontsize=10)
    figure.supylabel("y, mm", fontsize=10)
    figure.colorbar(dots, ax=axes, label="open since, us", shrink=0.8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def growth(sizes: Sequence[Growth], path: Path) -> None:
    """Draws CPU time per tet and step, and bytes per tet, over the number of tets as a PNG, for elastic and armed
    boxes. The memory of a process without a mesh is subtracted from the bytes.
    """
    figure, (cost, memory) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for armed, name in ((False, "elastic"), (True, "fracture and contact armed")):
        series = [s for s in sizes if s.armed == armed]
        tets, colour = [s.tets for s in series], _COLOURS["split" if armed else "nodal"]
        cost.plot(tets, [s.best for s in series], "o-", color=colour, label=name)
        cost.plot(tets, [s.median for s in series], "o", color=colour, markerfacecolor="white", zorder=1)
        memory.plot(tets, [s.bytes_each[0] for s in series], "^--", color=colour, label=f"{name}, while it is set up")
        memory.plot(tets, [s.bytes_each[1] for s in series], "o-", color=colour, label=f"{name}, while it steps")
    cost.plot([s.tets for s in sizes if not s.armed], [s.limit for s in sizes if not s.armed], "s:", color="#999999",
              label="gather and scatter alone")  # fmt: skip
    cost.set(ylabel="CPU ns a tet and step: best, open: median")
    memory.set(ylabel="bytes a tet")
    for ax in (cost, memory):
        ax.set(xscale="log", xlabel="tets", ylim=(0, None))
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def domains(found: Mapping[str, Sequence[Ranks]], steps: int, path: Path) -> None:
    """Draws faces and CPU time of each rank for box and arbitrary contact domains as a PNG, and the change with time on
    two ranks."""
    figure, (looked, cpu, course) = plt.subplots(1, 3, figsize=(14, 4), layout="constrained")
    for name, colour, shift in zip(DOMAINS, (_COLOURS["split"], _COLOURS["nodal"]), (-0.2, 0.2), strict=True):
        numbers = kinds(found[name], steps)
        for ax, kind in ((looked, "faces of a search"), (cpu, "contact, CPU s")):
            at = [k + 1 + shift for k in range(len(numbers[kind]))]
            ax.bar(at, numbers[kind], 0.4, color=colour, label=name)
            ax.set(xlabel="rank", ylabel=kind, xticks=range(1, len(at) + 1))
        for rank, style in ((0, "-"), (5, "--")):
            looks = found[name][0][rank]["course"]
            course.plot([look[0] for look in looks], [look[2] for look in looks], style, color=colour, linewidth=1,
                        label=f"{name}, {'1st' if rank == 0 else '6th'} rank")  # fmt: skip
    course.set(xlabel="time, us", ylabel="faces sent, a search", ylim=(0, None))
    for ax in (looked, cpu, course):
        ax.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=100)
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
