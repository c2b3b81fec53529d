"""Makes the parts of the server and the FastAPI application."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager

from fastapi import Depends, FastAPI
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from . import errors
from .answers import openapi, page
from .answers.cards import Cards
from .answers.download import Downloads
from .answers.history import Histories
from .answers.metrics import Metrics, Timed
from .answers.reports import Reporters
from .database import identity
from .database.store import Store
from .intake import reader
from .intake.receiving import Receiver
from .intake.searches import Searches
from .intake.submission import Desk
from .intake.sweeps import Sweeps
from .intake.uploads import Uploads
from .keeping.removal import Removal, restore
from .keeping.removed_runs import RemovedRuns
from .launch import Launcher
from .launch.local import LocalLauncher
from .launch.slurm import SlurmLauncher
from .readiness import Readiness
from .requests import connections, limits
from .requests.admission import Admission
from .requests.head_requests import HeadRequests
from .requests.thread_pool import ThreadPool
from .requests.user_limits import UserLimits
from .routes import (
    cases,
    events,
    files,
    health,
    history,
    logs,
    materials,
    me,
    reports,
    runs,
    snapshots,
    table,
    uploads,
)
from .routes import sweeps as sweep_routes
from .runs.existing import ExistingRuns
from .runs.supervisor import Supervisor
from .runs.wakeup import Wakeups
from .service import Service
from .settings import Settings
from .telemetry import Telemetry

ROUTERS = (
    cases.router,
    materials.router,
    runs.router,
    table.router,
    events.router,
    history.router,
    snapshots.router,
    sweep_routes.router,
    logs.router,
    files.router,
    reports.router,
    uploads.router,
    me.router,
    health.router,
)
_SAFE_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'; "
        "form-action 'none'"
    ),
}


@contextmanager
def opened(settings: Settings) -> Iterator[Service]:
    """Opens the parts of a server, each after the parts that it uses; closes the parts in reverse order. Workers
    continue after the server has been closed. Raises StoreError, IdentityError, TelemetryError or OSError.
    """
    settings.runs.mkdir(0o700, parents=True, exist_ok=True)
    with ExitStack() as stack:
        store = Store(settings.database_url)
        stack.callback(store.close)
        identity.require(settings.runs, store)
        telemetry = None
        if settings.zenoh_port is not None:
            tokens = store.tokens() if settings.auth else None
            telemetry = Telemetry(settings.runs, settings.host, settings.zenoh_port, tokens, settings.site.slurm)
            stack.callback(telemetry.close)
        wakeups = Wakeups()
        removed_runs = RemovedRuns(settings.runs)
        restore(store, removed_runs)
        supervisor = Supervisor(settings, store, launcher_of(settings), telemetry, wakeups.ring)
        uploads = Uploads(settings.runs, settings.site.files, settings.caps.free_disk)
        desk = Desk(settings, store, supervisor, uploads)
        sweeps = Sweeps(settings, desk)
        supervisor.held_back = sweeps.held
        supervisor.start()
        sweeps.complete()
        stack.callback(supervisor.close)
        if settings.end_runs:
            stack.callback(supervisor.end_all)
        removal = Removal(settings, store, removed_runs, lambda run_id: supervisor.current(run_id) is not None, uploads)
        removal.needed = sweeps.needed
        desk.kept = removal.kept
        if (most := settings.site.quota.output_bytes) is not None:
            uploads.left = lambda owner: most - removal.kept(owner)
        removal.start()
        stack.callback(removal.close)
        http = settings.site.http
        pool = ThreadPool(http.threads, http.waiting, http.seconds)
        yield Service(
            settings=settings,
            store=store,
            wakeups=wakeups,
            telemetry=telemetry,
            supervisor=supervisor,
            desk=desk,
            histories=Histories(),
            cards=Cards(settings.runs, store),
            readiness=Readiness(settings, store),
            user_limits=UserLimits(http, connections.raise_limit()),
            downloads=Downloads(pool),
            pool=pool,
            readers=reader.pool(reader.CASE),
            surveyors=reader.surveyors(),
            sweepers=reader.pool(reader.SWEEP),
            reporters=Reporters(),
            sweeps=sweeps,
            searches=Searches(sweeps.plans, store),
            uploads=uploads,
            receiver=Receiver(uploads, pool),
            removal=removal,
            removed_runs=removed_runs,
            existing=ExistingRuns(settings.runs),
        )


def launcher_of(settings: Settings) -> Launcher:
    """Returns the launcher that the settings of the site select."""
    site = settings.site
    return SlurmLauncher(settings, site.slurm) if site.launcher == "slurm" and site.slurm else LocalLauncher(settings)


def build_app(service: Service) -> FastAPI:
    """Returns the FastAPI application for a server whose parts are open."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.wakeups.attach(asyncio.get_running_loop())
        yield
        service.wakeups.close()

    app = FastAPI(
        title="Conoid",
        description="Impact simulations as a service.",
        version="1",
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=lifespan,
        dependencies=[Depends(limits.check_query)],
    )
    app.state.service, app.state.routers = service, ROUTERS
    errors.install(app)
    openapi.install(app)
    app.state.metrics = Metrics(service)
    app.add_middleware(Admission, service=service)
    app.add_middleware(HeadRequests)
    app.add_middleware(_SafeHeaders)
    app.add_middleware(Timed, metrics=app.state.metrics)
    for router in ROUTERS:
        app.include_router(router)
    app.state.page_problem = None
    if service.settings.web is not None:
        app.state.page_problem = page.install(app, service.settings.web, auth=service.settings.auth)
    return app


class _SafeHeaders:
    """Middleware that adds security headers to every answer."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_safely(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _SAFE_HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_safely)
