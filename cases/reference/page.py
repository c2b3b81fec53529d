"""The keys of a case for people: docs/reference/case.md, made from the JSON schema, one table of keys a table of the
case."""

import json
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..units import KINDS, QUANTITY, UNITS, parse_unit
from .json_schema import Schema, definition, json_schema, variants

_TAGS = ("shape", "kind", "model")
_HEAD = """# The keys of a case

A case is one TOML (or JSON) file. `make reference` makes this page from the texts of the models in `cases/`; `conoid
schema` prints the same as JSON schema, and `conoid validate CASE` tells everything that is wrong with a case at once.
A first case, step by step: [first_case.md](../tutorial/first_case.md).

**Quantities** are text with a unit, such as `"210 m/s"` or `"7850 kg/m^3"`. A bare number is taken in the SI unit that
stands with the key; `conoid validate` warns of each that is not 0. In SI units all lie between 1e-30 and 1e30, or are
0; which unit was written changes no bit of a run. Units, to be combined with `*`, `/` and `^`:
{units}.

**Places** are coordinates in one frame for all bodies. Stress is positive in tension, pressure in compression.

A key with a default may be absent: – means that nothing stands in for it. A name begins with a letter and has up to 64
letters, digits, `_` and `-`.
"""


@dataclass(frozen=True)
class Table:
    """A table of the case: where it stands, as ``parts[].mesh``, and its schema. ``tag``: ``shape = "box"``."""

    path: str
    tag: str
    schema: Schema

    @property
    def title(self) -> str:
        """The heading of its section."""
        name = f"`{self.path}`" if self.path else "The case"
        return f"{name} with `{self.tag}`" if self.tag else name


def page() -> str:
    """The whole page."""
    return _Page(json_schema()).text()


def tables(whole: Schema) -> list[Table]:
    """Every table of a case in the order of the keys, each at its first place."""
    found: dict[int, Table] = {}
    _collect(found, Table("", "", whole), whole)
    return list(found.values())


def _collect(found: dict[int, Table], table: Table, whole: Schema) -> None:
    """Adds a table and those below it; what combinations are made of may be combinations again."""
    if (known := found.get(id(table.schema))) is not None:
        found[id(table.schema)] = min(known, table, key=lambda each: len(each.path))
        return
    found[id(table.schema)] = table
    for key, schema in table.schema["properties"].items():
        for path, inner in _tables_in(f"{table.path}.{key}".removeprefix("."), schema, whole):
            _collect(found, Table(path, _tag(inner), inner), whole)


def _tables_in(path: str, schema: Schema, whole: Schema) -> Iterator[tuple[str, Schema]]:
    """The tables that the value of a key is or holds, with their paths."""
    for variant in variants(schema):
        meant = definition(variant, whole)
        if "properties" in meant:
            yield path, meant
        if "items" in meant:
            yield from _tables_in(f"{path}[]", meant["items"], whole)
        for inner in meant.get("patternProperties", {}).values():
            yield from _tables_in(f"{path}.NAME", inner, whole)


def _tag(schema: Schema) -> str:
    """``shape = "box"`` of a table that is one of several kinds."""
    consts = ((key, schema["properties"].get(key, {}).get("const")) for key in _TAGS)
    return next((f'{key} = "{const}"' for key, const in consts if const is not None), "")


class _Page:
    """The page of one schema."""

    def __init__(self, whole: Schema) -> None:
        self._whole = whole
        self._tables = tables(whole)
        self._paths = {id(table.schema): table.path for table in self._tables}

    def text(self) -> str:
        """All of it."""
        units = textwrap.fill(", ".join(f"`{unit}`" for unit in UNITS if unit != "1"), 118)
        return "\n".join([_HEAD.format(units=units), *map(self._section, self._tables)])

    def _section(self, table: Table) -> str:
        head = f"## {table.title}\n\n{table.schema['description']}\n"
        rows = "\n".join(self._row(table, key, schema) for key, schema in table.schema["properties"].items())
        return f"{head}\n| key | value | default | meaning |\n|---|---|---|---|\n{rows}\n"

    def _row(self, table: Table, key: str, schema: Schema) -> str:
        default = "required" if key in table.schema.get("required", ()) else _default(schema)
        meaning = " ".join(schema["description"].split())
        cells = (f"`{key}`", self._value(schema), default, meaning)
        return f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |"

    def _value(self, schema: Schema) -> str:
        """What a key takes, in words."""
        return " or ".join(dict.fromkeys(self._one(variant) for variant in variants(schema))) or "nothing"

    def _one(self, schema: Schema) -> str:
        meant = definition(schema, self._whole)
        if "properties" in meant:
            return f"table `{self._paths[id(meant)]}`"
        if "const" in meant:
            return f"`{_written(meant['const'])}`"
        if "enum" in meant:
            return ", ".join(f"`{_written(each)}`" for each in meant["enum"])
        if "prefixItems" in meant:
            return _fixed([self._value(each) for each in meant["prefixItems"]])
        if "items" in meant:
            most = f" at most {meant['maxItems']}" if "maxItems" in meant else ""
            return f"list of{most}: {self._value(meant['items'])}"
        if "patternProperties" in meant:
            return f"for each name: {self._value(next(iter(meant['patternProperties'].values())))}"
        return _scalar(meant)


BAR = r"\|"
"""A bar inside a cell."""


def _default(schema: Schema) -> str:
    value = schema.get("default")
    if value is None:
        return "–"
    if isinstance(value, dict):
        return "its defaults"
    return f"`{_written(value, next((each.get('unit', '') for each in variants(schema)), ''))}`"


def _written(value: Any, unit: str = "") -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_written, value))}]"
    if isinstance(value, bool | str):
        return json.dumps(value)
    return f"{value:g} {unit}".strip() if isinstance(value, float) else str(value)


def _fixed(words: list[str]) -> str:
    return f"{len(words)} of: {words[0]}" if len(set(words)) == 1 else f"list of: {'; '.join(words)}"


def _scalar(schema: Schema) -> str:
    if "unit" in schema:
        return _noun(schema["unit"]) + _range(schema)
    if schema.get("type") == "string":
        most = f", at most {schema['maxLength']} characters" if "maxLength" in schema else ""
        if "pattern" in schema:
            return "64 hexadecimal digits" if "{64}" in schema["pattern"] else "a name"
        return f"text{most}"
    nouns = {"integer": "a whole number", "number": "a number", "boolean": "`true` or `false`"}
    return nouns[schema["type"]] + _range(schema)


def _noun(unit: str) -> str:
    if unit == "":
        return "a number"
    if unit == QUANTITY:
        return f"a number, or text in {unit} unit"
    noun = "an angle" if unit == "rad" else KINDS[parse_unit(unit)[1]]
    return f"{noun}, {unit}"


def _range(schema: Schema) -> str:
    words = {"exclusiveMinimum": "above", "minimum": "at least", "exclusiveMaximum": "below", "maximum": "at most"}
    said = [f"{word} {schema[key]}" for key, word in words.items() if key in schema]
    return f", {' and '.join(said)}" if said else ""
