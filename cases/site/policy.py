"""Settings of a site: the order of runs in the queue, quotas of users, limits of a run, retention of runs and files,
limits of HTTP requests.

Example of the tables of a site's settings file::

    [queue]
    half_life = "168 h"               # after it the past usage of a user counts half
    memory = 64_000_000_000           # bytes for all runs together
    threads = 4                       # of each rank, if a case does not give run.threads
    [queue.users.ann]
    share = 2.0                       # share relative to other users; their default is 1
    priority = 1                      # before all users with a lower one
    [quota]                           # of each user
    queued = 1000
    running = 20
    core_seconds = 1e6
    output_bytes = 1_000_000_000_000
    [caps]                            # of each run
    core_seconds = 1e5
    output_bytes = 100_000_000_000
    [retention]                       # of runs that have ended
    age = "2160 h"
    bytes = 4_000_000_000_000
    [files]                           # that a user uploads with cases
    size = 4_000_000_000
    bytes = 20_000_000_000
    number = 1000
    age = "24 h"
    [http]                            # of each user, and of each address without a token
    requests = 16
    streams = 100
"""

import msgspec

from ..units import parse_quantity

PRIORITY = 100
"""Largest priority of a user; the smallest is its negative (chosen value)."""


class Share(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Settings of a site for one user."""

    share: float = 1.0
    """Fraction of the machine that the user gets, relative to other users with runs in the queue."""
    priority: int = 0
    """Priority of the user: runs of users with a higher priority start first."""


class Queue(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Settings of the queue of runs."""

    half_life: str = "168 h"
    """Time after which the past usage of a user counts half: a week (chosen value)."""
    memory: int | None = None
    """Memory for all concurrent runs, bytes. The server compares the estimated memory of the runs with this limit.
    Absent: the memory of the machine."""
    threads: int | None = None
    """Threads of each rank of a run whose case does not give ``run.threads``. Absent: the cores of the server divided
    by the number of ranks, at most one thread for each 3,000 tets; in a batch system one thread."""
    users: dict[str, Share] = {}

    @property
    def forgets(self) -> float:
        """Half-life of past usage, s."""
        return parse_quantity(self.half_life, "s")

    def of(self, owner: str) -> Share:
        """Returns the settings of this user."""
        return self.users.get(owner, Share())


class Quota(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Quota of a user. None: no limit."""

    queued: int | None = None
    """Largest number of runs of the user that have not ended; a further run is refused."""
    running: int | None = None
    """Largest number of concurrent runs of the user; further runs wait."""
    core_seconds: float | None = None
    """Largest usage of the user, core seconds, where past usage counts half after each half-life; while it is exceeded,
    the runs of the user wait."""
    output_bytes: int | None = None
    """Largest size of all run folders of the user, bytes; while it is exceeded, new runs are refused."""


class RunCaps(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Limits of each run. None: the default of the server."""

    elements: int | None = None
    steps: int | None = None
    memory: int | None = None
    core_seconds: float | None = None
    """Largest CPU time of a run, core seconds: estimated at submission, and measured during the run."""
    wall_time: float | None = None
    """Largest wall time of a run, s."""
    output_bytes: int | None = None
    """Largest size of the folder of a run, bytes. A run that exceeds it is stopped and keeps its results so far."""


class Retention(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Rules for removing runs that have ended. Runs with the label ``keep`` are never removed."""

    age: str = ""
    """Time since the end of a run after which it is removed; empty: never."""
    bytes: int | None = None
    """Largest size of all run folders together, bytes; the oldest runs are removed first. None: no limit."""
    every: str = "10 min"
    """Time between two checks of age and size. Reading the sizes of 10,000 folders takes seconds (reason of the chosen
    value)."""

    @property
    def oldest(self) -> float | None:
        """Time since its end after which a run is removed, s; None: never."""
        return parse_quantity(self.age, "s") if self.age else None

    @property
    def rest(self) -> float:
        """Time between two checks, s."""
        return parse_quantity(self.every, "s")


class Files(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Limits of the files that users upload for their cases."""

    size: int = 4 << 30
    """Largest size of one file, bytes: ten million tets as text (chosen value). A larger file is refused with the HTTP
    status 413."""
    bytes: int = 16 << 30
    """Largest size of all files of a user together, bytes, including uploads in progress (chosen value). Files beyond
    this limit are refused with the HTTP status 429."""
    number: int = 1000
    """Largest number of files of a user. Listing so many files takes some 10 ms (reason of the chosen value). Files
    beyond this limit are refused with the HTTP status 429."""
    age: str = "24 h"
    """Time after which a file that no run uses and no request has read is removed (chosen value). A case is normally
    submitted seconds after its files, and an interrupted upload can continue the next morning."""

    @property
    def oldest(self) -> float:
        """Time after which an unused file is removed, s."""
        return parse_quantity(self.age, "s")


class Http(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Limits of the concurrent requests of one user, and of one network address whose requests have no valid token."""

    requests: int = 16
    """Largest number of requests that are processed at once (chosen value). The bodies of these requests (at most 1 MiB
    each) and the answers are in memory."""
    waiting: int = 200
    """Largest number of further requests that wait (chosen value). Further requests are refused with the HTTP status
    429."""
    streams: int = 100
    """Largest number of long responses at once: event streams, logs that are followed, waits for a change, and
    downloads (chosen value). Further long responses are refused with the HTTP status 429."""
    threads: int = 2
    """Largest number of responses that are computed or wait for the disk at once (chosen value). The server is one
    Python process with 64 threads for all users."""
    patience: str = "20 s"
    """Time after which a request gets the HTTP status 503 because the disk or the database does not respond (chosen
    value)."""

    @property
    def seconds(self) -> float:
        """Time to wait for the disk or the database, s."""
        return parse_quantity(self.patience, "s")


def check(queue: Queue, quota: Quota, caps: RunCaps, retention: Retention, http: Http, files: Files) -> None:
    """Checks the settings of all tables. Raises ValueError with the key, the value, and the allowed values."""
    for key, text in (
        ("queue.half_life", queue.half_life), ("retention.every", retention.every), ("http.patience", http.patience),
        ("files.age", files.age),
    ):  # fmt: skip
        _time(key, text)
    for name in ("requests", "waiting", "streams", "threads"):
        _positive("http", name, getattr(http, name))
    for name in ("size", "bytes", "number"):
        _positive("files", name, getattr(files, name))
    if retention.age:
        _time("retention.age", retention.age)
    for name, user in queue.users.items():
        if not 0.0 < user.share <= 1e6:
            raise ValueError(f"queue.users.{name}.share = {user.share:g}: above 0, at most 1e6")
        if abs(user.priority) > PRIORITY:
            raise ValueError(f"queue.users.{name}.priority = {user.priority}: -{PRIORITY} to {PRIORITY}")
    _positive("queue", "memory", queue.memory)
    _positive("queue", "threads", queue.threads)
    _positive("retention", "bytes", retention.bytes)
    for table, values in (("quota", quota), ("caps", caps)):
        for name in values.__struct_fields__:
            _positive(table, name, getattr(values, name))


def _time(key: str, text: str) -> None:
    try:
        seconds = parse_quantity(text, "s")
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    if seconds <= 0.0:
        raise ValueError(f"{key} = {text!r}: above 0 s")


def _positive(table: str, name: str, value: float | None) -> None:
    if value is not None and not 0 < value < float("inf"):
        raise ValueError(f"{table}.{name} = {value}: above 0")
