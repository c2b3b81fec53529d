"""What can go wrong for a user, as one clear line each.

::

    ConoidError
    ├── CaseError            the case is wrong, whoever has found it: every error at once (cases/reading/problems.py)
    ├── …                    what a worker raises that is called from Python (worker/errors.py)
    └── ClientError
        ├── ServiceError     the server refused: the fields of an RFC 9457 problem
        ├── UnreachableError no server answered
        │   └── AnswerError  what answered cannot be read, has no end, or is somewhere else
        ├── NotFoundError    there is no such run, file or folder, here or on the server (then a ServiceError, too)
        ├── UnfinishedError  a result was asked of a run that has none yet
        ├── UsageError       what was asked for is wrong: an argument, a value, a name that nobody knows
        └── ViewError        no picture could be made
            └── LookError    a picture was asked for that there is none of (then a UsageError, too)

The command line ends with 2 where what was asked for is wrong, be it a case or an argument, and with 1 for the rest.
"""

from collections.abc import Mapping
from typing import Any

from conoid.cases.reading.problems import CaseError, ConoidError, Problem

_LONGEST = 1000
"""Characters of a server's words that are shown. Chosen: half a screen."""


class ClientError(ConoidError):
    """Its text is one line for people; ``exit_code`` is what the command line ends with."""

    exit_code = 1


class ServiceError(ClientError):
    """The server refused. ``status`` is the HTTP status, ``problem`` the body as the server sent it."""

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        """``problem`` holds what RFC 9457 names (title, detail) and what Conoid adds (code, pointer, hint, errors)."""
        self.status = status
        self.problem = dict(problem)
        super().__init__(_line(status, problem))

    @property
    def exit_code(self) -> int:  # type: ignore[override]
        """2 for input that was refused, 1 for anything else."""
        return 2 if self.status in {400, 413, 422} else 1

    @property
    def retryable(self) -> bool:
        """True when the same request may succeed later."""
        return bool(self.problem.get("retryable", self.status in {429, 502, 503, 504}))


class NotFoundError(ClientError):
    """There is no such run, file or folder."""


class MissingError(ServiceError, NotFoundError):
    """The server has no such run or file, or has it no longer."""


class UnreachableError(ClientError):
    """No server answered at the address, or the answer broke off."""


class AnswerError(UnreachableError):
    """What the server answered cannot be read, is longer than any answer, comes too slowly, or points elsewhere. To ask
    again is of no use.
    """


def passes(error: ClientError) -> bool:
    """Whether the same request may succeed soon: nobody answered, or who answered says so."""
    if isinstance(error, UnreachableError):
        return not isinstance(error, AnswerError)
    return isinstance(error, ServiceError) and error.retryable


class UnfinishedError(ClientError):
    """The run has not written what was asked for yet."""


class UsageError(ClientError):
    """What was asked for is wrong: an argument, a value, a name that nobody knows."""

    exit_code = 2


class ViewError(ClientError):
    """No picture could be made; the text says what is missing."""


class LookError(UsageError, ViewError):
    """A picture was asked for as there is none: an option, a field, a time."""


def _line(status: int, problem: Mapping[str, Any]) -> str:
    said = _brief(problem.get("detail") or problem.get("title") or f"the server answered {status}")
    hint = _brief(problem.get("hint") or "")
    return f"{said} ({hint})" if hint and hint not in said else said


def _brief(told: object) -> str:
    """What a server says, as people can read it."""
    text = str(told)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def refusal(status: int, problem: Mapping[str, Any]) -> ConoidError:
    """What a refusal of the server is raised as: what is raised where the same is found on this machine."""
    told = problem.get("errors")
    entries = [entry for entry in told if isinstance(entry, Mapping)] if isinstance(told, list) else []
    if status == 422 and entries:
        return CaseError(
            Problem(*(str(entry.get(name) or "") for name in ("key", "value", "message"))) for entry in entries
        )
    return (MissingError if status in {404, 410} else ServiceError)(status, problem)
