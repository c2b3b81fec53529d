"""``python -m conoid.server.intake.reading``: reads cases, each in a separate process with limits.

How much time and memory the reading of a case needs is not known before. The program loads all modules once, and then
forks one process for each case. Therefore a case is read within milliseconds, and a case that needs too much time or
memory ends only its own process. The standard input of the program is a socket; the server sends a connection for each
case over it. The program ends with the server. The program has only one thread, because fork copies only one thread.
"""

import os
import resource
import signal
import socket
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.estimates.clock_time import clock_time
from conoid.cases.estimates.estimate import Estimate, estimate
from conoid.cases.load import CaseError, Problem, json_data, parse_case, resolved_json, shipped_path, toml_data
from conoid.cases.model.schema import Case
from conoid.cases.reading.files import files_of
from conoid.cases.reading.problems import dotted, problem
from conoid.cases.reading.survey import Survey, from_json
from conoid.cases.warnings.plausible import bare_numbers
from conoid.cases.warnings.warned import warned

from ..requests import limits
from ..requests.limits import Limits

CPU, WALL, MEMORY = 5, 20, 1 << 30
"""Limits for reading a case: CPU time in s, wall time in s, memory in bytes. The largest shipped case takes 0.1 s and
100 MB; the limits are larger because a machine may be busy (chosen values)."""
_NICE = 5
"""Increase of the nice value of a process that reads a case, so that the server has priority over it (chosen value)."""
_SHIPPED = "demo"
"""Name of a shipped case that the program reads before any other case. This case is small and has a material of the
library."""
_MOST_FILES = 1000
"""Largest number of files that are listed for a case with problems (chosen value)."""
_UNREAD = "was not read yet; the run will read the file"
PID = 4
"""Number of bytes with which each forked process first sends its process number."""


class Question(msgspec.Struct, frozen=True, kw_only=True):
    """A request body that contains a case, its content type, and the resources that the case may use."""

    body: bytes
    json: bool
    limits: Limits
    survey: bytes | None = None
    """Survey of the mesh files that the case names (conoid.cases.reading.survey). An empty survey means that no survey
    could be made. None means that no survey has been made yet; a case with files is then checked but not estimated."""
    folder: str = ""
    """Folder with the files that the case names."""


class FileName(msgspec.Struct, frozen=True, kw_only=True):
    """A file that a case names, and the key of the table that names it."""

    key: str
    path: str
    sha256: str


class WrongCaseError(CaseError):
    """Error: a case has problems. The exception has the problems and the files that the case names."""

    def __init__(self, problems: Iterable[Problem], files: Sequence[FileName]) -> None:
        """Creates the error with the ``problems`` of the case and its ``files``."""
        super().__init__(problems)
        self.files = files


class Reading(msgspec.Struct, frozen=True, kw_only=True):
    """A case that can run on this server, with the data of the case that the server needs."""

    name: str
    title: str
    ranks: int
    threads: int
    profile: str
    """Profile of a batch system that the case names; empty for the default profile of the site."""
    wall_time: float | None
    estimate: dict[str, int | float]
    resolved: bytes
    """Content of the file case.resolved.json."""
    case: bytes
    """The case with every default, as JSON."""
    doubts: list[Problem]
    files: list[FileName] = []
    survey: bytes = b""
    """Survey of the mesh files as JSON; empty if none was made."""


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """Answer of the reading program: the case, or every problem of the case. ``crash``: traceback of an unexpected
    exception in the program.
    """

    reading: Reading | None = None
    problems: list[Problem] = []
    files: list[FileName] = []
    """Files that a case with problems names, as far as the files could be read; ``sha256`` may be empty."""
    crash: str = ""


def read(question: Question) -> Answer:
    """Reads, checks and estimates a case."""
    try:
        return Answer(reading=_read(question))
    except CaseError as error:
        return Answer(problems=list(error.problems), files=_named(question))
    except MemoryError:
        raise
    except Exception:
        return Answer(crash=traceback.format_exc())


def _read(question: Question) -> Reading:
    text = _text(question.body)
    data = json_data(text) if question.json else toml_data(text)
    case = parse_case(data)
    if problems := limits.check(case, question.limits):
        raise CaseError(problems)
    files = _files(case)
    known = not files or question.survey is not None
    case, needs, odd = _weighed(case, data, question) if known else (case, {}, [])
    return Reading(
        name=case.name, title=case.title, ranks=case.run.ranks, threads=case.run.threads, profile=case.run.profile,
        wall_time=limits.wall_time(case, question.limits), estimate=needs,
        resolved=resolved_json(case), case=case.model_dump_json().encode(), doubts=odd, files=files,
        survey=question.survey or b"",
    )  # fmt: skip


def _files(case: Case) -> list[FileName]:
    return _names(case.model_dump(include={"parts"}))


def _named(question: Question) -> list[FileName]:
    """Returns the files that a case with problems names; empty if its text cannot be read."""
    try:
        text = _text(question.body)
        return _names(json_data(text) if question.json else toml_data(text))[:_MOST_FILES]
    except CaseError:
        return []


def _names(data: Mapping[str, Any]) -> list[FileName]:
    return [FileName(key=dotted(file.table), path=file.path, sha256=file.sha256 or "") for file in files_of(data)]


def _weighed(
    case: Case, data: Mapping[str, Any], question: Question
) -> tuple[Case, dict[str, int | float], list[Problem]]:
    """Returns the case with its number of threads, the resources that it needs, and its warnings. Raises CaseError if
    the case cannot be run on this server.
    """
    survey = from_json(question.survey) if question.survey else Survey()
    if survey.refused:
        raise CaseError(Problem("", "", line) for line in survey.refused)
    expected = _estimate(case, question, survey)
    case = limits.on_threads(case, expected.elements, question.limits)
    if expected.clock is not None:
        expected = replace(expected, clock=clock_time(case, expected.costs, expected.breaking))
    # Contact between parts is searched only if the case has mesh files: for other shapes the search takes seconds.
    unread = [problem((file.key, "path"), file.path, _UNREAD) for file in _files(case) if question.survey == b""]
    odd = [*unread, *bare_numbers(data), *warned(case, expected, survey, survey.touching)]
    return case, limits.figures(expected), odd


def _estimate(case: Case, question: Question, survey: Survey) -> Estimate:
    try:
        expected = estimate(case, Path(question.folder) if question.folder else None, survey)
    except (ArithmeticError, ValueError):
        raise CaseError([Problem("parts", "", "the elements are too many or too small to be counted")]) from None
    if problems := limits.check_size(expected, question.limits):
        raise CaseError(problems)
    return expected


def _text(body: bytes) -> str:
    try:
        return body.decode()
    except UnicodeDecodeError as error:
        raise CaseError([Problem("", "", f"the body is not UTF-8 text (at byte {error.start})")]) from None


# The process ----------------------------------------------------------------------------------------------------------


def main() -> int:
    """Answers requests to read a case until standard input ends. The program first sends one byte when it is ready."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICE)
    _warm()
    with socket.socket(fileno=sys.stdin.fileno()) as control:
        control.send(b"r")
        while _next(control):
            pass
    return 0


def _next(control: socket.socket) -> bool:
    """Answers one case; returns False at the end of standard input. If no process can be forked, the answer is
    empty.
    """
    message, descriptors, _, _ = socket.recv_fds(control, 1, 1)
    for descriptor in descriptors:
        with socket.socket(fileno=descriptor) as connection, suppress(OSError):
            if os.fork() == 0:
                _child(connection)
    return bool(message)


def _warm() -> None:
    """Reads a shipped case, so that each forked process already has the objects that the first case creates
    (validators, materials).
    """
    none = Limits(slots=1 << 20, elements=None, steps=None, memory=None, core_seconds=None, wall_time=None)
    answer = read(Question(body=shipped_path(_SHIPPED).read_bytes(), json=False, limits=none))
    assert answer.reading is not None, answer


def _child(connection: socket.socket) -> None:
    """Answers one case and then exits without the clean-up of the interpreter, which only the parent process may do."""
    code = 1
    try:
        _limit()
        connection.sendall(os.getpid().to_bytes(PID))
        question = msgspec.msgpack.decode(_received(connection), type=Question)
        connection.sendall(msgspec.msgpack.encode(read(question)))
        code = 0
    finally:
        os._exit(code)


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU, CPU))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(WALL)


def _received(connection: socket.socket) -> bytes:
    chunks: list[Any] = []
    while chunk := connection.recv(1 << 16):
        chunks.append(chunk)
    return b"".join(chunks)


if __name__ == "__main__":
    sys.exit(main())
