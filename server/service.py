"""What the routes work with, wired once in ``app``."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from .answers.cards import Cards
from .answers.download import Downloads
from .answers.history import Histories
from .database.store import Store
from .intake.receiving import Receiver
from .intake.sent import SentFiles
from .intake.submission import Desk
from .intake.sweeps import Sweeps
from .keeping.farewells import Farewells
from .keeping.keeper import Keeper
from .readiness import Readiness
from .requests.crowd import Crowd
from .requests.lanes import Lanes
from .runs.bell import Bell
from .runs.present import Present
from .runs.supervisor import Supervisor
from .settings import Settings
from .telemetry import Telemetry


@dataclass(frozen=True)
class Service:
    """The parts of a server that is up."""

    settings: Settings
    store: Store
    bell: Bell
    telemetry: Telemetry | None
    supervisor: Supervisor
    desk: Desk
    histories: Histories
    cards: Cards
    readiness: Readiness
    crowd: Crowd
    downloads: Downloads
    lanes: Lanes
    """For the disk and the database."""
    readers: Lanes
    """For cases that are read."""
    surveyors: Lanes
    """For cases that may name files, which are read for seconds; and for restarts, whose case may."""
    sweepers: Lanes
    """For sweeps, each of which is read for seconds: nobody who hands in a run waits for them."""
    sweeps: Sweeps
    sent: SentFiles
    receiver: Receiver
    keeper: Keeper
    farewells: Farewells
    present: Present


def _service(request: Request) -> Service:
    service: Service = request.app.state.service
    return service


ServiceOf = Annotated[Service, Depends(_service)]
