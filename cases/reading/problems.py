"""Errors of a case: one line per error, with the key as the user wrote it."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from ..model.rigid import Flag
from ..model.schema import Case
from ..model.tables import Switch
from .similar import choices, meant, nearest

Location = tuple[int | str, ...]

_DISCRIMINATORS = ("kind", "shape", "model")
_LONGEST = 80
"""Largest number of characters of a value in a message, about a line of a terminal (chosen value)."""
_MOST = 100
"""Largest number of errors that are reported at once; a user corrects fewer at a time (chosen value)."""


@dataclass(frozen=True)
class Problem:
    """An error of a case: the key as the user wrote it, the value as text (empty if the key has no value), and what is
    wrong or allowed.
    """

    key: str
    value: str
    message: str

    def __str__(self) -> str:
        """Returns the error as one line: ``parts[0].mesh.radius = '3 s': expected a length ...``."""
        head = " = ".join(text for text in (self.key, self.value) if text)
        return f"{head}: {self.message}" if head else self.message


class ConoidError(Exception):
    """Base class of the errors that a user of Conoid catches."""


class CaseError(ConoidError, ValueError):
    """Error: a case is not valid. The attribute ``problems`` lists every error of the case; the text of the exception
    has one line per error.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        """Creates the exception with the first hundred of ``problems``."""
        self.problems: tuple[Problem, ...] = tuple(problems)[:_MOST]
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def __reduce__(self) -> tuple[type["CaseError"], tuple[tuple[Problem, ...]]]:
        """Returns the arguments with which pickle creates the exception again: the problems, not the text."""
        return CaseError, (self.problems,)


def problem(location: Location, value: object, message: str) -> Problem:
    """Returns the problem of the key at ``location``. ``value``: the value as written, which is shortened; Ellipsis if
    the key has no value.
    """
    return Problem(dotted(location), "" if value is ... else shown(value), message)


def dotted(location: Location) -> str:
    """Returns ``("parts", 0, "mesh")`` as ``parts[0].mesh``."""
    text = "".join(f"[{item}]" if isinstance(item, int) else f".{item}" for item in location)
    return text.removeprefix(".")


def shown(value: object) -> str:
    """Returns a value as text of at most 80 characters, on one line."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**_LONGEST:
        return "a whole number of more than 80 digits"
    if isinstance(value, Mapping | list | tuple):
        return "a table" if isinstance(value, Mapping) else "a list"
    text = repr(value[: _LONGEST + 1]) if isinstance(value, str) else repr(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ..."


def from_pydantic(error: ValidationError, data: Mapping[str, Any]) -> list[Problem]:
    """Returns the errors that pydantic has found, with the keys of ``data``. The texts of pydantic are replaced by
    clearer texts where this module has them. The result has at most a hundred errors, because searching names similar
    to a misspelt name takes time.
    """
    details = error.errors(include_url=False, include_context=True)
    places = [detail["loc"] for detail in details]
    own = (detail for detail in details if not _follows_from_others(detail, places))
    return [_translate(detail, data) for detail in islice(own, _MOST)]


def _follows_from_others(detail: ErrorDetails, places: Iterable[Location]) -> bool:
    """Whether the error ``detail`` only follows from other errors: pydantic reports a list as too short if entries of
    the list have errors. ``places``: locations of all errors.
    """
    own = detail["loc"]
    return detail["type"] == "too_short" and any(len(other) > len(own) and other[: len(own)] == own for other in places)


def _translate(detail: ErrorDetails, data: Mapping[str, Any]) -> Problem:
    location, value, kind = _written(detail["loc"], data), detail["input"], detail["type"]
    context = detail.get("ctx", {})
    match kind:
        case "missing":
            return problem(location, ..., "this key is missing")
        case "extra_forbidden":
            return problem(location, ..., f"unknown key; {nearest(str(location[-1]), _keys(detail['loc'][:-1]))}")
        case "union_tag_not_found":
            tag = str(context["discriminator"]).strip("'")
            return problem((*location, tag), ..., f"this key is missing; allowed: {choices(_tags(detail['loc']))}")
        case "union_tag_invalid":
            tag = str(context["discriminator"]).strip("'")
            known = _tags(detail["loc"])
            return problem((*location, tag), context["tag"], f"allowed: {choices(known)}{meant(context['tag'], known)}")
        case "value_error":
            return problem(location, value, str(context["error"]).removeprefix(f"{value!r} "))
        case "string_pattern_mismatch":
            return problem(location, value, "a name starts with a letter and has up to 64 letters, digits, _ or -")
        case "tuple_type":
            return problem(location, value, _list_wanted(location, _lengths(detail["loc"])))
        case "model_type" | "model_attributes_type" | "dict_type":
            return problem(location, value, _table_wanted(detail["loc"]))
        case "string_type":
            return problem(location, value, "expected a text; in TOML a text is in quotes")
        case "too_short":
            least = context["min_length"]
            return problem(location, ..., "at least one is needed" if least == 1 else f"at least {least} are needed")
        case "too_long":
            many, most = context["actual_length"], context["max_length"]
            return problem(location, ..., f"{many} are too many; allowed: up to {most}")
        case "string_too_long":
            return problem(
                location, ..., f"{len(value)} characters are too many; allowed: up to {context['max_length']}"
            )
        case "literal_error":
            known = re.findall(r"'([^']*)'", context["expected"])
            return problem(location, value, f"allowed: {context['expected']}{meant(value, known)}")
        case "int_parsing" | "int_type" | "int_from_float":
            return problem(location, value, "expected a whole number")
        case "float_parsing" | "float_type":
            return problem(location, value, "expected a number")
        case _:
            message = detail["msg"].removeprefix("Input should be ")
            return problem(location, value, f"allowed: {message}" if message != detail["msg"] else message)


def _list_wanted(location: Location, lengths: set[int]) -> str:
    if len(location) == 1:
        return f"expected a list of tables; in TOML each one begins with [[{location[0]}]]"
    return f"expected a list of {lengths.pop()}" if len(lengths) == 1 else "expected a list"


def _table_wanted(location: Location) -> str:
    """Returns the words for the values that the key can have: a table, and also ``true``, ``false`` or ``"none"`` if
    the model allows them.
    """
    marks = {
        type(mark)
        for model in _models_at(location[:-1])
        if location[-1] in model.model_fields
        for mark in model.model_fields[str(location[-1])].metadata
    }
    more = ", true or false" if Flag in marks else ' or "none"' if Switch in marks else ""
    return f"expected a table of keys{more}"


def _written(location: Location, data: Any) -> Location:
    """Returns the location of an error without the union tags that pydantic adds."""
    kept: list[int | str] = []
    for item in location:
        if isinstance(data, Mapping) and item in _values(data):
            continue
        if item == "[key]":
            continue
        kept.append(item)
        data = _step(data, item)
    return tuple(kept)


def _values(data: Mapping[str, Any]) -> list[str]:
    return [data[key] for key in _DISCRIMINATORS if isinstance(data.get(key), str)]


def _step(data: Any, item: int | str) -> Any:
    if isinstance(data, Mapping):
        return data.get(item)
    if isinstance(data, list | tuple) and isinstance(item, int) and item < len(data):
        return data[item]
    return None


def _keys(location: Location) -> list[str]:
    """Returns the keys of the model at a location of pydantic."""
    return sorted({key for model in _models_at(location) for key in model.model_fields})


def _lengths(location: Location) -> set[int]:
    """Returns the fixed lengths that the list at a location of pydantic may have; empty if no length is fixed."""
    fields = [
        model.model_fields[str(location[-1])]
        for model in _models_at(location[:-1])
        if location[-1] in model.model_fields
    ]
    kinds = [kind for field in fields for kind in (field.annotation, *get_args(field.annotation))]
    return {len(get_args(kind)) for kind in kinds if get_origin(kind) is tuple and ... not in get_args(kind)}


def _tags(location: Location) -> list[str]:
    """Returns the values that select a variant of the table at a location of pydantic."""
    return [tag for model in _models_at(location) for tag in _tags_of(model)]


def _tags_of(model: type[BaseModel]) -> Iterator[str]:
    for key in _DISCRIMINATORS:
        if key in model.model_fields and get_origin(model.model_fields[key].annotation) is Literal:
            yield from get_args(model.model_fields[key].annotation)
            return


def _models_at(location: Location) -> list[type[BaseModel]]:
    """Returns the models that are possible at a location of pydantic: several if the data does not select a variant."""
    models: list[type[BaseModel]] = [Case]
    named = False
    for item in location:
        tagged = [model for model in models if item in set(_tags_of(model))]
        if isinstance(item, int) or named:
            named = False
        elif tagged:
            models = tagged
        else:
            annotations = [model.model_fields[item].annotation for model in models if item in model.model_fields]
            models = [found for annotation in annotations for found in _models_in(annotation)]
            named = any(get_origin(annotation) is dict for annotation in annotations)
    return models


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        return
    for argument in get_args(annotation):
        yield from _models_in(argument)
