"""Chart of the table of a sweep: a panel for each result over the changed keys. The module needs matplotlib."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conoid.cases.output.history import split

from ..commands.sweep_columns import Row, known, number_of, telling
from ..errors import ClientError, UsageError

_COLOURS = ("#4c78a8", "#f58518", "#54a24b", "#e45756", "#72b7b2", "#b279a2", "#eeca3b", "#9d755d", "#ff9da6")
_PANELS = 6
"""Largest number of results that are drawn by default (chosen value: six panels are readable on one page)."""


def figure(rows: Sequence[Row], keys: Sequence[str], x: str | None, columns: Sequence[str]) -> Figure:
    """Draws the ``rows`` of a table over the key ``x``; the default is the first key that varies. ``keys`` are the
    changed keys.

    Each combination of the other keys has a curve; keys that change together count as one key. Raises ClientError.
    """
    titles = {split(title)[0]: title for title in rows[0]} if rows else {}
    changed = {key: titles[key] for key in keys if key in titles}
    if not changed:
        raise ClientError("all runs of the sweep have been removed")
    over = _axis(rows, changed, x)
    shown = [known(rows, name) for name in columns] or telling(rows, list(changed.values()))[:_PANELS]
    if not shown:
        raise ClientError("no run of the sweep has ended with a number that differs between its points")
    across = min(len(shown), 3)
    down = -(-len(shown) // across)
    made = Figure(figsize=(4.6 * across, 3.4 * down), layout="constrained")
    groups = _together(rows, list(changed.values()))
    more = next((len(group) - 1 for group in groups if over in group), 0)
    others = [group[0] for group in groups if over not in group]
    for index, name in enumerate(shown):
        _panel(made.add_subplot(down, across, index + 1), rows, over, others, name)
    for axes in made.axes if more else ():
        axes.set_xlabel(f"{axes.get_xlabel()}\nand {more} more that {'goes' if more == 1 else 'go'} with it")
    return made


def _together(rows: Sequence[Row], titles: Sequence[str]) -> list[list[str]]:
    """Returns the columns that vary, in groups of columns that change together: the value of one column determines
    the values of the other columns of the group.
    """
    groups: dict[tuple[int, ...], list[str]] = {}
    for title in titles:
        order = list(dict.fromkeys(row[title] for row in rows))
        if len(order) > 1:
            groups.setdefault(tuple(order.index(row[title]) for row in rows), []).append(title)
    return list(groups.values())


def _axis(rows: Sequence[Row], changed: Mapping[str, str], x: str | None) -> str:
    """Returns the title of the column on the horizontal axis."""
    if x is not None and x not in changed:
        raise UsageError(f"x = {x!r}: allowed: the keys that the sweep changes, {', '.join(changed)}")
    varies = [title for title in changed.values() if len({row[title] for row in rows}) > 1]
    return changed[x] if x is not None else next(iter([*varies, *changed.values()]))


def _panel(axes: Axes, rows: Sequence[Row], over: str, others: Sequence[str], name: str) -> None:
    curves: dict[str, list[Row]] = {}
    for row in rows:
        if number_of(row[name]) is not None:
            curves.setdefault(", ".join(_valued(row, title) for title in others), []).append(row)
    words, places = _places(rows, over)
    for number, (label, some) in enumerate(curves.items()):
        points = sorted((places[row[over]], number_of(row[name]) or 0.0) for row in some)
        colour = _COLOURS[number % len(_COLOURS)]
        axes.plot(*zip(*points, strict=True), "o-", color=colour, markersize=4, linewidth=1.2, label=label)
    if words:
        axes.set_xticks(list(places.values()), list(places))
    axes.set(xlabel=_labelled(over), ylabel=_labelled(name))
    axes.grid(alpha=0.3)
    if others:
        axes.legend(fontsize=7, frameon=False)


def _labelled(column: str) -> str:
    """Returns the label of an axis for a column."""
    name, unit = split(column.removeprefix("reference.").removeprefix("probe."))
    return f"{name}, {unit}" if unit else name


def _valued(row: Row, title: str) -> str:
    """Returns the name of a column with its value and unit in a row, such as ``speed 200 m/s``."""
    name, unit = split(title)
    return f"{name} {row[title]} {unit}".strip()


def _places(rows: Sequence[Row], over: str) -> tuple[bool, dict[str, float]]:
    """Returns True if the values are words, and the position of each value on the axis."""
    texts = list(dict.fromkeys(row[over] for row in rows))
    numbers = {text: value for text in texts if (value := number_of(text)) is not None}
    return (False, numbers) if len(numbers) == len(texts) else (True, {text: float(n) for n, text in enumerate(texts)})
