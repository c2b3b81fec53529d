"""The columns of history.csv, and how they are written: ``t [s]`` with a unit, ``step`` without."""

import re
from collections.abc import Mapping

from .messages import Energy

CLOCK: dict[str, str] = {"step": "", "t": "s", "dt": "s", "limiter": ""}
LEDGER: dict[str, str] = {name: "" if name == "residual" else "J" for name in Energy.__struct_fields__}
MOMENTUM: dict[str, str] = {f"momentum_{axis}": "kg m/s" for axis in "xyz"}
COLUMNS: dict[str, str] = {**CLOCK, **LEDGER, **MOMENTUM}
"""Columns and units of every run; those of its probes follow."""
_HEADER = re.compile(r"(.*?)(?: \[([^\]]*)\])?")


def header(columns: Mapping[str, str]) -> list[str]:
    """The first line of a table with these columns and units."""
    return [f"{name} [{unit}]" if unit else name for name, unit in columns.items()]


def split(text: str) -> tuple[str, str]:
    """Name and unit of a column as it is written; the unit is empty where there is none."""
    found = _HEADER.fullmatch(text)
    return (found[1], found[2] or "") if found is not None else (text, "")
