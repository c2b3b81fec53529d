"""JSON schemas of runs: the answer to a submission, lists, and one run."""

import msgspec

from conoid.cases.messages import Progress
from conoid.cases.outcome import Outcome
from conoid.cases.run import Cause, State

from .cases import NamedFile


class Receipt(msgspec.Struct, kw_only=True):
    """Answer to a submission. The estimate has the fields elements, nodes, dt, steps, memory_bytes and core_seconds,
    and sometimes seconds, the wall time.
    """

    id: str
    owner: str
    name: str
    title: str
    state: State
    ranks: int
    threads: int
    submitted: float
    estimate: dict[str, float]
    files: list[NamedFile]
    """Files that the case names. The folder of the run has a copy of each file that the case names."""
    url: str


class RunLine(msgspec.Struct, kw_only=True):
    """A run in a list. Times are Unix times in s; the time of an event that has not happened is null."""

    id: str
    owner: str
    name: str
    title: str
    state: State
    cause: Cause | None
    message: str
    reason: str
    ranks: int
    threads: int
    submitted: float
    started: float | None
    finished: float | None
    labels: dict[str, str]
    url: str


class ListedRun(RunLine, kw_only=True):
    """A run in a list, with its short id."""

    short: str
    """Shortest prefix of the id that is unique among the runs of the owner."""


class RunStatus(RunLine, kw_only=True):
    """A run with its progress and, after its end, its outcome."""

    case_file: str
    estimate: dict[str, float]
    progress: Progress | None
    outcome: Outcome | None


class RunPage(msgspec.Struct, kw_only=True):
    """Runs, newest first, and the cursor of the next page; the cursor is null on the last page."""

    runs: list[ListedRun]
    next: str | None
