"""The JSON schema of a case, made from the models and their docstrings, for editors and OpenAPI."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

from ..model.schema import Case
from ..units import NUMBER

Schema = dict[str, Any]

_BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
"""Names of bounds: those that pydantic uses for a key whose value a function reads first, and those of JSON schema."""
LINE = "#:schema"
"""Beginning of the line of a TOML file that names the schema for editors."""
FILE = "case.schema.json"
"""Name of the file with the schema, one folder above the shipped cases."""


def json_schema(refs: str = "#/$defs/{model}") -> Schema:
    """Returns the JSON schema of a case. ``refs``: pattern of the references to its definitions."""
    made = _tidy(Case.model_json_schema(ref_template=refs))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made, "title": "Conoid case"}


@cache
def shipped_schema() -> Schema:
    """Returns the JSON schema of a case from the file ``FILE``: reading it takes 2 ms; making it from the models takes
    60 ms.
    """
    schema: Schema = json.loads((Path(__file__).parents[1] / FILE).read_bytes())
    return schema


@cache
def schema_text() -> str:
    """Returns the JSON schema as text, the content of ``FILE``."""
    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"


def _tidy(schema: Any, named: bool = False) -> Any:
    """Returns a schema in which bounds have the names of JSON schema, texts are plain, and titles are removed.
    ``named``: whether the keys of the schema are keys of a case.
    """
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
    """Returns a docstring as plain text: one line per paragraph, single backquotes."""
    paragraphs = re.split(r"\n\s*\n", text.strip())
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs).replace("``", "`")


def definition(schema: Schema, whole: Schema) -> Schema:
    """Returns the definition in ``whole`` to which ``schema`` refers; if it refers to none, returns ``schema``."""
    reference = schema.get("$ref")
    return whole["$defs"][reference.rpartition("/")[2]] if reference else schema


def variants(schema: Schema) -> list[Schema]:
    """Returns the alternatives of a value, without the alternative that the key is absent."""
    listed = schema.get("anyOf") or schema.get("oneOf") or [schema]
    return [each for one in listed for each in (variants(one) if one is not schema else [one]) if not _absent(each)]


def _absent(schema: Schema) -> bool:
    return schema.get("type") == "null"
