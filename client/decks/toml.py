"""Text of a case as readable TOML: one table for each material, part and boundary, nested keys with dots."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from conoid.cases.reference import json_schema

NOTE = "#"
"""Key for the comments above a table, one text line each; a case does not have this key."""
_FIRST = ("name", "title", "description")
_LAST = ("run",)


def toml(data: Mapping[str, Any]) -> str:
    """Returns the text of a case file; the text ends with a line feed."""
    lines = [f"{json_schema.LINE} ./{json_schema.FILE}", *_comment(data.get(NOTE, ()))]
    rest = [key for key in data if key not in (*_FIRST, *_LAST, NOTE)]
    rest.sort(key=lambda key: isinstance(data[key], Mapping | list))
    for key in (*(key for key in _FIRST if key in data), *rest, *(key for key in _LAST if key in data)):
        lines += _entry(key, data[key])
    return "\n".join(lines) + "\n"


def bare(value: Any) -> Any:
    """Returns the data of a case without comments."""
    if isinstance(value, Mapping):
        return {key: bare(each) for key, each in value.items() if key != NOTE}
    return [bare(each) for each in value] if isinstance(value, list | tuple) else value


def _entry(key: str, value: Any) -> Iterator[str]:
    if key == "materials":
        for name, material in value.items():
            yield from ("", *_comment(material.get(NOTE, ())), f"[materials.{name}]", *_pairs(material))
    elif isinstance(value, Mapping):
        yield from ("", *_comment(value.get(NOTE, ())), f"[{key}]", *_pairs(value))
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        for each in value:
            yield from ("", *_comment(each.get(NOTE, ())), f"[[{key}]]", *_pairs(each))
    else:
        yield f"{key} = {_scalar(value)}"


def _pairs(table: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    for key, value in table.items():
        if key == NOTE:
            continue
        if isinstance(value, Mapping):
            yield from _pairs(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key} = {_scalar(value)}"


def _scalar(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(_scalar(each) for each in value)}]"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_scalar(each)}' for key, each in value.items())} }}"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return json.dumps(value)


def _comment(lines: Any) -> list[str]:
    return [f"# {''.join(c if c.isprintable() else '?' for c in line)}" for line in lines]
