"""Filters of a list of runs as parameters of an HTTP request."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from conoid.cases.reading.problems import shown

from ..errors import UsageError

Moment = float | datetime | None
"""A limit of time: Unix s, or a date with a time of day; None means no limit."""


def query_of(
    states: Sequence[str], labels: Mapping[str, str] | None, case: str, text: str, since: Moment, until: Moment
) -> dict[str, Any]:
    """Returns the request parameters for a list of runs; filters that are not used are left out."""
    wanted = states if isinstance(states, str) else ",".join(states)
    asked = {
        "state": wanted, "label": words_of(labels), "case": case, "text": text, "since": _unix(since),
        "until": _unix(until),
    }  # fmt: skip
    return {name: value for name, value in asked.items() if value not in ("", [], None)}


def _unix(moment: Moment) -> float | None:
    return moment.timestamp() if isinstance(moment, datetime) else moment


def words_of(labels: Mapping[str, str] | None) -> list[str]:
    """Returns each label as text ``name=value``. Raises UsageError."""
    if labels is not None and not isinstance(labels, Mapping):
        raise UsageError(f"labels = {shown(labels)}: allowed: names with values, such as {{'batch': 'first'}}")
    return [f"{name}={value}" for name, value in (labels or {}).items()]
