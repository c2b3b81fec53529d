"""The page docs/reference/case.md with all keys of a case, made from the JSON schema; it has one section per table."""

import re
import textwrap
from collections.abc import Iterable, Iterator

from ..units import UNITS
from .cells import Cells, link
from .examples import EXAMPLES, SMALLEST
from .json_schema import Schema, json_schema
from .tables import Table, tables

_HEAD = """# Keys of a case

A case is one TOML or JSON file. This page lists its tables and keys. `conoid validate CASE` reports all errors of a
case at once, with warnings and the cost of the run; `conoid schema` prints the same reference as JSON schema for
editors. The tutorial [A first case](../tutorial/first_case.md) builds a case step by step. `make reference` makes this
page from the texts of the models in `cases/`.

The smallest complete case has parts and an end time:

```toml
{smallest}```

**Quantities** are text with a unit, such as `"210 m/s"` or `"7850 kg/m^3"`. A number without a unit is taken in the SI
unit given with the key; `conoid validate` warns of each one that is not 0. Allowed are 0 and values from 1e-30 to 1e30
in SI units. The choice of the unit changes no bit of the answer. Units can be combined with `*`, `/` and `^`:
{units}.

**Coordinates** refer to one Cartesian frame for all bodies. Stress is positive in tension, pressure in compression.
Angles are right-handed.

**Names** begin with a letter and have up to 64 letters, digits, `_` and `-`.

**Tables**: `parts[]` is a list of tables, in TOML one `[[parts]]` each; `parts[].mesh` is a table of a part, in TOML
`[parts.mesh]` below it. A key with a default may be absent; `–` is no default value: the text of the key states what
holds without it. Unknown keys are errors.

## Contents

{contents}
"""
_CHAPTERS = {
    "The case": ("",),
    "Parts": ("parts[]",),
    "Meshes": ("parts[].mesh",),
    "Materials": ("materials",),
    "Boundaries": ("boundaries[]",),
    "Bonds": ("bond[]",),
    "Contact": ("contact",),
    "Measurements": ("probes[]", "reference[]"),
    "Numerical method": ("numerics",),
    "Run": ("run", "balance"),
}
"""Chapters of the page, each with the beginnings of the paths of its tables. If several beginnings match a table, the
longest decides."""

_SEVERAL = 4
"""Number of variants of a table from which on keys that only some variants have in common are listed before the
variants (chosen value)."""


def page() -> str:
    """Returns the page as Markdown."""
    text = "\n".join([_head(), *_Page(json_schema()).chapters()])
    return re.sub(r"docs/([a-z]+/[a-z_]+\.md)", r"[\1](../\1)", text)


def _head() -> str:
    units = textwrap.fill(", ".join(f"`{unit}`" for unit in UNITS if unit != "1"), 118)
    contents = "\n".join(f"- [{title}](#{title.lower().replace(' ', '-')})" for title in _CHAPTERS)
    return _HEAD.format(units=units, contents=contents, smallest=SMALLEST)


def _chapter(path: str) -> str:
    """Returns the chapter of a table."""
    begun = [(len(start), title) for title, starts in _CHAPTERS.items() for start in starts if _below(path, start)]
    return max(begun)[1]


def _below(path: str, start: str) -> bool:
    return path == start or (start != "" and path.startswith((f"{start}.", f"{start}[")))


class _Page:
    """The page of one schema, as chapters."""

    def __init__(self, whole: Schema) -> None:
        self._tables = tables(whole)
        self._cells = Cells(whole, {id(table.schema): table.path for table in self._tables})

    def chapters(self) -> Iterator[str]:
        """Yields each chapter with the sections of the chapter."""
        groups: dict[str, list[Table]] = {}
        for table in self._tables:
            groups.setdefault(table.path, []).append(table)
        for title in _CHAPTERS:
            yield f"## {title}\n"
            for path, group in groups.items():
                if _chapter(path) == title:
                    yield from self._variants(group) if group[0].key else self._section(group[0])

    def _section(self, table: Table) -> Iterator[str]:
        """Yields the section of a table without variants."""
        if table.path:
            yield f"### {table.title}\n"
        yield from _text(table)
        yield _grid(self._rows(table).values())

    def _variants(self, group: list[Table]) -> Iterator[str]:
        """Yields the sections of a table with variants: first the keys that variants have in common, then each variant
        with its other keys.
        """
        key = group[0].key
        yield f"### `{group[0].path}`\n"
        yield f"`{key}` selects one of these tables: {', '.join(f'`{each.value}`' for each in group)}.\n"
        common = _common([self._own(table) for table in group])
        if common:
            yield f"Keys of {'all' if len(group) < _SEVERAL else 'several'} of them:\n\n{self._shared(group, common)}"
        known = []
        for table in group:
            own = {name: line for name, line in self._own(table).items() if line not in common}
            if same := self._same(table, own):
                known.append(f"| `{table.value}` | {', '.join(f'`{name}`' for name in own)} | {link(same.path)} |")
            else:
                yield from self._variant(table, own)
        if known:
            yield "\n".join([f"| {key} | keys of its own | described at |", "|---|---|---|", *known, ""])

    def _shared(self, group: list[Table], common: list[str]) -> str:
        """Returns the table of the keys that variants have in common; a column gives the variants that have each
        key.
        """
        lines = []
        for line in common:
            values = [each.value for each in group if line in self._own(each).values()]
            lines.append(f"{line} {_which(values, [each.value for each in group])} |")
        return _grid(lines, f"with {group[0].key}")

    def _variant(self, table: Table, own: dict[str, str]) -> Iterator[str]:
        """Yields the section of a variant, with the keys that only this variant has."""
        yield f"#### {table.title}\n"
        yield from _text(table)
        if own:
            yield _grid(own.values())

    def _same(self, table: Table, own: dict[str, str]) -> Table | None:
        """Returns a table with a shorter path and the same shape, kind or model if it has all rows of ``own``; None if
        there is none.
        """
        for each in self._tables:
            same = (each.key, each.value) == (table.key, table.value) and len(each.path) < len(table.path)
            if same and own.items() <= self._rows(each).items():
                return each
        return None

    def _own(self, table: Table) -> dict[str, str]:
        """Returns the rows of a variant without the row of the key that selects it."""
        return {name: line for name, line in self._rows(table).items() if name != table.key}

    def _rows(self, table: Table) -> dict[str, str]:
        """Returns the table row of each key."""
        required = table.schema.get("required", ())
        return {key: self._cells.row(key, each, key in required) for key, each in table.schema["properties"].items()}


def _common(variants: list[dict[str, str]]) -> list[str]:
    """Returns the table rows that at least four of the variants have in common; for fewer than four variants, the rows
    that all have in common.
    """
    lines = [line for rows in variants for line in rows.values()]
    return [line for line in dict.fromkeys(lines) if lines.count(line) >= max(2, min(_SEVERAL, len(variants)))]


def _which(values: list[str], every: list[str]) -> str:
    """Returns the names of the variants ``values`` as text: ``all``, ``all except ...``, or a list."""
    others = [value for value in every if value not in values]
    if not others:
        return "all"
    return f"all except {', '.join(others)}" if len(others) < len(values) else ", ".join(values)


def _text(table: Table) -> Iterator[str]:
    """Yields the description and the example of a table."""
    yield f"{table.schema['description']}\n"
    if table.title in EXAMPLES:
        yield f"```toml\n{EXAMPLES[table.title]}```\n"


def _grid(rows: Iterable[str], last: str = "") -> str:
    """Returns a Markdown table of keys. ``last``: title of a fifth column."""
    titles = ["key", "value", "default", "meaning", *([last] if last else [])]
    return "\n".join([f"| {' | '.join(titles)} |", f"|{'---|' * len(titles)}", *rows, ""])
