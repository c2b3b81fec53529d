"""The columns of history.csv: a column with a unit is ``t [s]``, a column without a unit is ``step``."""

import re
from collections.abc import Mapping, Sequence

from ..ledger import Energy, PartEnergy

CLOCK: dict[str, str] = {"step": "", "t": "s", "dt": "s", "limiter": ""}
LEDGER: dict[str, str] = {name: "" if name == "residual" else "J" for name in Energy.__struct_fields__}
MOMENTA: dict[str, str] = {
    **{f"momentum_{axis}": "kg m/s" for axis in "xyz"}, **{f"angular_momentum_{axis}": "kg m^2/s" for axis in "xyz"},
}  # fmt: skip
"""Columns of the momentum and the angular momentum. The angular momentum refers to the origin of the coordinates."""
COLUMNS: dict[str, str] = {**CLOCK, **LEDGER, **MOMENTA}
"""Columns that every run has, with their units; the columns of parts and probes follow them."""
OF_PARTS = PartEnergy.__struct_fields__
"""Columns of the energies of each part, J."""
_HEADER = re.compile(r"(.*?)(?: \[([^\]]*)\])?")


def of_parts(parts: Sequence[str]) -> dict[str, str]:
    """Returns the columns of the parts, such as ``kinetic.bar``, with their units. For a case with a single part there
    are no such columns.
    """
    return {f"{name}.{part}": "J" for part in parts for name in OF_PARTS} if len(parts) > 1 else {}


def part_of(column: str) -> tuple[str, str] | None:
    """Returns the energy term and the part of a column such as ``kinetic.bar``; None for any other column. A dot
    separates term and part; the name of a probe contains no dot.
    """
    name, point, part = column.partition(".")
    return (name, part) if point and name in OF_PARTS else None


def header(columns: Mapping[str, str]) -> list[str]:
    """Returns the texts of the first line of a table with the given columns and units."""
    return [f"{name} [{unit}]" if unit else name for name, unit in columns.items()]


def split(text: str) -> tuple[str, str]:
    """Returns name and unit of a column from its text in the first line; the unit is empty if the column has none."""
    found = _HEADER.fullmatch(text)
    return (found[1], found[2] or "") if found is not None else (text, "")
