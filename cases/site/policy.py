"""Settings of a site: queue, quotas of users, limits of runs, retention of runs and files, limits of HTTP.

Tables of a site's settings file::

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
"""Largest priority; the smallest priority is its negative (chosen value)."""


class Share(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Settings of a site for one user."""

    share: float = 1.0
    """Share of the machine that the user gets, relative to other users."""
    priority: int = 0
    """Runs of users with a higher priority start first."""


class Queue(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Settings of the queue."""

    half_life: str = "168 h"
    """Half-life of the past usage of a user: a week (chosen value)."""
    memory: int | None = None
    """Memory for all runs together, bytes, compared with the estimates of the runs; absent: the memory of the
    machine."""
    threads: int | None = None
    """Threads of each rank of a run whose case does not give ``run.threads``; absent: all cores of the server divided
    by the number of ranks, at most one for 3,000 tets, and in a batch system one."""
    users: dict[str, Share] = {}

    @property
    def forgets(self) -> float:
        """The half-life of past usage, s."""
        return parse_quantity(self.half_life, "s")

    def of(self, owner: str) -> Share:
        """Returns the settings of this user."""
        return self.users.get(owner, Share())


class Quota(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Quota of a user; None: no limit."""

    queued: int | None = None
    """Largest number of runs that have not ended; further runs are refused."""
    running: int | None = None
    """Largest number of concurrent runs; further runs wait."""
    core_seconds: float | None = None
    """Largest recent usage, halved after each half-life; runs of a user with a larger usage wait."""
    output_bytes: int | None = None
    """Largest size of all folders of the user's runs; at a larger size further runs are refused."""


class RunCaps(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Limits of a run; None: the default limit of the server."""

    elements: int | None = None
    steps: int | None = None
    memory: int | None = None
    core_seconds: float | None = None
    """Core seconds of a run: estimated at submission, and measured during the run."""
    wall_time: float | None = None
    """Wall time of a run, s."""
    output_bytes: int | None = None
    """Size of the folder of a run; a larger run is stopped, and keeps its results so far."""


class Retention(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Retention of runs that have ended; runs with the label ``keep`` are kept without limit."""

    age: str = ""
    """Age since the end of the run; empty: no limit."""
    bytes: int | None = None
    """Size of all folders of runs together; the oldest runs are removed first. None: the size has no limit."""
    every: str = "10 min"
    """Time between two checks of age and size; reading the sizes of 10,000 folders takes seconds (reason of the chosen
    value)."""

    @property
    def oldest(self) -> float | None:
        """The age of runs in s."""
        return parse_quantity(self.age, "s") if self.age else None

    @property
    def rest(self) -> float:
        """Time between two checks, s."""
        return parse_quantity(self.every, "s")


class Files(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Limits of the files that a user uploads with cases."""

    size: int = 4 << 30
    """Largest size of one file in bytes: ten million tets as text (chosen value). A larger file is refused with HTTP
    status 413."""
    bytes: int = 16 << 30
    """Largest size in bytes of all files of a user, including uploads in progress (chosen value). Files above this size
    are refused with HTTP status 429."""
    number: int = 1000
    """Largest number of files of a user; a list of so many files takes some 10 ms (reason of the chosen value). Files
    above this number are refused with HTTP status 429."""
    age: str = "24 h"
    """Time for which a file without a run and without requests is kept (chosen value). A case follows its files within
    seconds, and an interrupted upload can continue the next morning."""

    @property
    def oldest(self) -> float:
        """The age of files in s."""
        return parse_quantity(self.age, "s")


class Http(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Limits of concurrent requests of one user; the limits also apply to a network address whose requests have no
    valid token.
    """

    requests: int = 16
    """Largest number of requests in progress (chosen value); their bodies, of 1 MiB at most, and their answers are in
    memory."""
    waiting: int = 200
    """Largest number of waiting requests (chosen value). Requests above this number are refused with HTTP status
    429."""
    streams: int = 100
    """Largest number of long answers: event streams, followed logs, waits for a change, and downloads (chosen value).
    Long answers above this number are refused with HTTP status 429."""
    threads: int = 2
    """Largest number of answers that are computed, or wait for the disk, at a time (chosen value). A server has 64
    threads for all users, and one Python process."""
    patience: str = "20 s"
    """Time after which a request is answered with HTTP status 503 because the disk or the database does not respond
    (chosen value)."""

    @property
    def seconds(self) -> float:
        """The patience with the disk and the database, s."""
        return parse_quantity(self.patience, "s")


def check(queue: Queue, quota: Quota, caps: RunCaps, retention: Retention, http: Http, files: Files) -> None:
    """Checks the settings. Raises ValueError with the key, the value, and the allowed values."""
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
