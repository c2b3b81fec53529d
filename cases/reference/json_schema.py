"""The keys of a case for machines: the JSON schema, from the models and their texts, as editors and OpenAPI read it."""

import json
import re
from functools import cache
from typing import Any

from ..model.schema import Case
from ..units import NUMBER

Schema = dict[str, Any]

_BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
"""Pydantic's names of bounds that stand before a reader, and JSON schema's."""
LINE = "#:schema"
"""Begins the line of a TOML file that tells editors where the schema is."""
FILE = "case.schema.json"
"""Name of the file with the schema, one folder above the shipped cases."""


def json_schema(refs: str = "#/$defs/{model}") -> Schema:
    """The JSON schema of a case; ``refs`` is where its definitions are looked for."""
    made = _tidy(Case.model_json_schema(ref_template=refs))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made, "title": "Conoid case"}


@cache
def schema_text() -> str:
    """The JSON schema as it is kept in ``FILE``."""
    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"


def _tidy(schema: Any, named: bool = False) -> Any:
    """Bounds by their names in JSON schema, plain texts, no titles; ``named``: the keys are names of a case's keys."""
    if isinstance(schema, list):
        return [_tidy(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    if named:
        return {name: _tidy(each) for name, each in schema.items()}
    tidy = {
        _BOUNDS.get(key, key): _tidy(value, named=key in ("properties", "$defs", "patternProperties"))
        for key, value in schema.items()
        if key not in ("title", "default", "description")
    }
    tidy |= {key: schema[key] for key in ("default",) if key in schema}
    if "description" in schema:
        tidy["description"] = plain(schema["description"])
    return tidy | ({"pattern": NUMBER} if "unit" in tidy else {})


def plain(text: str) -> str:
    """A docstring without its marks: one line a paragraph, single backquotes."""
    paragraphs = re.split(r"\n\s*\n", text.strip())
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs).replace("``", "`")


def definition(schema: Schema, whole: Schema) -> Schema:
    """What a schema stands for: the definition in ``whole`` that it refers to, or itself."""
    reference = schema.get("$ref")
    return whole["$defs"][reference.rpartition("/")[2]] if reference else schema


def variants(schema: Schema) -> list[Schema]:
    """The schemas of which a value may follow any one, without that of an absent key."""
    listed = schema.get("anyOf") or schema.get("oneOf") or [schema]
    return [each for one in listed for each in (variants(one) if one is not schema else [one]) if not _absent(each)]


def _absent(schema: Schema) -> bool:
    return schema.get("type") == "null"
