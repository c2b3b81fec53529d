"""What the routes work with, wired once in ``app``."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from .bell import Bell
from .cards import Cards
from .crowd import Crowd
from .download import Downloads
from .farewells import Farewells
from .history import Histories
from .keeper import Keeper
from .lanes import Lanes
from .present import Present
from .readiness import Readiness
from .receiving import Receiver
from .sent import SentFiles
from .settings import Settings
from .store import Store
from .submission import Desk
from .supervisor import Supervisor
from .sweeps import Sweeps
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
