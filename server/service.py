"""The parts of a running server that the routes use; the module ``app`` creates them."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from .answers.cards import Cards
from .answers.download import Downloads
from .answers.history import Histories
from .answers.reports import Reporters
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
    """Pool of threads for the disk and the database."""
    readers: ThreadPool
    """Pool of threads that wait while cases are read."""
    surveyors: ThreadPool
    """Pool of threads for cases that may name files, and for restarts. Reading a case with files takes seconds."""
    sweepers: ThreadPool
    """Pool of threads for sweeps, whose cases take seconds to read; submissions of single runs do not wait for these
    threads."""
    reporters: Reporters
    """Makes the reports of runs, which takes minutes."""
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
