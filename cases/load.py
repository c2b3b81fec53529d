"""Reading of cases: TOML or JSON text becomes a Case, or a CaseError that lists every error."""

import copy
import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from .checks.checks import check, check_parts
from .model.schema import Case
from .reading import whole
from .reading.library import library, material
from .reading.problems import CaseError, Problem, from_pydantic, problem, shown
from .reading.quantities import read_references
from .reading.similar import nearest

__all__ = [
    "CaseError", "Problem", "apply_overrides", "material", "parse_case", "parse_json", "parse_toml",
    "read_case", "read_data", "resolved_json", "shipped", "shipped_path",
]  # fmt: skip

_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*(?:\[\d{1,6}\])*(?:\.[A-Za-z_][A-Za-z0-9_-]*(?:\[\d{1,6}\])*)*")
_ITEM = re.compile(r"([A-Za-z_][A-Za-z0-9_-]*)|\[(\d+)\]")
_DEEPEST = 32
"""Largest number of words of a dotted key in TOML. The limit is needed because the reading time increases with the
square of this number. The keys of a case have up to 6 words (reason of the chosen value)."""
_DEEP = re.compile(rf"""(?<![\w"'.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_DEEPEST}}}""", re.ASCII)
_MARK = "\ufeff"
"""Byte order mark that some editors write at the start of a file in UTF-8."""
_LINE = re.compile(r"\(at line (\d+), column \d+\)")


def parse_case(data: Mapping[str, Any]) -> Case:
    """Returns the case for data that a TOML or JSON reader has returned. Raises CaseError with every problem of the
    case.
    """
    if not isinstance(data, Mapping):
        raise CaseError([problem((), data, "a case is a table of keys")])
    read, problems = read_references(data)
    try:
        case = Case.model_validate(read)
    except ValidationError as error:
        problems += from_pydantic(error, data)
        wrong_keys = {each.key for each in problems}
        raise CaseError([*problems, *(each for each in check_parts(read) if each.key not in wrong_keys)]) from None
    problems += check(case)
    if problems:
        raise CaseError(problems)
    return case


def parse_toml(text: str) -> Case:
    """Returns the case of a TOML text. Raises CaseError; for broken TOML the error has the line number."""
    return parse_case(toml_data(text))


def parse_json(text: str | bytes) -> Case:
    """Returns the case of a JSON text. Raises CaseError; for broken JSON the error has the line number."""
    return parse_case(json_data(text))


def read_case(path: Path) -> Case:
    """Returns the case in a file whose name ends in .toml or .json. Raises CaseError if the file contains no valid
    case.
    """
    return parse_case(read_data(path))


def read_data(path: Path) -> dict[str, Any]:
    """Returns the plain data of a file whose name ends in .toml or .json, before any check. Raises CaseError if the
    file cannot be read.
    """
    if path.suffix not in {".toml", ".json"}:
        raise CaseError([Problem("case", shown(str(path)), "a case file ends in .toml or .json")])
    try:
        text = whole.read_text(path)
    except UnicodeDecodeError:
        raise CaseError([Problem("case", shown(str(path)), "this file is not UTF-8 text")]) from None
    except OSError as error:
        raise CaseError([Problem("case", shown(str(path)), f"cannot read this file: {error.strerror}")]) from None
    return toml_data(text) if path.suffix == ".toml" else json_data(text)


def toml_data(text: str) -> dict[str, Any]:
    """Returns the tables of a TOML text. Raises CaseError with the line number if the TOML is broken."""
    if _DEEP.search(text):
        raise CaseError([Problem("", "", f"a key of more than {_DEEPEST} words with dots between")])
    try:
        return tomllib.loads(text.removeprefix(_MARK))
    except tomllib.TOMLDecodeError as error:
        raise CaseError([_syntax(str(error), text)]) from None
    except ValueError:
        raise CaseError([Problem("", "", "broken TOML: a whole number has too many digits")]) from None
    except RecursionError:
        raise CaseError([Problem("", "", "this TOML is nested too deeply")]) from None


def json_data(text: str | bytes) -> dict[str, Any]:
    """Returns the object of a JSON text; a repeated key is an error. Raises CaseError with the line number if the JSON
    is broken.
    """
    try:
        bare = text.removeprefix(_MARK) if isinstance(text, str) else text.removeprefix(_MARK.encode())
        data = json.loads(bare, object_pairs_hook=_no_repeats)
    except json.JSONDecodeError as error:
        raise CaseError([_at_line(error.lineno, str(error.doc), f"broken JSON: {error.msg}")]) from None
    except UnicodeDecodeError:
        raise CaseError([Problem("", "", "this JSON is not UTF-8 text")]) from None
    except RecursionError:
        raise CaseError([Problem("", "", "this JSON is nested too deeply")]) from None
    except _RepeatedKeyError as error:
        raise CaseError([Problem("", "", f"broken JSON: {error}")]) from None
    except ValueError:
        raise CaseError([Problem("", "", "broken JSON: a whole number has too many digits")]) from None
    if not isinstance(data, dict):
        raise CaseError([problem((), data, "a case is an object of keys")])
    try:
        json.dumps(data, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise CaseError([Problem("", "", "this JSON has half of a character, a \\u escape alone")]) from None
    return data


class _RepeatedKeyError(ValueError):
    """A key that is repeated in a JSON object."""


def _no_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) < len(pairs):
        seen: set[str] = set()
        twice = next(name for name, _ in pairs if name in seen or seen.add(name))  # type: ignore[func-returns-value]
        raise _RepeatedKeyError(f"the key {shown(twice)} is given twice")
    return data


def _syntax(message: str, text: str) -> Problem:
    place = _LINE.search(message)
    broken = f"broken TOML: {_LINE.sub('', message).strip()}"
    return _at_line(int(place[1]), text, broken) if place else Problem("", "", broken)


def _at_line(number: int, text: str, message: str) -> Problem:
    lines = text.splitlines()
    written = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    return Problem(f"line {number}", shown(written) if written else "", message)


Overrides = Iterable[str] | Mapping[str, Any]
"""Assignments such as ``run.ranks=2``, or a mapping from keys to values: ``{"run.ranks": 2}``, ``{"run": {"ranks":
2}}``."""


def apply_overrides(data: Mapping[str, Any], overrides: Overrides) -> dict[str, Any]:
    """Returns a copy of ``data`` with assignments such as ``run.ranks=2`` or ``parts[0].mesh.element_size=0.5 mm``.

    An assignment whose value is valid TOML gets that value; any other value is used as text. A value of a mapping is
    used unchanged; a nested mapping is applied key by key. Missing tables of the case are added; items of lists must
    exist. Raises CaseError with every assignment that cannot be applied, and with every key that is set twice.
    """
    if isinstance(overrides, str) or not isinstance(overrides, Iterable):
        message = "write a list of assignments, such as ['run.ranks=2'], or values by key, such as {'run.ranks': 2}"
        raise CaseError([Problem("overrides", shown(overrides), message)])
    changed: dict[str, Any] = copy.deepcopy(dict(data))
    problems: list[Problem] = []
    made: set[tuple[int | str, ...]] = set()
    for key, text, value in _assignments(overrides):
        try:
            if value is ... or not _KEY.fullmatch(key):
                raise ValueError("write an assignment such as run.ranks=2 or parts[0].velocity[2]='-200 m/s'")
            items = _items(key)
            if tuple(items) in made:
                raise ValueError("this key is set more than once; give it one value")
            made.add(tuple(items))
            _assign(changed, items, value)
        except ValueError as error:
            problems.append(Problem(key, text, str(error)))
    if problems:
        raise CaseError(problems)
    return changed


def _assignments(overrides: Overrides, path: str = "") -> Iterator[tuple[str, str, Any]]:
    """Yields for each assignment the key, its text for messages, and the value; Ellipsis if the assignment has no
    value.
    """
    if isinstance(overrides, Mapping):
        for name, value in overrides.items():
            key = f"{path}.{name}" if path else str(name)
            if isinstance(value, Mapping) and value:
                yield from _assignments(value, key)
            else:
                yield key, shown(value), copy.deepcopy(value)
        return
    for override in overrides:
        key, equals, text = override.partition("=")
        yield key.strip(), shown(text.strip()) if equals else "", _toml_value(text.strip()) if equals else ...


def _items(key: str) -> list[int | str]:
    return [name or int(index) for name, index in _ITEM.findall(key)]


def _toml_value(text: str) -> Any:
    try:
        data = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    return data["value"] if len(data) == 1 else text


def _assign(target: Any, items: list[int | str], value: Any) -> None:
    for item, following in pairwise(items):
        if isinstance(target, dict) and isinstance(following, str):
            target = target.setdefault(item, {})
        else:
            target = _entry(target, item)
    if isinstance(target, dict) and isinstance(items[-1], str):
        target[items[-1]] = value
    else:
        _entry(target, items[-1])
        target[items[-1]] = value


def _entry(target: Any, item: int | str) -> Any:
    if isinstance(item, str):
        if not isinstance(target, dict):
            raise ValueError(f"{item!r} cannot be set: the value that contains it is not a table")
        if item not in target:
            raise ValueError(f"there is no list {item!r} whose item could be set")
        return target[item]
    if not isinstance(target, list):
        raise ValueError(f"[{item}] cannot be set: the value that contains it is not a list")
    if item >= len(target):
        raise ValueError(f"[{item}] is outside the list, which has {len(target)} items, counted from 0")
    return target[item]


def resolved_json(case: Case) -> bytes:
    """Returns the case as JSON in SI units, with every default and with every material that its parts use. The text
    ends in a line feed.
    """
    used = {part.material: material(case, part.material) for part in case.parts}
    full = case.model_copy(update={"materials": {**case.materials, **used}})
    return full.model_dump_json(indent=2).encode() + b"\n"


def shipped() -> dict[str, Path]:
    """The file of each shipped case, by the name of the case."""
    return {path.stem: path for path in sorted((Path(__file__).parent / "shipped").glob("*.toml"))}


def shipped_path(name: str) -> Path:
    """Returns the file of a shipped case. Raises CaseError with the nearest names if the name is unknown."""
    known = shipped()
    if name not in known:
        raise CaseError([Problem("case", shown(name), f"no shipped case of this name; {nearest(name, known)}")])
    return known[name]


def materials() -> list[str]:
    """Returns the names of the materials of the library."""
    return sorted(library())
