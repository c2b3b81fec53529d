"""Sweeps as they are kept: a plain file each, ``<runs>/sweeps/<id>.json``, and all of them in memory."""

from collections.abc import Iterator
from typing import Any

import msgspec

from conoid.cases.output.search import Search
from conoid.cases.reading import whole

from .. import durable
from ..errors import ServiceError
from ..settings import Settings

FOLDER = "sweeps"


class Plan(msgspec.Struct, kw_only=True, frozen=True):
    """A sweep as it is kept; ``runs`` is empty until all of them are accepted. ``submitted`` in Unix s."""

    id: str
    owner: str
    name: str
    submitted: float
    key: str | None
    digest: str
    at_once: int | None
    """Runs of the sweep that run at a time; None: as many as there are slots."""
    points: list[dict[str, Any]]
    runs: list[str] = []
    case: dict[str, Any] | None = None
    """What is changed at each point, until all runs are accepted."""
    tries: list[int] = []
    """How often each point was run again; empty: none was."""
    repeated: list[int] = []
    """Points that are run again, until all of these runs are accepted; ``earlier`` has the runs of before."""
    earlier: list[str] = []
    search: Search | None = None
    """Of an adaptive sweep, whose client decides the points: its last report."""
    reported: float = 0.0
    """When that was, Unix s."""
    cancelled: float = 0.0
    """The command (``began``) whose runs were cancelled here: it is to make no more of them."""

    @property
    def whole(self) -> bool:
        """Whether all of its runs are accepted."""
        return len(self.runs) == len(self.points) and not self.repeated

    @property
    def keys(self) -> list[str]:
        """The idempotency keys of its runs."""
        tries = self.tries or [0] * len(self.points)
        return [f"sweep-{self.id}-{n}" + (f"-{again}" if again else "") for n, again in enumerate(tries)]

    @property
    def wanted(self) -> list[int]:
        """The points that get a run when it is filled."""
        return self.repeated or list(range(len(self.points)))


class Plans:
    """All sweeps of a server. May be used from any thread; two changes of one sweep are kept apart by the caller."""

    def __init__(self, settings: Settings) -> None:
        """Reads what is there; a file that cannot be read is left alone."""
        self._folder = settings.runs / FOLDER
        self._all: dict[str, Plan] = {}
        for path in sorted(self._folder.glob("*.json")):
            try:
                self.put(msgspec.json.decode(whole.read(path), type=Plan))
            except (OSError, msgspec.MsgspecError):
                continue

    def __iter__(self) -> Iterator[Plan]:
        """Those that are there now."""
        return iter(tuple(self._all.values()))

    def get(self, sweep_id: str) -> Plan | None:
        """The sweep, whoever owns it."""
        return self._all.get(sweep_id)

    def of(self, owner: str) -> list[Plan]:
        """The sweeps of an owner, newest first."""
        return sorted((plan for plan in self if plan.owner == owner), key=lambda plan: plan.id, reverse=True)

    def put(self, plan: Plan) -> None:
        """In memory alone."""
        self._all[plan.id] = plan

    def write(self, plan: Plan) -> None:
        """On disk and in memory. Raises ServiceError 507."""
        try:
            self._folder.mkdir(0o700, exist_ok=True)
            durable.write(self._folder / f"{plan.id}.json", msgspec.json.encode(plan))
        except OSError as error:
            raise ServiceError(507, "storage", f"the sweep cannot be kept: {error.strerror}", retryable=True) from error
        self.put(plan)

    def remove(self, plan: Plan) -> None:
        """From memory and disk. Raises OSError."""
        self._all.pop(plan.id, None)
        (self._folder / f"{plan.id}.json").unlink(missing_ok=True)
