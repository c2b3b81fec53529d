"""What the table of runs tells of a run beside its state: the values of its case, and its results once it has ended.

Neither changes any more then, so a card is made once, of the files in the run's folder.
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
"""Of a card as it is kept; one of another form is made again."""
_KEYS, _LETTERS = 1000, 200
"""Values of a case, and characters of one. Chosen: a case of ten parts has 500 values."""
_RESULTS = 200
"""Of a run. Chosen: a run of twenty probes has 100."""
_MOST_BYTES = 8 << 20
"""Of a case's file that is read. Chosen: ten times the largest body of a request, with every default."""
_LEFT_OUT = ("digest", ".passed")
"""How the names of results end that are no numbers."""


class Card(msgspec.Struct, kw_only=True, frozen=True):
    """Of one run; ``results`` is None before it has ended."""

    title: str = ""
    values: dict[str, Scalar] = {}
    """Of the case, by key, in SI units."""
    results: dict[str, float | None] | None = None
    units: dict[str, str] = {}
    """Of results that have one."""
    references: int = 0
    """Reference numbers that the run was compared with."""
    missed: list[str] = []
    """Names of those that it misses."""


_decoder = msgspec.json.Decoder(Card)


def packed(card: Card) -> bytes:
    """A card as it is kept."""
    return zlib.compress(msgspec.json.encode(card), 1)


def unpacked(data: bytes) -> Card:
    """Raises msgspec.MsgspecError, zlib.error for what is no card."""
    return _decoder.decode(zlib.decompress(data))


def of(path: Path, final: bool) -> Card:
    """The card of the run in the folder ``path``; what is gone or damaged there is left out."""
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
    """None for a whole number that is larger than any float, too."""
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
        case: dict[str, Any] = msgspec.json.decode(whole.read(path / layout.RESOLVED_CASE, _MOST_BYTES), type=dict)
        return flat(case, _KEYS, _LETTERS)
    except (OSError, *DAMAGED):
        return {}


def _ended(path: Path) -> Outcome | None:
    try:
        return folder.outcome(path)
    except OSError:
        return None
