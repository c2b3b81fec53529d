"""JSON schemas of refused requests. Each error has a text of one line for users and a code for programs."""

from typing import Any

import msgspec


class ProblemEntry(msgspec.Struct, kw_only=True):
    """An error of a case."""

    key: str
    value: str
    message: str
    pointer: str


class Problem(msgspec.Struct, kw_only=True, omit_defaults=True):
    """Refusal of a request (RFC 9457): ``detail`` is a text of one line for users, ``code`` a fixed word for
    programs.
    """

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
    """Record that the server keeps of a run that was removed."""
