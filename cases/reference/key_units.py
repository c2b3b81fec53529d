"""The SI unit of a bare number of a key of a case, from the model that has the key."""

import re
from collections.abc import Iterator
from functools import cache, lru_cache

from ..units import QUANTITY
from .json_schema import Schema, definition, json_schema, variants

_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


@lru_cache(256)
def unit_of_key(key: str) -> str:
    """Returns the unit of a number at a key, such as ``m/s`` for ``parts[0].velocity[2]``. The unit is empty if the
    number has none, or if another key determines the unit.
    """
    whole = _schema()
    found = [definition(whole, whole)]
    for name, index in _STEP.findall(key):
        found = [each for schema in found for each in (_named(schema, name) if name else _item(schema, int(index)))]
        found = [definition(variant, whole) for schema in found for variant in variants(schema)]
    units = {schema.get("unit", "") for schema in found} - {QUANTITY}
    return units.pop() if len(units) == 1 else ""


@cache
def _schema() -> Schema:
    return json_schema()


def _named(schema: Schema, name: str) -> Iterator[Schema]:
    if name in schema.get("properties", {}):
        yield schema["properties"][name]
    else:
        yield from schema.get("patternProperties", {}).values()


def _item(schema: Schema, index: int) -> Iterator[Schema]:
    listed = schema.get("prefixItems", [])
    if index < len(listed):
        yield listed[index]
    elif "items" in schema and isinstance(schema["items"], dict):
        yield schema["items"]
