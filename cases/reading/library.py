"""The material library ``materials.toml``: each constant with its value, its confidence and its source."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from ..model.materials import Material
from ..model.schema import Case
from .problems import CaseError, problem
from .similar import nearest

PATH = Path(__file__).parents[1] / "materials.toml"
Confidence = Literal["paper", "read", "derived", "memory", "assumed"]
"""Confidence of a constant of the library. ``paper``: given in the paper on which this project is based; ``read``: read
in the named source; ``derived``: computed from other constants; ``memory``: remembered from the literature and not read
again; ``assumed``: chosen without evidence for this alloy."""
CONFIDENCES: tuple[str, ...] = get_args(Confidence)


@cache
def library() -> dict[str, Material]:
    """Returns every material of the library by its name."""
    return {name: Material.model_validate(_values(table)) for name, table in _tables().items()}


@cache
def sources() -> dict[str, str]:
    """Returns the sources of the library by their keys."""
    return dict(tomllib.loads(PATH.read_text(encoding="utf-8"))["sources"])


def provenance(name: str) -> dict[str, tuple[str, str]]:
    """Returns the confidence and the source key of each constant of a material: ``{"elastic.young": ("read", "uintah"),
    ...}``.
    """
    return {key: (confidence, source) for key, (_, confidence, source) in _entries(_tables()[name], "")}


@dataclass(frozen=True)
class Constant:
    """A constant of the library: its value as text, such as ``7850 kg/m^3``, its confidence and its source."""

    key: str
    value: str
    confidence: Confidence
    source: str
    """Key of a source of the library."""
    cited: str
    """Text of the source, as it is cited."""


def constants(name: str) -> list[Constant]:
    """Returns every constant of a material of the library. Raises CaseError with the nearest names if the material is
    unknown.
    """
    if name not in library():
        raise CaseError([problem(("material",), name, f"unknown material; {nearest(name, sorted(library()))}")])
    return [
        Constant(key, str(value), confidence, source, sources()[source])
        for key, (value, confidence, source) in _entries(_tables()[name], "")
    ]


def material(case: Case, name: str) -> Material:
    """Returns the material ``name`` of the case; if the case does not define it, the material of the library. Raises
    CaseError with the nearest names if the material is unknown.
    """
    known = {**library(), **case.materials}
    if name not in known:
        raise CaseError([problem(("material",), name, f"unknown material; {nearest(name, sorted(known))}")])
    return known[name]


def _tables() -> dict[str, dict[str, Any]]:
    tables = tomllib.loads(PATH.read_text(encoding="utf-8"))
    return {name: table for name, table in tables.items() if name != "sources"}


def _values(table: dict[str, Any]) -> dict[str, Any]:
    """Returns a table of the library with values in place of the lists ``[value, confidence, source]``."""
    return {key: _value(entry) for key, entry in table.items()}


def _value(entry: Any) -> Any:
    if isinstance(entry, dict):
        return _values(entry)
    return entry[0] if isinstance(entry, list) else entry


def _entries(table: dict[str, Any], prefix: str) -> Iterator[tuple[str, list[Any]]]:
    """Yields each constant of a table: its dotted key, and the list of value, confidence and source key."""
    for key, entry in table.items():
        if isinstance(entry, dict):
            yield from _entries(entry, f"{prefix}{key}.")
        elif isinstance(entry, list):
            yield f"{prefix}{key}", entry
