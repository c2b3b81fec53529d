"""Table rows of the reference of keys: value, default and meaning of each key as Markdown."""

import json
import re
from collections.abc import Mapping
from typing import Any

from ..units import KINDS, QUANTITY, parse_unit
from .json_schema import Schema, definition, variants

BAR = r"\|"
"""A vertical bar inside a cell of a Markdown table."""


class Cells:
    """Converts the keys of a JSON schema to table rows. ``paths``: path of the table of each definition of the schema,
    by the reference to the definition.
    """

    def __init__(self, whole: Schema, paths: Mapping[int, str]) -> None:
        self._whole, self._paths = whole, paths

    def row(self, key: str, schema: Schema, required: bool) -> str:
        """Returns the row of a key: ``| key | value | default | meaning |``."""
        default = "required" if required else _default(schema)
        cells = (f"`{key}`", self._value(schema), default, " ".join(schema["description"].split()))
        return f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |"

    def _value(self, schema: Schema) -> str:
        """Returns the accepted values of a key in words."""
        return " or ".join(dict.fromkeys(self._one(variant) for variant in variants(schema))) or "nothing"

    def _one(self, schema: Schema) -> str:
        meant = definition(schema, self._whole)
        if "properties" in meant:
            return f"table {link(self._paths[id(meant)])}"
        if "const" in meant:
            return f"`{_written(meant['const'])}`"
        if "enum" in meant:
            return ", ".join(f"`{_written(each)}`" for each in meant["enum"])
        return self._several(meant) or _scalar(meant)

    def _several(self, schema: Schema) -> str:
        """Returns the words for a list or for tables by name; empty for a single value."""
        if "prefixItems" in schema:
            return _fixed([self._value(each) for each in schema["prefixItems"]])
        if "items" in schema:
            most = f" of at most {schema['maxItems']}" if "maxItems" in schema else ""
            return f"list{most}: {self._value(schema['items'])}".replace("list: list of: ", "list of pairs: ")
        if "patternProperties" in schema:
            return f"for each name: {self._value(next(iter(schema['patternProperties'].values())))}"
        return ""


def link(path: str) -> str:
    """Returns the path of a table as a link to its section."""
    return f"[`{path}`](#{re.sub(r'[^a-z0-9_-]', '', path.lower())})"


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
    return f"{len(words)} values: {words[0]}" if len(set(words)) == 1 else f"list of: {'; '.join(words)}"


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
    bounds = [f"{word} {_bound(schema[key])}" for key, word in words.items() if key in schema]
    return f", {' and '.join(bounds)}" if bounds else ""


def _bound(value: float) -> str:
    """Returns a bound as a short number; the exact value of 2 pi has seventeen digits."""
    return f"{value:.6g}" if isinstance(value, float) and not value.is_integer() else f"{value}"
