"""Parts of a running server, as the routes use them; ``app`` creates them."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from .answers.cards import Cards
from .answers.download import Downloads
from .answers.history import Histories
from .database.store import Store
from .intake.receiving import Receiver
from .intake.searches import Searches
from .intake.submission import Desk
from .intake.sweeps import Sweeps
from .intake.uploads import Uploads
from .keeping.removal import Removal
from .keeping.removed_runs import RemovedRuns
from .readiness import Readiness
from .requests.thread_pool import ThreadPool
from .requests.user_limits import UserLimits
from .runs.existing import ExistingRuns
from .runs.supervisor import Supervisor
from .runs.wakeup import Wakeups
from .settings import Settings
from .telemetry import Telemetry


@dataclass(frozen=True)
class Service:
    """The parts of a running server."""

    settings: Settings
    store: Store
    wakeups: Wakeups
    telemetry: Telemetry | None
    supervisor: Supervisor
    desk: Desk
    histories: Histories
    cards: Cards
    readiness: Readiness
    user_limits: UserLimits
    downloads: Downloads
    pool: ThreadPool
    """Threads for the disk and the database."""
    readers: ThreadPool
    """Threads that wait for the reading of cases."""
    surveyors: ThreadPool
    """Threads for cases that may name files, whose reading takes seconds, and for restarts, whose case may."""
    sweepers: ThreadPool
    """Threads for sweeps, whose reading takes seconds: submissions of runs do not wait for these."""
    reporters: ThreadPool
    """Threads for reports of runs, which take minutes."""
    sweeps: Sweeps
    searches: Searches
    uploads: Uploads
    receiver: Receiver
    removal: Removal
    removed_runs: RemovedRuns
    existing: ExistingRuns


def _service(request: Request) -> Service:
    service: Service = request.app.state.service
    return service


ServiceOf = Annotated[Service, Depends(_service)]
