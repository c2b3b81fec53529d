"""The tables of a case, found in its JSON schema: the path, the variant and the schema of each table."""

from collections.abc import Iterator
from dataclasses import dataclass

from .json_schema import Schema, definition, variants

_TAGS = ("shape", "kind", "model")
"""Keys that select one of several variants of a table."""


@dataclass(frozen=True)
class Table:
    """A table of a case: its path, such as ``parts[].mesh``, and its schema. A variant of a table also has the key that
    selects it, such as ``shape``, and the value of this key, such as ``box``.
    """

    path: str
    schema: Schema
    key: str = ""
    value: str = ""

    @property
    def title(self) -> str:
        """The heading of the section of the table."""
        name = f"`{self.path}`" if self.path else "The case"
        return f'{name} with `{self.key} = "{self.value}"`' if self.key else name


def tables(whole: Schema) -> list[Table]:
    """Returns every table of a case in the order of the keys. A table that has several paths is listed with the
    shortest path.
    """
    found: dict[int, Table] = {}
    _collect(found, Table("", whole), whole)
    return list(found.values())


def _collect(found: dict[int, Table], table: Table, whole: Schema) -> None:
    """Adds a table and the tables in it to ``found``. A table is added only once, because operands of a combination can
    be combinations again.
    """
    if (known := found.get(id(table.schema))) is not None:
        found[id(table.schema)] = min(known, table, key=lambda each: len(each.path))
        return
    found[id(table.schema)] = table
    for key, schema in table.schema["properties"].items():
        for path, inner in _tables_in(f"{table.path}.{key}".removeprefix("."), schema, whole):
            _collect(found, Table(path, inner, *_tag(inner)), whole)


def _tables_in(path: str, schema: Schema, whole: Schema) -> Iterator[tuple[str, Schema]]:
    """Yields the tables in the value of a key, with their paths."""
    for variant in variants(schema):
        meant = definition(variant, whole)
        if "properties" in meant:
            yield path, meant
        if "items" in meant:
            yield from _tables_in(f"{path}[]", meant["items"], whole)
        for inner in meant.get("patternProperties", {}).values():
            yield from _tables_in(f"{path}.NAME", inner, whole)


def _tag(schema: Schema) -> tuple[str, str]:
    """Returns the key that selects the variant, and its value; empty texts for a table without variants."""
    values = ((key, schema["properties"].get(key, {}).get("const")) for key in _TAGS)
    return next(((key, value) for key, value in values if value is not None), ("", ""))
