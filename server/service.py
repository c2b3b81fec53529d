"""What the routes work with, wired once in ``app``."""

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
    """The parts of a server that is up."""

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
    """For the disk and the database."""
    readers: ThreadPool
    """For cases that are read."""
    surveyors: ThreadPool
    """For cases that may name files, which are read for seconds; and for restarts, whose case may."""
    sweepers: ThreadPool
    """For sweeps, each of which is read for seconds: nobody who hands in a run waits for them."""
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
