"""The server as a process: one process for each folder of runs. The server writes its address to server.json, and ends
cleanly after SIGTERM.
"""

import asyncio
import json
import logging
import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import uvicorn

from . import durable, heap
from .alone import only_one
from .app import build_app, opened
from .requests import connections, log_filter
from .service import Service
from .settings import Settings, StartError

_log = logging.getLogger("conoid.server")
ADDRESS_FILE = "server.json"
_AGAIN = 5.0
"""Time in s after which the server tries again to write its address (chosen value)."""
_SWITCH = 0.001
"""Time in s after which a computing thread must let another thread run (chosen value); a fifth of the default of
Python. The event loop waits this long for each computing thread, several times in an answer."""
_FAREWELL = 3
"""Largest time in s to wait for open requests when the server stops."""


class ServeError(StartError):
    """Error: the server cannot start. The text of this error is one line."""


def serve(settings: Settings) -> None:
    """Runs the server until SIGTERM or SIGINT. Only the user of the server may read the files of the server and of its
    workers. Raises ServeError, and the errors of the function ``opened``.
    """
    os.umask(0o077)
    sys.setswitchinterval(_SWITCH)
    heap.share()
    log_filter.install()
    settings.runs.mkdir(parents=True, exist_ok=True)
    with only_one(settings.runs), _listening(settings) as listener:
        (settings.runs / ADDRESS_FILE).unlink(missing_ok=True)
        _answer(settings, listener)


def _answer(settings: Settings, listener: socket.socket) -> None:
    with opened(settings) as service:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, _leave)
        try:
            _Server(service).run(sockets=[listener])
        finally:
            (settings.runs / ADDRESS_FILE).unlink(missing_ok=True)


class _Server(uvicorn.Server):
    """HTTP server that writes the address of the server once it answers, and that ends open streams before it waits for
    open requests. If the disk is full, the server works without server.json, so that runs can be read and removed, and
    writes the file when there is space again.
    """

    def __init__(self, service: Service) -> None:
        self._service = service
        self._app = build_app(service)
        self._writing: asyncio.Task[None] | None = None
        self._why = ""
        super().__init__(
            uvicorn.Config(
                self._app,
                log_config=None,
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_keep_alive=30,
                timeout_graceful_shutdown=_FAREWELL,
                **connections.options(),
            )
        )

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if sockets and self.started:
            connections.queue(sockets[0])
            address = announce(self._service, sockets[0], self._app.state.page_problem)
            self._writing = asyncio.create_task(self._write(address))

    async def _write(self, address: bytes) -> None:
        path = self._service.settings.runs / ADDRESS_FILE
        while True:
            try:
                return durable.write(path, address)
            except OSError as error:
                _log.error("%s: not written, and tried again in %g s: %s", path, _AGAIN, error.strerror)
            await asyncio.sleep(_AGAIN)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Stores the signal for which the server ends."""
        self._why = signal.Signals(sig).name
        super().handle_exit(sig, frame)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        left = "are cancelled" if self._service.settings.end_runs else "go on"
        _log.info("the server ends: %s; its runs %s", self._why or "no signal", left)
        self._service.wakeups.close()
        if self._writing is not None:
            self._writing.cancel()
        await super().shutdown(sockets)


def announce(service: Service, listener: socket.socket, page_problem: str | None) -> bytes:
    """Prints a line about the server and, if there is a page, the address of the page. ``page_problem``: why the page
    lacks its libraries; None: there is no page. Returns the content of the file server.json.
    """
    host, port = listener.getsockname()[:2]
    url = f"http://{f'[{host}]' if ':' in host else host}:{port}"
    endpoint = service.telemetry.local_endpoint if service.telemetry else None
    address = {"url": url, "zenoh": endpoint, "pid": os.getpid(), "auth": service.settings.auth}
    slots = service.settings.slots
    print(
        f"conoid.server: {url}  zenoh {endpoint or 'off'}  {slots} slots  runs in {service.settings.runs}", flush=True
    )
    if page_problem:
        print(f"conoid.server: the page is without charts and 3-D: {page_problem}", flush=True)
    if page_problem is not None:
        print(f"open {url}", flush=True)
    return json.dumps(address, indent=2).encode() + b"\n"


def _leave(_signal: int, _frame: FrameType | None) -> None:
    """Ends the process with code 0 after uvicorn has raised its signal again."""
    raise SystemExit(0)


@contextmanager
def _listening(settings: Settings) -> Iterator[socket.socket]:
    """Opens the socket with TCP as its explicit protocol; otherwise asyncio does not switch off Nagle's algorithm,
    which delays an answer by 40 ms.
    """
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((settings.host, settings.port))
        except OSError as error:
            raise ServeError(f"--host {settings.host} --port {settings.port}: {error.strerror}") from None
        yield listener
