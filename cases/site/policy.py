"""What a site decides about its queue, about what its users and their runs may take, and about how long runs are kept.

Tables of a site's settings file::

    [queue]
    half_life = "168 h"               # after which what a user has taken counts half
    memory = 64_000_000_000           # bytes that all runs may need together
    [queue.users.ann]
    share = 2.0                       # of what there is, against 1 of everybody else
    priority = 1                      # before everybody whose number is lower
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
    [files]                           # that a user sends beside his cases
    size = 4_000_000_000
    bytes = 20_000_000_000
    number = 1000
    age = "24 h"
    [http]                            # of each user, and of each address that sends no token
    requests = 16
    streams = 100
"""

import msgspec

from ..units import parse_quantity

PRIORITY = 100
"""Largest priority, and minus the smallest. Chosen."""


class Share(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What a site gives one user."""

    share: float = 1.0
    """How much of the machine, against those of other users."""
    priority: int = 0
    """Runs of users with a higher one come first."""


class Queue(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Whose turn it is."""

    half_life: str = "168 h"
    """After which what a user has taken counts half. Chosen: a week."""
    memory: int | None = None
    """Bytes that all runs may need together, by their estimates; not given: what the machine has."""
    users: dict[str, Share] = {}

    @property
    def forgets(self) -> float:
        """The half-life, s."""
        return parse_quantity(self.half_life, "s")

    def of(self, owner: str) -> Share:
        """What the site gives this user."""
        return self.users.get(owner, Share())


class Quota(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What one user may take; None: as much as there is."""

    queued: int | None = None
    """Runs that have not ended; beyond it the server takes no more."""
    running: int | None = None
    """Runs at a time; the others wait."""
    core_seconds: float | None = None
    """What was taken lately, each half-life counting half; beyond it runs wait."""
    output_bytes: int | None = None
    """Of all folders of the user's runs; beyond it the server takes no more."""


class RunCaps(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What one run may take; None: what the server has by itself."""

    elements: int | None = None
    steps: int | None = None
    memory: int | None = None
    core_seconds: float | None = None
    """By its estimate when it is handed in, and by the clock while it runs."""
    wall_time: float | None = None
    """s"""
    output_bytes: int | None = None
    """Of its folder; a run that goes beyond is stopped, with its results so far."""


class Retention(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How long runs that have ended are kept; those with the label ``keep`` are kept for good."""

    age: str = ""
    """Since the end; empty: for ever."""
    bytes: int | None = None
    """Of all folders together; the oldest go first. None: no limit."""
    every: str = "10 min"
    """Between two looks. Chosen: reading the sizes of 10,000 folders takes seconds."""

    @property
    def oldest(self) -> float | None:
        """The age, s."""
        return parse_quantity(self.age, "s") if self.age else None

    @property
    def rest(self) -> float:
        """s between two looks."""
        return parse_quantity(self.every, "s")


class Files(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What one user may send of files that his cases name."""

    size: int = 4 << 30
    """Bytes of one file; a larger one is refused with 413. Chosen: ten million tets as text."""
    bytes: int = 16 << 30
    """Of all of them, what is on its way included; beyond it 429. Chosen."""
    number: int = 1000
    """Of all of them; beyond it 429. Chosen: a look at so many takes some 10 ms."""
    age: str = "24 h"
    """For which a file is kept that no run has and that nobody asks for. Chosen: a case follows its files in seconds,
    and a transfer that broke off goes on the next morning."""

    @property
    def oldest(self) -> float:
        """The age, s."""
        return parse_quantity(self.age, "s")


class Http(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What one user may hold of the server at a time; so may an address whose requests have no valid token."""

    requests: int = 16
    """Requests in progress: with their bodies, of 1 MiB at most, and answers in memory. Chosen."""
    waiting: int = 200
    """Requests that wait for their turn; beyond it they are refused with 429. Chosen."""
    streams: int = 100
    """Event streams, followed logs, waits for a change and downloads; beyond it 429. Chosen."""
    threads: int = 2
    """Answers that are computed, or wait for the disk. Chosen: a server has 64 for all users, and one Python."""
    patience: str = "20 s"
    """After which a disk or a database that does not answer is answered with 503. Chosen."""

    @property
    def seconds(self) -> float:
        """The patience, s."""
        return parse_quantity(self.patience, "s")


def check(queue: Queue, quota: Quota, caps: RunCaps, retention: Retention, http: Http, files: Files) -> None:
    """Raises ValueError: the key, the value, what is allowed."""
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
