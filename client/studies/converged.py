"""Report of a convergence study as text and JSON: values on each mesh with their limits, error over cost, advice."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from conoid.cases.figures import alike, count, duration, exact, fixed, number, si

from . import trade
from .convergence import Done, Series
from .quantities import Number
from .richardson import Trend
from .scatter import differ, runs_needed
from .study import table
from .trade import Target
from .variants import Variant

_ENOUGH = 0.05
"""Relative difference of two means. The table of ensembles gives the number of runs that is needed to detect this
difference (chosen value)."""


@dataclass(frozen=True)
class Book:
    """All results of a convergence study."""

    case: str
    changes: Sequence[str]
    own: Variant
    """Pressure form and time step that the case itself has."""
    own_size: float
    """Smallest element size of the case, m."""
    members: int
    vary: str
    accuracy: float
    done: Sequence[Done]
    series: Sequence[Series]
    numbers: Sequence[Number]

    @property
    def failed(self) -> list[Done]:
        """Runs of the study that failed."""
        return [each for each in self.done if each.problem]

    def goals(self) -> dict[str, tuple[Number, Target]]:
        """Targets of the errors by name of the quantity, references first; only quantities for which at least one
        variant converges.
        """
        found = {each.name: (each, trade.target(self.series, each, self.own)) for each in self.numbers}
        return {name: (each, goal) for name, (each, goal) in found.items() if goal is not None}

    def leading(self, wanted: str | None = None) -> str | None:
        """Quantity of the advice: the requested quantity, otherwise the first quantity that converges and differs
        between the meshes. A quantity without differences between meshes is not used if a reference has no limit.
        """
        goals = self.goals()
        if wanted is not None:
            return next((name for name in goals if wanted in name), None)
        return next(iter(self.moving() or ([] if self.open_references() else goals)), None)

    def open_references(self) -> list[Number]:
        """References of the case for which no limit was found on these meshes."""
        goals = self.goals()
        return [each for each in self.numbers if each.expected is not None and each.name not in goals]

    def moving(self) -> list[str]:
        """Names of the quantities that converge, have a relative error, and differ between the meshes."""
        return [
            name
            for name, (each, _) in self.goals().items()
            if not each.of_nothing and any(s.limits[name].trend is Trend.CONVERGES for s in self.series)
        ]

    def advice(self, wanted: str | None = None) -> str:
        """The advice of the study in one line."""
        name = self.leading(wanted)
        if name is None and wanted is not None:
            return f"No quantity named {wanted!r} converges on these meshes."
        if name is None:
            return self._nothing()
        each, goal = self.goals()[name]
        return trade.advice(self.series, each, goal, self.accuracy, self.own_size)

    def _nothing(self) -> str:
        """Returns the advice of a study without an error that can be compared with the cost."""
        text = "No quantity converges on these meshes, so the study has no error to compare with the cost"
        if len(self.series) > 1:
            text += "; the table of variants shows the differences between variants"
        own = next((each for each in self.series if each.variant == self.own), None)
        for each in self.open_references():
            if own is None or each.name not in own.meshes[0].samples:
                continue
            mesh, limit = own.meshes[0], own.limits[each.name]
            if not math.isnan(limit.uncertainty):
                value = f"{number(mesh.samples[each.name].mean)} {each.unit}".strip()
                where, by = si(self.own_size * mesh.factor, "m"), exact(limit.uncertainty, "", 2)
                return f"{text}. {each.name} {limit.trend.value}: {value} at {where}, uncertain by {by}."
        return f"{text}."


def to_markdown(book: Book, wanted: str | None = None) -> str:
    """Returns the report as Markdown: tables with explanations."""
    name = book.leading(wanted)
    parts = [
        ", ".join(f"`{text}`" for text in (book.case, *book.changes)),
        _ensembles(book),
        *(text for each in book.series for text in (f"**{each.variant}**", _costs(book, each), _values(book, each))),
        _unresolved(book),
        _between(book),
        _scatter(book) if book.members > 1 else "",
        *([] if name is None else [f"Error over cost, {name}:", _worth(book, name)]),
        "\n".join(
            f"- {each.point.variant}, sizes x {number(each.point.factor)}: {each.problem}" for each in book.failed
        ),
        f"**Advice.** {book.advice(wanted)}",
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def _ensembles(book: Book) -> str:
    if book.members == 1:
        return ""
    how = (
        "steps shorter by 0 and by 0.1 to 1 %" if book.vary == "steps" else "different seeds of the scattered strength"
    )
    return (
        f"Every point is an ensemble of {book.members} runs ({how}); values are means over the ensemble, costs are "
        "those "
        "of one run."
    )


def _costs(book: Book, series: Series) -> str:
    sizes = alike([book.own_size * m.factor for m in series.meshes], "m")
    rows = [
        [size, exact(m.size, "", 3), count(m.tets), count(m.steps), _seconds(m.cpu)]
        for m, size in zip(series.meshes, sizes, strict=True)
    ]
    return table(("element size", "h / h of the case", "tets", "steps", "CPU s"), rows)


def _values(book: Book, series: Series) -> str:
    """Returns the table of a quantity, from the coarse to the fine mesh, and the limit of the quantity."""
    meshes = series.meshes[::-1]
    rows = []
    for each in book.numbers:
        found = series.limits[each.name]
        shown = [number(m.samples[each.name].mean) if each.name in m.samples else "-" for m in meshes]
        order = "-" if math.isnan(found.order) else fixed(found.order, 1)
        limit = number(found.value) if found.trend is Trend.CONVERGES else "-"
        known = not math.isnan(found.uncertainty)
        uncertain = exact(found.uncertainty, "", 2) if known else "-"
        share = _percent(found.uncertainty / each.scale) if known and each.scale and not each.of_nothing else "-"
        expected = "-" if each.expected is None else f"{number(each.expected)} +- {number(each.tolerance)}"
        rows.append([
            _titled(each), *shown, found.trend.value, order, limit, uncertain, share, expected
        ])  # fmt: skip
    head = ["quantity", *(si(book.own_size * m.factor, "m") for m in meshes)]
    return table([*head, "trend", "order", "limit", "U of the finest", "U %", "expected"], rows)


def _titled(each: Number) -> str:
    return f"{each.name}, {each.unit}" if each.unit else each.name


def _unresolved(book: Book) -> str:
    """Returns the names of the quantities for which no variant has a limit, with their behaviour."""
    lost: dict[Trend, list[str]] = {}
    for each in book.numbers:
        trends = [series.limits[each.name].trend for series in book.series]
        if all(trend in (Trend.DIVERGES, Trend.OSCILLATES, Trend.SCATTERS) for trend in trends):
            lost.setdefault(max(trends, key=trends.count), []).append(each.name)
    return "\n\n".join(f"No limit, {trend.value}: {'; '.join(names)}." for trend, names in lost.items())


def _between(book: Book) -> str:
    """Returns the table of limits or values on the finest mesh of each variant, with their differences."""
    if len(book.series) == 1:
        return ""
    rows = []
    for each in book.numbers:
        there = [series.meshes[0].samples.get(each.name) for series in book.series]
        known = sorted((sample for sample in there if sample is not None), key=lambda sample: sample.mean)
        largest = max((abs(sample.mean) for sample in known), default=0.0)
        if len(known) > 1 and largest:
            by = 100.0 * (known[-1].mean - known[0].mean) / largest
            chance = "yes" if differ(known[0], known[-1]) else "no"
            shown = ["-" if sample is None else number(sample.mean) for sample in there]
            rows.append([_titled(each), *shown, exact(by, "", 2), chance])
    head = ("quantity", *(str(series.variant) for series in book.series), "differ by %", "by more than chance")
    return f"Between variants, on the finest mesh of each:\n\n{table(head, rows)}"


def _scatter(book: Book) -> str:
    """Returns the standard deviations on the finest mesh of each variant, and the number of runs that is needed to
    detect a difference.
    """
    rows = []
    for each in book.series:
        mesh = each.meshes[0]
        for one in book.numbers:
            if one.name in mesh.samples and mesh.samples[one.name].mean:
                sample = mesh.samples[one.name]
                rows.append([
                    str(each.variant), _titled(one), number(sample.mean), number(sample.deviation),
                    _percent(sample.deviation / abs(sample.mean)),
                    count(runs_needed(sample.deviation, _ENOUGH * abs(sample.mean))),
                ])  # fmt: skip
    head = (
        "variant, finest mesh",
        "quantity",
        "mean",
        "deviation",
        "%",
        f"runs for each side to detect {number(100 * _ENOUGH)} %",
    )
    return table(head, rows)


def _worth(book: Book, name: str) -> str:
    each, goal = book.goals()[name]
    points = trade.worths(book.series, each, goal)
    best = trade.front(points)
    rows = [
        [
            str(p.variant), si(book.own_size * p.mesh.factor, "m"), _seconds(p.cost), _percent(p.error),
            "front" if p in best else "",
        ]
        for p in points
    ]  # fmt: skip
    text = (
        f"Errors are distances from the limit {number(goal.value)} {each.unit} of {goal.variant}, which is uncertain "
        f"by {_percent(goal.uncertainty)} %. A distance is measured to the limit of the point's own variant, and "
        "from there "
        "to the target, so that errors which cancel by chance do not count as accuracy."
    )
    others = [str(variant) for variant in trade.elsewhere(book.series, each, goal)]
    far = f" The limit of another variant differs by more than both uncertainties: {'; '.join(others)}."
    text += far if others else ""
    return f"{text}\n\n{table(('variant', 'element size', 'CPU s', 'error %', 'Pareto'), rows)}"


def _seconds(value: float) -> str:
    return duration(value) if value >= 9.95 else f"{exact(value, '', 2)} s"


def _percent(share: float) -> str:
    """Returns a fraction as a percentage with two digits, without its sign."""
    return exact(100.0 * share, "", 2)


def to_json(book: Book, wanted: str | None = None) -> bytes:
    """Returns all numbers of the study as JSON."""
    data: dict[str, Any] = {
        "case": book.case, "changes": book.changes, "own_size": book.own_size, "members": book.members,
        "vary": book.vary, "series": [_plain(each) for each in book.series], "advice": book.advice(wanted),
        "failed": [{"variant": each.point.variant, "factor": each.point.factor, "problem": each.problem}
                   for each in book.failed],
    }  # fmt: skip
    return msgspec.json.format(msgspec.json.encode(data), indent=2)


def _plain(series: Series) -> dict[str, Any]:
    meshes = [
        {"factor": m.factor, "tets": m.tets, "size": m.size, "steps": m.steps, "cpu": m.cpu,
         "values": {name: sample.values for name, sample in m.samples.items()}}
        for m in series.meshes
    ]  # fmt: skip
    return {"variant": series.variant, "meshes": meshes, "limits": series.limits}
