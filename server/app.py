"""Builds the application out of the parts of the server."""

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
from .database import identity
from .database.store import Store
from .intake import reader
from .intake.receiving import Receiver
from .intake.sent import SentFiles
from .intake.submission import Desk
from .intake.sweeps import Sweeps
from .keeping import keeper
from .keeping.farewells import Farewells
from .keeping.keeper import Keeper
from .launch import Launcher
from .launch.local import LocalLauncher
from .launch.slurm import SlurmLauncher
from .readiness import Readiness
from .requests import connections, limits
from .requests.crowd import Crowd
from .requests.door import Door
from .requests.heads import Heads
from .requests.lanes import Lanes
from .routes import cases, events, files, health, history, logs, me, runs, sent, snapshots, table
from .routes import sweeps as sweep_routes
from .runs.bell import Bell
from .runs.present import Present
from .runs.supervisor import Supervisor
from .service import Service
from .settings import Settings
from .telemetry import Telemetry

ROUTERS = (
    cases.router,
    runs.router,
    table.router,
    events.router,
    history.router,
    snapshots.router,
    sweep_routes.router,
    logs.router,
    files.router,
    sent.router,
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
    """Opens the parts of a server in order of dependence, the supervisor last, and closes them in reverse order;
    workers go on. Raises StoreError, IdentityError, TelemetryError, OSError.
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
        bell = Bell()
        lines = Farewells(settings.runs)
        keeper.restore(store, lines)
        supervisor = Supervisor(settings, store, launcher_of(settings), telemetry, bell.ring)
        files_sent = SentFiles(settings.runs, settings.site.files, settings.caps.free_disk)
        desk = Desk(settings, store, supervisor, files_sent)
        sweeps = Sweeps(settings, desk)
        supervisor.held_back = sweeps.held
        supervisor.start()
        sweeps.complete()
        stack.callback(supervisor.close)
        if settings.end_runs:
            stack.callback(supervisor.end_all)
        watchman = Keeper(settings, store, lines, lambda run_id: supervisor.current(run_id) is not None, files_sent)
        watchman.needed = sweeps.needed
        desk.kept = watchman.kept
        if (most := settings.site.quota.output_bytes) is not None:
            files_sent.left = lambda owner: most - watchman.kept(owner)
        watchman.start()
        stack.callback(watchman.close)
        http = settings.site.http
        lanes = Lanes(http.threads, http.waiting, http.seconds)
        yield Service(
            settings=settings,
            store=store,
            bell=bell,
            telemetry=telemetry,
            supervisor=supervisor,
            desk=desk,
            histories=Histories(),
            cards=Cards(settings.runs, store),
            readiness=Readiness(settings, store),
            crowd=Crowd(http, connections.raise_limit()),
            downloads=Downloads(lanes),
            lanes=lanes,
            readers=reader.lanes(reader.CASE),
            surveyors=reader.surveyors(),
            sweepers=reader.lanes(reader.SWEEP),
            sweeps=sweeps,
            sent=files_sent,
            receiver=Receiver(files_sent, lanes),
            keeper=watchman,
            farewells=lines,
            present=Present(settings.runs),
        )


def launcher_of(settings: Settings) -> Launcher:
    """The launcher that the settings file of the site names."""
    site = settings.site
    return SlurmLauncher(settings, site.slurm) if site.launcher == "slurm" and site.slurm else LocalLauncher(settings)


def build_app(service: Service) -> FastAPI:
    """The FastAPI application over open parts."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.bell.attach(asyncio.get_running_loop())
        yield
        service.bell.close()

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
    app.add_middleware(Door, service=service)
    app.add_middleware(Heads)
    app.add_middleware(_SafeHeaders)
    app.add_middleware(Timed, metrics=app.state.metrics)
    for router in ROUTERS:
        app.include_router(router)
    app.state.page_problem = None
    if service.settings.web is not None:
        app.state.page_problem = page.install(app, service.settings.web, auth=service.settings.auth)
    return app


class _SafeHeaders:
    """Middleware that adds security headers to every answer; streams pass through unchanged."""

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
