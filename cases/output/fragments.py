"""The table of the fragments of a frame, and its statistics: distributions of sizes, share of dust, share of the
largest fragment.

::

    <run>/fragments/fragments_0012.csv   one line per fragment of frame 12
    <run>/fragments/genealogy.csv        one line per new fragment: frame, parent, child, tets
"""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

FOLDER = "fragments"
_AXES = ("x", "y", "z")
_PAIRS = ("xx", "yy", "zz", "yz", "zx", "xy")
COLUMNS: dict[str, str] = {
    "t": "s", "label": "", "part": "", "tets": "", "nodes": "", "mass": "kg",
    **{f"centre_{i}": "m" for i in _AXES},
    **{f"velocity_{i}": "m/s" for i in _AXES},
    **{f"angular_momentum_{i}": "kg m^2/s" for i in _AXES},
    **{f"inertia_{ij}": "kg m^2" for ij in _PAIRS},
    "translation": "J", "rotation": "J", "deformation": "J",
    **{f"low_{i}": "m" for i in _AXES},
    **{f"high_{i}": "m" for i in _AXES},
    "extent": "m", "new_surface": "m^2",
}  # fmt: skip
"""Columns of the table of fragments and their units. ``label``: number of the fragment, counted from 0. When a fragment
breaks, the piece with the most tets keeps the number, and the other pieces get new numbers. Angular momentum and
inertia refer to the centre of the fragment. The columns for translation, rotation and deformation contain fractions of
the kinetic energy of the fragment. ``extent``: longest side of the bounding box between ``low`` and ``high``.
``new_surface``: initial area of the broken faces of the fragment; a crack between two fragments counts in both."""
_WHOLE = ("label", "tets", "nodes")
DUST = 10
"""Smallest number of tets of a fragment that does not count as dust. The shape of a smaller fragment is that of its
tets."""


def path(folder: Path, index: int) -> Path:
    """Path of the table of frame ``index`` in the run folder ``folder``."""
    return folder / FOLDER / f"fragments_{index:04d}.csv"


GENEALOGY = ("frame", "parent", "child", "tets")
"""Columns of the table of genealogy: which fragment each new fragment comes from."""


def genealogy(folder: Path) -> Path:
    """Path of the genealogy of fragments in the run folder ``folder``."""
    return folder / FOLDER / "genealogy.csv"


def header() -> list[str]:
    """Returns the first line of the table, with names and units such as ``mass [kg]``."""
    return [f"{name} [{unit}]" if unit else name for name, unit in COLUMNS.items()]


def read(table: Path) -> list[dict[str, float | int | str]]:
    """Returns the lines of a table of fragments; each line is a mapping from the names of ``COLUMNS`` to values. Raises
    ValueError if the file has other columns.
    """
    with table.open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    if not lines or lines[0] != header():
        raise ValueError(f"{table}: not a table of fragments")
    return [{name: _value(name, text) for name, text in zip(COLUMNS, line, strict=True)} for line in lines[1:]]


def _value(name: str, text: str) -> float | int | str:
    if name == "part":
        return text
    return int(text) if name in _WHOLE else float(text)


@dataclass(frozen=True)
class Fit:
    """A distribution of sizes whose parameter was fitted by maximum likelihood. If two distributions are fitted to the
    same values, the one with the larger likelihood fits better.
    """

    law: str
    """``rayleigh``, ``exponential`` or ``power``."""
    parameter: float
    """Parameter of the distribution: the mode of ``rayleigh``, the mean of ``exponential``, the exponent of the density
    of ``power``."""
    log_likelihood: float
    """Sum of ln(density) over the values in SI units."""


def fits(values: Sequence[float]) -> list[Fit]:
    """Returns the Rayleigh, exponential and power-law distributions fitted by maximum likelihood; empty for fewer than
    two distinct positive values.

    Densities: x / s^2 exp(-x^2 / 2 s^2), exp(-x / mu) / mu, and (a - 1) / x_0 (x / x_0)^-a above x_0, where x_0 is the
    smallest value.
    """
    n = len(values)
    if n < 2 or min(values) <= 0.0 or min(values) == max(values):
        return []
    smallest, mean = min(values), math.fsum(values) / n
    mode = math.sqrt(math.fsum(x * x for x in values) / (2 * n))
    logs, above = math.fsum(map(math.log, values)), math.fsum(math.log(x / smallest) for x in values)
    exponent = 1.0 + n / above
    return [
        Fit("rayleigh", mode, logs - 2 * n * math.log(mode) - n),
        Fit("exponential", mean, -n * math.log(mean) - n),
        Fit("power", exponent, n * math.log((exponent - 1.0) / smallest) - exponent * above),
    ]


@dataclass(frozen=True)
class Summary:
    """Statistics of a table of fragments. Dust is included in the masses but not in the distributions."""

    fragments: int
    dust: int
    dust_share: float
    """Fraction of the mass of all fragments that is dust."""
    largest_share: float
    """Fraction of the mass of all fragments that is in the largest fragment."""
    sizes: list[Fit]
    """Distributions fitted to the extents of the fragments."""
    masses: list[Fit]


def summary(tets: Sequence[int], masses: Sequence[float], extents: Sequence[float]) -> Summary:
    """Returns the statistics of one table from its columns; masses in kg, extents in m."""
    whole = [k for k, count in enumerate(tets) if count >= DUST]
    total = math.fsum(masses)
    dust = math.fsum(m for m, count in zip(masses, tets, strict=True) if count < DUST)
    return Summary(
        fragments=len(whole), dust=len(tets) - len(whole), dust_share=dust / total if total > 0.0 else 0.0,
        largest_share=max(masses) / total if total > 0.0 else 0.0,
        sizes=fits([extents[k] for k in whole]), masses=fits([masses[k] for k in whole]),
    )  # fmt: skip
