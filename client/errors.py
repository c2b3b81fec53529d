"""Errors for users. Each error has a message of one line.

::

    ConoidError
    ├── CaseError            the case is wrong; contains all errors of the case (cases/reading/problems.py)
    ├── …                    errors of a worker that Python code calls (worker/errors.py)
    └── ClientError
        ├── ServiceError     the server refused the request; has the fields of an RFC 9457 problem
        ├── UnreachableError no server answered
        │   └── AnswerError  the answer cannot be read, has no end, or redirects elsewhere
        ├── NotFoundError    a run, file or folder does not exist, here or on the server (then also a ServiceError)
        ├── UnfinishedError  the run has not written the requested result yet
        ├── UsageError       an argument or a value is wrong, or a name is unknown
        └── ViewError        no picture could be made
            └── LookError    an option of a picture is wrong (also a UsageError)

The exit code of the command line is 2 for a wrong case or argument, and 1 for other errors.
"""

from collections.abc import Mapping
from typing import Any

from conoid.cases.reading.problems import CaseError, ConoidError, Problem

_LONGEST = 1000
"""Largest number of characters of a server's message that are shown (chosen value: they fill half a screen)."""


class ClientError(ConoidError):
    """An error for the user, with a text of one line. ``exit_code``: exit code of the command."""

    exit_code = 1


class ServiceError(ClientError):
    """Refusal of a request by the server. ``status``: HTTP status; ``problem``: content of the answer."""

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        """``problem`` has the members of RFC 9457 (title, detail) and members of Conoid (code, pointer, hint,
        errors).
        """
        self.status = status
        self.problem = dict(problem)
        super().__init__(_line(status, problem))

    @property
    def exit_code(self) -> int:  # type: ignore[override]
        """Exit code of the command: 2 if input was refused, 1 for other errors."""
        return 2 if self.status in {400, 413, 422} else 1

    @property
    def retryable(self) -> bool:
        """True if the same request may succeed later."""
        return bool(self.problem.get("retryable", self.status in {429, 502, 503, 504}))


class NotFoundError(ClientError):
    """The run, file or folder does not exist."""


class MissingError(ServiceError, NotFoundError):
    """The server has no such run or file, or has removed it."""


class UnreachableError(ClientError):
    """No server has answered at the address, or the answer was interrupted."""


class AnswerError(UnreachableError):
    """The answer of the server cannot be read, is too long, is too slow, or redirects to another address. A repeated
    request does not help.
    """


def passes(error: ClientError) -> bool:
    """Returns True if the same request may succeed soon, because no server answered or the server reported a
    temporary problem.
    """
    if isinstance(error, UnreachableError):
        return not isinstance(error, AnswerError)
    return isinstance(error, ServiceError) and error.retryable


class UnfinishedError(ClientError):
    """The run has not written the requested data yet."""


class UsageError(ClientError):
    """A wrong argument, value or name."""

    exit_code = 2


class ViewError(ClientError):
    """A picture cannot be drawn; the text of the error names what is missing."""


class LookError(UsageError, ViewError):
    """A wrong option, field or time of a picture."""


def _line(status: int, problem: Mapping[str, Any]) -> str:
    message = _brief(problem.get("detail") or problem.get("title") or f"the server answered {status}")
    hint = _brief(problem.get("hint") or "")
    return f"{message} ({hint})" if hint and hint not in message else message


def _brief(message: object) -> str:
    """Returns a message of a server as text for people, shortened if necessary."""
    text = str(message)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def refusal(status: int, problem: Mapping[str, Any]) -> ConoidError:
    """Returns the error for a refusal of the server. The error has the class that the same problem has on this
    machine.
    """
    errors = problem.get("errors")
    entries = [entry for entry in errors if isinstance(entry, Mapping)] if isinstance(errors, list) else []
    if status == 422 and entries:
        return CaseError(
            Problem(*(str(entry.get(name) or "") for name in ("key", "value", "message"))) for entry in entries
        )
    return (MissingError if status in {404, 410} else ServiceError)(status, problem)
