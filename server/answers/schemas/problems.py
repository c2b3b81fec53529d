"""JSON schemas of refused requests; an error has one line of text for people and a code for programs."""

from typing import Any

import msgspec


class ProblemEntry(msgspec.Struct, kw_only=True):
    """An error of a case."""

    key: str
    value: str
    message: str
    pointer: str


class Problem(msgspec.Struct, kw_only=True, omit_defaults=True):
    """Refusal of a request (RFC 9457): ``detail`` is one line for people, ``code`` a constant word for programs."""

    type: str
    title: str
    status: int
    detail: str
    code: str
    retryable: bool
    pointer: str = ""
    hint: str = ""
    errors: list[ProblemEntry] = []
    outcome: dict[str, Any] = {}
    """The record that is kept of a removed run."""
