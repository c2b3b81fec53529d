"""Table of a sweep in a terminal: changed keys, state, and the most informative results."""

import csv
import io
from collections.abc import Sequence

from rich.console import Group
from rich.table import Table

from conoid.cases.figures import exact
from conoid.cases.output.history import header, split

from ..errors import UsageError
from .sweep_columns import Row, number_of, telling
from .tables import short_names, table

_MOST = 4
"""Number of result columns that are shown by default (chosen value: keys, state and these results fit into 80
characters)."""


def narrowed(text: str, keys: Sequence[str], columns: Sequence[str]) -> str:
    """Returns the CSV text with only the columns of the changed keys, the state and the named columns. Raises
    UsageError.
    """
    rows = list(csv.DictReader(io.StringIO(text)))
    titles = {split(title)[0]: title for title in (rows[0] if rows else ())}
    names = dict.fromkeys([*(key for key in keys if key in titles), "run", "state", *columns])
    if missing := [name for name in names if name not in titles and name not in titles.values()]:
        raise UsageError(f"{missing[0]!r}: not a column of the table; known: {', '.join(titles)}")
    out = io.StringIO()
    made = csv.DictWriter(out, [titles.get(name, name) for name in names], extrasaction="ignore", lineterminator="\n")
    made.writeheader()
    made.writerows(rows)
    return out.getvalue()


def table_of(rows: Sequence[Row], keys: Sequence[str], *, whole: bool) -> Table | Group:
    """Returns a table of keys, state and results. With ``whole`` the table shows all results. Otherwise it shows the
    most informative results, and below them the number of further results that differ between the points.
    """
    titles = list(rows[0]) if rows else []
    changed = [title for title in titles if split(title)[0] in keys]
    results = [title for title in titles if title not in (*changed, "run", "state", "cause")]
    shown = results if whole else telling(rows, changed)[:_MOST]
    more = 0 if whole else len(telling(rows, changed)) - len(shown)
    made = _made(rows, keys, [*changed, "state", *shown])
    hint = (
        f"{more} more {'results differ' if more > 1 else 'result differs'}: "
        "--column NAME shows one, --out FILE.csv writes all"
    )
    return Group(made, hint) if more else made


def _made(rows: Sequence[Row], keys: Sequence[str], shown: Sequence[str]) -> Table:
    named = short_names(keys)
    heads = [header({named.get(name, name): unit})[0] for name, unit in map(split, shown)]
    numbers = [head for head, title in zip(heads, shown, strict=True) if _numeric(rows, title)]
    made = table(*heads, right=numbers, wide=[head for head in heads if head != "state"])
    for row in rows:
        made.add_row(*(_text(row[title]) for title in shown))
    return made


def _numeric(rows: Sequence[Row], title: str) -> bool:
    return all(number_of(row[title]) is not None for row in rows if row[title])


def _text(text: str) -> str:
    value = number_of(text)
    return text if value is None else exact(value)
