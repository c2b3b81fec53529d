"""The shapes of the answers, for OpenAPI and for those who read it. The routes build what has these shapes."""

from typing import Annotated, Any

import msgspec

from conoid.cases.messages import Progress, Snapshot
from conoid.cases.outcome import Outcome
from conoid.cases.output.search import Search
from conoid.cases.run import Cause, State

MOST_POINTS = 1000
"""Of a sweep. Chosen: what is expanded in a second."""


class ProblemEntry(msgspec.Struct, kw_only=True):
    """One of the things that are wrong with a case."""

    key: str
    value: str
    message: str
    pointer: str


class Problem(msgspec.Struct, kw_only=True, omit_defaults=True):
    """RFC 9457: why a request was refused; ``detail`` is one line for people, ``code`` a word for programs."""

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
    """What is kept of a run that has been removed."""


class NamedFile(msgspec.Struct, kw_only=True):
    """A file that a case names: ``path`` is a name, ``sha256`` says which."""

    path: str
    sha256: str


class Receipt(msgspec.Struct, kw_only=True):
    """What a submitter is told; estimate: elements, nodes, dt, steps, memory_bytes, core_seconds, seconds by the clock
    where known.
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
    """That the case names: the run has its own copy of each."""
    url: str


class RunLine(msgspec.Struct, kw_only=True):
    """A run in a list; times are Unix s, null before they have come."""

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
    """A run among others."""

    short: str
    """The beginning of the id that no other run of the owner has."""


class RunStatus(RunLine, kw_only=True):
    """A run, how far it is, and how it has ended."""

    case_file: str
    estimate: dict[str, float]
    progress: Progress | None
    outcome: Outcome | None


class RunPage(msgspec.Struct, kw_only=True):
    """Runs, newest first, and the cursor of the following page; null on the last."""

    runs: list[ListedRun]
    next: str | None


class TableRow(ListedRun, kw_only=True):
    """A run in the table: where its case is among those that are alike, what it has otherwise, its results."""

    progress: Progress | None
    case: int | None
    values: dict[str, bool | int | float | str | None]
    results: list[float | None] | None
    references: int
    """Reference numbers that it was compared with."""
    missed: list[str]
    """Those that it misses."""


class Result(msgspec.Struct, kw_only=True):
    """What a number of a run is."""

    name: str
    unit: str


class AlikeCases(msgspec.Struct, kw_only=True):
    """Values by key that cases have in common, SI; units of those that have one; what their runs have as results."""

    values: dict[str, bool | int | float | str]
    units: dict[str, str]
    results: list[Result]


class Table(msgspec.Struct, kw_only=True):
    """Runs, newest first, and the cursor of the following page, null on the last; ``pending`` of them are not read."""

    runs: list[TableRow]
    cases: list[AlikeCases]
    pending: int
    next: str | None


class CaseFile(msgspec.Struct, kw_only=True):
    """A file that a case names, in the table ``key``; ``sha256`` is empty where the case has no hash of it."""

    key: str
    path: str
    sha256: str


class Validation(msgspec.Struct, kw_only=True):
    """Whether a case could be submitted; with warnings, estimate and every default where it could, and what its files
    hold (``survey``: by part, with loads, and bodies that touch).
    """

    valid: bool
    problems: list[ProblemEntry]
    warnings: list[ProblemEntry] = []
    estimate: dict[str, float] = {}
    case: dict[str, Any] = {}
    files: list[CaseFile] = []
    survey: dict[str, Any] = {}


class GalleryEntry(msgspec.Struct, kw_only=True):
    """A shipped case."""

    name: str
    title: str
    description: str
    url: str


class Gallery(msgspec.Struct, kw_only=True):
    """The shipped cases."""

    cases: list[GalleryEntry]


class EventPage(msgspec.Struct, kw_only=True):
    """Lines of the journal, the number to go on from, and whether there are more already."""

    events: list[dict[str, Any]]
    last: int
    more: bool


class FileEntry(msgspec.Struct, kw_only=True):
    """A file of a run; ``modified`` in Unix s."""

    path: str
    size: int
    modified: float
    url: str


class Files(msgspec.Struct, kw_only=True):
    """Every file of a run."""

    files: list[FileEntry]


class SentFile(msgspec.Struct, kw_only=True):
    """A file that a user has sent: ``offset`` of ``size`` bytes are there; it was last wanted at ``asked``, Unix s."""

    sha256: str
    size: int
    offset: int
    whole: bool
    asked: float
    url: str


class Uploads(msgspec.Struct, kw_only=True):
    """The files that a user has sent, and their bytes together."""

    files: list[SentFile]
    bytes: int


class Snapshots(msgspec.Struct, kw_only=True):
    """The snapshots that the journal tells of."""

    snapshots: list[Snapshot]


class FragmentCourse(msgspec.Struct, kw_only=True):
    """A fragment in the snapshots that have it: their numbers and times in s, its mass in kg, speed in m/s, longest
    side in m, tets."""

    n: list[int]
    t: list[float]
    mass: list[float]
    speed: list[float]
    size: list[float]
    tets: list[int]


class History(msgspec.Struct, kw_only=True):
    """The course of a run, thinned."""

    last: int
    state: str | None
    elapsed: float
    series: dict[str, Any]
    parts: dict[str, dict[str, list[float | None]]]
    """Energies of each part at the times of the series, J; empty where there is one part alone."""
    sizes: dict[str, Any]
    """Newest distribution of the sizes of fragments, as messages of counts and snapshots have it."""
    ranks: dict[str, Any]
    balance: list[dict[str, Any]]
    snapshots: list[dict[str, Any]]
    log: list[dict[str, Any]]
    """Messages of the log, of states and of checkpoints; of a long log its beginning and its end."""
    log_left_out: int
    """Messages between these two."""
    warnings: list[dict[str, Any]]
    """Warnings and errors of the whole log, each text once."""


class Report(msgspec.Struct, kw_only=True):
    """The report of a run, and where it is."""

    path: str
    size: int
    url: str


class Wish(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A sweep that is handed in: a case as plain data, the changes of each point by key, runs at a time."""

    case: dict[str, Any]
    points: Annotated[list[dict[str, Any]], msgspec.Meta(min_length=1, max_length=MOST_POINTS)]
    at_once: Annotated[int, msgspec.Meta(ge=1)] | None = None


class SweepLine(msgspec.Struct, kw_only=True):
    """A sweep in a list: how many of its runs are in each state, and how many have been removed."""

    id: str
    owner: str
    name: str
    submitted: float
    at_once: int | None
    total: int
    states: dict[str, int]
    removed: int
    url: str
    search: Search | None
    """The last report of an adaptive sweep."""
    reported: float | None
    """When it came, Unix s."""


class Reported(msgspec.Struct, kw_only=True):
    """What the client of an adaptive sweep is told: the sweep, and whether it is to hand in no further point."""

    id: str
    url: str
    stop: bool


class SweepPage(msgspec.Struct, kw_only=True):
    """Own sweeps, newest first, and the ``before`` of the following page; null on the last."""

    sweeps: list[SweepLine]
    next: str | None


class SweepPoint(msgspec.Struct, kw_only=True):
    """What was changed at a point, and its run."""

    values: dict[str, Any]
    run: ListedRun


class Sweep(SweepLine, kw_only=True):
    """A sweep with its points."""

    points: list[SweepPoint]


class ZenohAccess(msgspec.Struct, kw_only=True):
    """How to subscribe."""

    endpoint: str
    prefix: str
    user: str | None
    password: str | None


class Slots(msgspec.Struct, kw_only=True):
    """Ranks that may run at a time, and that run now."""

    total: int
    used: int


class Me(msgspec.Struct, kw_only=True):
    """Who asks, what the token allows, and what the server has."""

    owner: str
    scopes: list[str]
    zenoh: ZenohAccess | None
    slots: Slots
    limits: dict[str, float | None]
    quota: dict[str, float | None]
    used: dict[str, float]


class Health(msgspec.Struct, kw_only=True):
    """Whether the server, or each thing that it needs, works."""

    status: str
    checks: dict[str, bool] = {}


ALL = (
    Problem, Receipt, RunPage, RunStatus, Table, Validation, Gallery, EventPage, Files, SentFile, Uploads,
    Snapshots, FragmentCourse, History, Me, Health, Wish, Report,
    SweepPage, Sweep, Search, Reported,
)  # fmt: skip
