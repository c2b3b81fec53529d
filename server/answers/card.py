"""The card of a run: the row of data that the table of runs shows, with the values of its case and, after its end, its
results.

A case never changes, and results do not change after the end of the run. Therefore a card is made only once, from the
files in the run's folder.
"""

import zlib
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.cases.output.points import results
from conoid.cases.reading import whole
from conoid.cases.reference.flat import Scalar, flat

from ..runs import folder
from ..runs.journal import DAMAGED

FORM = 1
"""Version of the stored form of a card. A stored card with another version is made again."""
_KEYS, _LETTERS = 1000, 200
"""Largest number of values of a case, and largest number of characters of one value. A case of ten parts has 500 values
(reason of the chosen limits)."""
_RESULTS = 200
"""Largest number of results of a run; a run of twenty probes has 100 results (reason of the chosen limit)."""
_MOST_BYTES = 8 << 20
"""Largest size in bytes of a case file that is read (chosen value)."""
_LEFT_OUT = ("digest", ".passed")
"""Endings of the names of results that are texts and not numbers; such results are not part of a card."""


class Card(msgspec.Struct, kw_only=True, frozen=True):
    """The card of one run; ``results`` is None before the end of the run."""

    title: str = ""
    values: dict[str, Scalar] = {}
    """Values of the case by key, in SI units."""
    results: dict[str, float | None] | None = None
    units: dict[str, str] = {}
    """Units of the results, by the name of the result; results without a unit are not listed."""
    references: int = 0
    """Number of reference values with which the results of the run were compared."""
    missed: list[str] = []
    """Names of the reference values from which the results of the run differ by more than the tolerance."""


_decoder = msgspec.json.Decoder(Card)


def packed(card: Card) -> bytes:
    """Returns the stored form of a card."""
    return zlib.compress(msgspec.json.encode(card), 1)


def unpacked(data: bytes) -> Card:
    """Returns a card from its stored form. Raises msgspec.MsgspecError or zlib.error if the data is not a stored
    card.
    """
    return _decoder.decode(zlib.decompress(data))


def of(path: Path, final: bool) -> Card:
    """Makes the card of the run in the folder ``path``. If files of the run are missing or damaged, the card lacks
    their data.
    """
    ended = _ended(path) if final else None
    found = {
        pair: _number(value)
        for pair, value in results(ended).items()
        if not pair[0].endswith(_LEFT_OUT) and not isinstance(value, str)
    }
    kept = dict(list(found.items())[:_RESULTS])
    checks = ended.reference if ended is not None else []
    return Card(
        title=_title(path), values=_values(path),
        results={name: value for (name, _), value in kept.items()} if final else None,
        units={name: unit for name, unit in kept if unit},
        references=len(checks), missed=[check.name for check in checks if not check.passed],
    )  # fmt: skip


def _number(value: float | None) -> float | None:
    """Converts a result to float; returns None for an integer that is too large for a float."""
    try:
        return None if value is None else float(value)
    except OverflowError:
        return None


def _title(path: Path) -> str:
    try:
        return folder.submission(path).title[:_LETTERS]
    except (OSError, msgspec.MsgspecError):
        return ""


def _values(path: Path) -> dict[str, Scalar]:
    try:
        case: dict[str, Any] = msgspec.json.decode(
            whole.read(path / layout.RESOLVED_CASE, _MOST_BYTES, links=False), type=dict
        )
        return flat(case, _KEYS, _LETTERS)
    except (OSError, *DAMAGED):
        return {}


def _ended(path: Path) -> Outcome | None:
    try:
        return folder.outcome(path)
    except OSError:
        return None
