"""Selection of the most informative columns of the table of a sweep. A row of the table maps column titles to texts."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from conoid.cases.output.history import split

from ..errors import UsageError

Row: TypeAlias = Mapping[str, str]

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
"""Names of the columns that are shown first."""
_NEVER = frozenset({"time", "elapsed", "cpu", "elements", "nodes", "worst_residual", "reference.worst_residual",
                    "energy.residual", "energy.initial", "steps", "warnings"})  # fmt: skip
"""Columns that are shown only on request, because their values depend on the machine or on the mesh."""


def known(rows: Sequence[Row], name: str) -> str:
    """Returns the title of a numeric column by its name. Raises UsageError if the table has no such column."""
    there = [column for column in rows[0] if any(number_of(row[column]) is not None for row in rows)]
    titles = {_bare(column): column for column in there} | {column: column for column in there}
    if name not in titles:
        raise UsageError(f"{name!r}: not a numeric column of the table; known: {', '.join(map(_bare, there))}")
    return titles[name]


def telling(rows: Sequence[Row], titles: Sequence[str]) -> list[str]:
    """Returns the titles of the numeric columns whose values differ between the points, the most informative columns
    first.
    """

    def differs(name: str) -> bool:
        found = {value for row in rows if (value := number_of(row[name])) is not None}
        return len(found) > 1

    left_out = {*map(_bare, titles), *_NEVER, "run", "digest"}
    names = [name for name in rows[0] if _bare(name) not in left_out and differs(name)]
    return sorted(names, key=_rank)


def _rank(title: str) -> tuple[bool, int]:
    """Returns the sort key of a column title; extremes of probes are last."""
    first = next((n for n, begins in enumerate(_FIRST) if title.startswith(begins)), len(_FIRST))
    return _bare(title).endswith((".min", ".max")), first


def _bare(column: str) -> str:
    """Returns the name of a column without its unit."""
    return split(column)[0]


def number_of(text: str) -> float | None:
    """Returns the number in a text; None if the text is not a number."""
    try:
        return float(text)
    except ValueError:
        return None
