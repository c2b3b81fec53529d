"""Rows of the table of runs as JSON.

Values that similar cases have in common are sent once; each row has only the values in which its case differs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, starmap
from typing import Any

import msgspec

from conoid.cases.reference.flat import Scalar
from conoid.cases.reference.key_units import unit_of_key

from .card import Card

MOST_BYTES = 4 << 20
"""Largest size in bytes of the rows and cases of an answer. The limit is enough for 2,000 runs of a case with fifty
results (reason of the chosen value)."""
_ALIKE = 0.8
"""Smallest fraction of common keys for which two cases count as similar (chosen value)."""
_GROUPS = 50
"""Largest number of groups of similar cases in an answer; runs of further groups have no values. The values of 50
groups of 300 values each are 0.6 MB (reason of the chosen number)."""


@dataclass
class Group:
    """A group of similar cases."""

    values: dict[str, Scalar]
    """Values of the first case of the group, by key."""
    results: dict[str, str] = field(default_factory=dict)
    """Units of the results of the runs of the group, by the name of the result; the order of the names is that of the
    results in a row."""

    def takes(self, keys: Mapping[str, Scalar]) -> bool:
        """Whether a case with these keys is similar to the first case of the group."""
        both = len(self.values.keys() & keys.keys())
        return both >= _ALIKE * (len(self.values) + len(keys) - both)

    def shown(self) -> dict[str, Any]:
        """Returns the group in the form in which it is sent."""
        units = {key: unit for key in self.values if (unit := unit_of_key(key))}
        results = [{"name": name, "unit": unit} for name, unit in self.results.items()]
        return {"values": self.values, "units": units, "results": results}


class Table:
    """A table of runs, filled until it has ``MOST_BYTES``."""

    def __init__(self) -> None:
        """Creates a table without rows."""
        self.groups: list[Group] = []
        self.rows: list[msgspec.Raw] = []
        self.pending = 0
        """Number of runs whose card has not been read yet."""
        self._bytes = 0

    def add(self, line: dict[str, Any], card: Card | None) -> bool:
        """Adds the table row of a run. ``line``: data of the run as in the list of runs. Returns False without adding
        the row if the answer would exceed its largest size.
        """
        groups = len(self.groups)
        row = msgspec.json.encode({**line, **self._of_card(card)})
        size = len(row) + sum(len(msgspec.json.encode(group.values)) for group in self.groups[groups:])
        if self.rows and self._bytes + size > MOST_BYTES:
            del self.groups[groups:]
            return False
        self.pending += card is None
        self._bytes += size
        self.rows.append(msgspec.Raw(row))
        return True

    def _of_card(self, card: Card | None) -> dict[str, Any]:
        number = self._group(card.values) if card is not None else None
        if card is None or number is None:
            return {"case": None, "values": {}, "results": None, "references": 0, "missed": []}
        group = self.groups[number]
        for name in card.results or ():
            group.results.setdefault(name, card.units.get(name, ""))
        results = None if card.results is None else [card.results.get(name) for name in group.results]
        return {
            "case": number, "values": dict(_others(group.values, card.values)), "results": results,
            "references": card.references, "missed": card.missed,
        }  # fmt: skip

    def _group(self, values: dict[str, Scalar]) -> int | None:
        found = next((n for n, group in enumerate(self.groups) if group.takes(values)), None)
        if found is None and len(self.groups) < _GROUPS:
            self.groups.append(Group(values))
            return len(self.groups) - 1
        return found


def _others(common: Mapping[str, Scalar], values: Mapping[str, Scalar]) -> Iterator[tuple[str, Scalar | None]]:
    """Yields the keys whose value differs from that in ``common``, with the value of the case; None for a key that the
    case lacks.
    """
    for key in {**common, **values}:
        if common.get(key) != values.get(key):
            yield key, values.get(key)


def short(ids: Sequence[str], least: int) -> dict[str, str]:
    """Returns, for each of the sorted ``ids``, the shortest prefix that is unique, with at least ``least``
    characters.
    """
    shared = [0, *starmap(_shared, pairwise(ids)), 0]
    return {each: each[: max(least, 1 + max(about))] for each, about in zip(ids, pairwise(shared), strict=True)}


def _shared(one: str, other: str) -> int:
    """Returns the number of equal characters at the beginning of two different ids."""
    return next((n for n, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
