"""The material library: ``materials.toml``, every constant with its confidence and source."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from .materials import Material
from .problems import CaseError, nearest, problem
from .schema import Case

PATH = Path(__file__).with_name("materials.toml")
Confidence = Literal["paper", "read", "derived", "memory", "assumed"]
"""How sure a constant is: in the paper this work starts from; read in the source named; computed from other constants;
remembered from the literature and not read again; chosen without evidence for this alloy."""
CONFIDENCES: tuple[str, ...] = get_args(Confidence)


@cache
def library() -> dict[str, Material]:
    """Every material of the library by its name."""
    return {name: Material.model_validate(_values(table)) for name, table in _tables().items()}


@cache
def sources() -> dict[str, str]:
    """What the source keys of the library stand for."""
    return dict(tomllib.loads(PATH.read_text(encoding="utf-8"))["sources"])


def provenance(name: str) -> dict[str, tuple[str, str]]:
    """``{"elastic.young": ("read", "uintah"), ...}``: confidence and source key of each constant of a material."""
    return dict(_provenance(_tables()[name], ""))


def material(case: Case, name: str) -> Material:
    """The material ``name``: the case's own first, then the library's. Raises CaseError with the nearest names."""
    known = {**library(), **case.materials}
    if name not in known:
        raise CaseError([problem(("material",), name, f"unknown material; {nearest(name, sorted(known))}")])
    return known[name]


def _tables() -> dict[str, dict[str, Any]]:
    tables = tomllib.loads(PATH.read_text(encoding="utf-8"))
    return {name: table for name, table in tables.items() if name != "sources"}


def _values(table: dict[str, Any]) -> dict[str, Any]:
    """The table with each ``[value, confidence, source]`` replaced by its value."""
    return {key: _value(entry) for key, entry in table.items()}


def _value(entry: Any) -> Any:
    if isinstance(entry, dict):
        return _values(entry)
    return entry[0] if isinstance(entry, list) else entry


def _provenance(table: dict[str, Any], prefix: str) -> list[tuple[str, tuple[str, str]]]:
    found: list[tuple[str, tuple[str, str]]] = []
    for key, entry in table.items():
        if isinstance(entry, dict):
            found += _provenance(entry, f"{prefix}{key}.")
        elif isinstance(entry, list):
            found.append((f"{prefix}{key}", (entry[1], entry[2])))
    return found
