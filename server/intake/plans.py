"""The stored sweeps (a sweep: one case at several points, each with changed values). Each sweep is a plain file
``<runs>/sweeps/<id>.json``. The server also keeps all sweeps in memory.
"""

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
    """A stored sweep. The field ``runs`` is empty until all runs are accepted; ``submitted`` is a Unix time in s."""

    id: str
    owner: str
    name: str
    submitted: float
    key: str | None
    digest: str
    at_once: int | None
    """Largest number of runs of the sweep that run at the same time; None: only the cores of the server limit it."""
    points: list[dict[str, Any]]
    runs: list[str] = []
    case: dict[str, Any] | None = None
    """The case of the sweep, until all runs are accepted."""
    tries: list[int] = []
    """Number of repetitions of each point; empty if no point was repeated."""
    repeated: list[int] = []
    """Points that are being repeated, until all new runs are accepted; ``earlier`` has their previous runs."""
    earlier: list[str] = []
    search: Search | None = None
    """Last report of an adaptive sweep, whose client chooses the points."""
    reported: float = 0.0
    """Unix time of the last report of an adaptive sweep, s."""
    cancelled: float = 0.0
    """Start time ``began`` of the client command whose adaptive sweep was cancelled on the server, Unix time, s. The
    command with this start time must submit no more runs."""

    @property
    def whole(self) -> bool:
        """Whether all runs of the sweep are accepted."""
        return len(self.runs) == len(self.points) and not self.repeated

    @property
    def keys(self) -> list[str]:
        """Returns the idempotency keys of the runs of the sweep."""
        tries = self.tries or [0] * len(self.points)
        return [f"sweep-{self.id}-{n}" + (f"-{again}" if again else "") for n, again in enumerate(tries)]

    @property
    def wanted(self) -> list[int]:
        """Returns the indices of the points for which runs must be accepted."""
        return self.repeated or list(range(len(self.points)))


class Plans:
    """All sweeps of a server. All methods of this class may be called from any thread. Only one thread at a time may
    change a sweep; the caller ensures this.
    """

    def __init__(self, settings: Settings) -> None:
        """Reads the stored sweeps; ignores a file that cannot be read."""
        self._folder = settings.runs / FOLDER
        self._all: dict[str, Plan] = {}
        for path in sorted(self._folder.glob("*.json")):
            try:
                self.put(msgspec.json.decode(whole.read(path), type=Plan))
            except (OSError, msgspec.MsgspecError):
                continue

    def __iter__(self) -> Iterator[Plan]:
        """Returns all sweeps."""
        return iter(tuple(self._all.values()))

    def get(self, sweep_id: str) -> Plan | None:
        """Returns a sweep by its id, for any owner."""
        return self._all.get(sweep_id)

    def of(self, owner: str) -> list[Plan]:
        """Returns the sweeps of an owner, newest first."""
        return sorted((plan for plan in self if plan.owner == owner), key=lambda plan: plan.id, reverse=True)

    def put(self, plan: Plan) -> None:
        """Adds a sweep to memory only, not to the disk."""
        self._all[plan.id] = plan

    def write(self, plan: Plan) -> None:
        """Writes a sweep to disk and memory. Raises ServiceError with status 507 if the disk is full."""
        try:
            self._folder.mkdir(0o700, exist_ok=True)
            durable.write(self._folder / f"{plan.id}.json", msgspec.json.encode(plan))
        except OSError as error:
            raise ServiceError(507, "storage", f"the sweep is not stored: {error.strerror}", retryable=True) from error
        self.put(plan)

    def remove(self, plan: Plan) -> None:
        """Removes a sweep from memory and disk. Raises OSError if the file cannot be removed."""
        self._all.pop(plan.id, None)
        (self._folder / f"{plan.id}.json").unlink(missing_ok=True)
