"""The table of a sweep as a picture: results over what was changed, a panel a result. With matplotlib."""

import re
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .errors import ClientError, UsageError

Row = Mapping[str, str]

_COLOURS = ("#4c78a8", "#f58518", "#54a24b", "#e45756", "#72b7b2", "#b279a2", "#eeca3b", "#9d755d", "#ff9da6")
_PANELS = 6
"""Results that are drawn when nobody names any. Chosen: as many as are read on one page."""
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_FIRST = (
    "reference.",
    "probe.",
    "fragments",
    "broken",
    "eroded",
    "energy.fracture",
    "energy.plastic",
    "energy.kinetic",
)
"""What is drawn rather than other columns."""
_NEVER = frozenset({"time", "elapsed", "cpu", "elements", "nodes", "worst_residual", "reference.worst_residual",
                    "energy.residual", "energy.initial"})  # fmt: skip
"""What is drawn only when it is asked for: it tells of the machine or of the mesh."""


def figure(rows: Sequence[Row], keys: Sequence[str], x: str | None, columns: Sequence[str]) -> Figure:
    """``rows`` of a table, of which ``keys`` were changed; over the key ``x``, the first that varies when it is None.

    One curve for each combination of the other keys. Raises ClientError.
    """
    over = _axis(rows, keys, x)
    shown = [_known(rows, name) for name in columns] or _telling(rows, keys)
    if not shown:
        raise ClientError("no run of the sweep has ended with a number that differs between its points")
    across = min(len(shown), 3)
    down = -(-len(shown) // across)
    made = Figure(figsize=(4.6 * across, 3.4 * down), layout="constrained")
    others = [key for key in keys if key != over and len({row[key] for row in rows}) > 1]
    for index, name in enumerate(shown):
        _panel(made.add_subplot(down, across, index + 1), rows, over, others, name)
    return made


def _axis(rows: Sequence[Row], keys: Sequence[str], x: str | None) -> str:
    if x is not None and x not in keys:
        raise UsageError(f"x = {x!r}: the sweep changes {', '.join(keys)}")
    varies = [key for key in keys if len({row[key] for row in rows}) > 1]
    return x or next(iter([*varies, *keys]))


def _known(rows: Sequence[Row], name: str) -> str:
    there = [column for column in rows[0] if any(_number(row[column]) is not None for row in rows)]
    known = {_bare(column): column for column in there} | {column: column for column in there}
    if name not in known:
        raise UsageError(f"{name!r}: the table has the numbers {', '.join(map(_bare, there))}")
    return known[name]


def _telling(rows: Sequence[Row], keys: Sequence[str]) -> list[str]:
    """The columns of numbers that differ between the points, the most telling ones first."""

    def differs(name: str) -> bool:
        found = {value for row in rows if (value := _number(row[name])) is not None}
        return len(found) > 1

    left_out = {*keys, *_NEVER, "run", "digest"}
    names = [name for name in rows[0] if _bare(name) not in left_out and differs(name)]
    ranks = {name: next((n for n, first in enumerate(_FIRST) if name.startswith(first)), len(_FIRST)) for name in names}
    return sorted(names, key=lambda name: ranks[name])[:_PANELS]


def _panel(axes: Axes, rows: Sequence[Row], over: str, others: Sequence[str], name: str) -> None:
    curves: dict[str, list[Row]] = {}
    for row in rows:
        if _number(row[name]) is not None:
            curves.setdefault(", ".join(f"{key} {row[key]}" for key in others), []).append(row)
    unit, places = _places(rows, over)
    for number, (label, some) in enumerate(curves.items()):
        points = sorted((places[row[over]], _number(row[name]) or 0.0) for row in some)
        colour = _COLOURS[number % len(_COLOURS)]
        axes.plot(*zip(*points, strict=True), "o-", color=colour, markersize=4, linewidth=1.2, label=label)
    if unit is None:
        axes.set_xticks(list(places.values()), list(places))
    axes.set(xlabel=f"{over}, {unit}" if unit else over, ylabel=_labelled(name))
    axes.grid(alpha=0.3)
    if others:
        axes.legend(fontsize=7, frameon=False)


def _bare(column: str) -> str:
    """The name of a column without its unit."""
    return re.sub(r" \[[^]]*\]$", "", column)


def _labelled(column: str) -> str:
    """As an axis has it."""
    return re.sub(r" \[([^]]*)\]$", r", \1", column.removeprefix("reference.").removeprefix("probe."))


def _places(rows: Sequence[Row], over: str) -> tuple[str | None, dict[str, float]]:
    """The unit of the values and where each lies; the unit is None where they are words, or have several units."""
    texts = list(dict.fromkeys(row[over] for row in rows))
    found = [_QUANTITY.fullmatch(text) for text in texts]
    units = {match[2] for match in found if match is not None}
    if None in found or len(units) > 1:
        return None, {text: float(place) for place, text in enumerate(texts)}
    return units.pop(), {text: float(match[1]) for text, match in zip(texts, found, strict=True) if match is not None}


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
