"""A server for the duration of one run: a process that is started, found by its server.json, and stopped afterwards."""

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

import msgspec

from conoid.cases.figures import duration
from conoid.cases.run import State

from ..errors import ClientError
from ..remote.session import Session

ADDRESS_FILE = "server.json"
LOG_FILE = "server.log"
OWNER = "local"
_START_SECONDS = 60.0
"""Time limit for the start of a server, s (chosen value: a start takes one or two seconds, and many times longer on a
busy machine)."""
_STOP_SECONDS = 15.0
"""Time, s, after which a server that does not end is killed. It is ``GRACE`` for the workers plus 5 s for the server
itself."""
GRACE = 10.0
"""Time, s, after which a cancelled worker that does not end is killed."""


class Address(msgspec.Struct, kw_only=True, frozen=True):
    """Content of the file server.json."""

    url: str
    pid: int


class LocalServer:
    """A server on free loopback ports with a token that only this process has; it is a context manager.

    The server runs inside the context and is stopped afterwards. The server is not in the process group of the
    terminal, so that Ctrl-C reaches only this process. On Linux the server ends when this process dies.
    """

    def __init__(self, runs: Path, slots: int) -> None:
        """``runs``: folder of the runs; ``slots``: number of cores that runs may use at the same time."""
        self.runs = runs.resolve()
        self.slots = slots
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        """Starts the server and waits until it answers. Raises ClientError with the last line of the server's log."""
        self.runs.mkdir(parents=True, exist_ok=True)
        self.token = _token(self.runs)
        options = ["--port", "0", "--zenoh-port", "0", "--slots", str(self.slots), "--grace", str(GRACE)]
        # Another server may use the folder and its log. This server writes a file of its own until it answers.
        self._log = self.runs / f".{LOG_FILE}.{os.getpid()}"
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [*_TETHERED, str(os.getpid()), "--runs", str(self.runs), *options], stdin=subprocess.DEVNULL,
                stdout=log, stderr=log, start_new_session=True, env=_environment(),
            )  # fmt: skip
        try:
            self.session = Session(self._await().url, self.token)
            self._log.replace(self.runs / LOG_FILE)
        except BaseException:
            self.stop()
            self._log.unlink(missing_ok=True)
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Cancels open runs and then stops the server, because workers would continue without a server."""
        with suppress(ClientError, TimeoutError):
            for run in self.session.runs([state.value for state in State if not state.final]):
                self.session.run(run.id).cancel()
                self.session.run(run.id).wait(2 * GRACE)
        self.session.close()
        self.stop()

    def _await(self) -> Address:
        assert self._process is not None
        deadline = time.monotonic() + _START_SECONDS
        while time.monotonic() < deadline:
            if self._process.poll() is not None:
                raise ClientError(f"the server did not start: {_last_line(self._log)}")
            address = _address(self.runs / ADDRESS_FILE)
            if address is not None and address.pid == self._process.pid:
                return address
            time.sleep(0.05)
        raise ClientError(f"the server did not start within {duration(_START_SECONDS)}: {_last_line(self._log)}")

    def stop(self) -> None:
        """Requests the server to end, and kills the server after a time limit."""
        if self._process is None or self._process.poll() is not None:
            return
        self._process.terminate()
        try:
            self._process.wait(_STOP_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(_STOP_SECONDS)


_SERVER = [sys.executable, "-P", "-m", "conoid.server"]
_TETHER = """
import ctypes, os, runpy, signal, sys
parent = int(sys.argv.pop(1))
if sys.platform == "linux":
    PR_SET_PDEATHSIG = 1
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:
        sys.exit(1)
runpy.run_module("conoid.server", run_name="__main__", alter_sys=True)
"""
_TETHERED = [sys.executable, "-P", "-c", _TETHER]
"""Command that starts the server. The kernel sends SIGTERM to the server when the process whose id is the first
argument dies."""


def _token(runs: Path) -> str:
    """Returns a new token for the server. Raises ClientError with the last line of the server's log."""
    command = [*_SERVER, "token", "add", OWNER, "--runs", str(runs)]
    try:
        made = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=_START_SECONDS,
            env=_environment(), check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise ClientError(f"the server did not start within {duration(_START_SECONDS)}") from None
    if made.returncode != 0 or not made.stdout.strip():
        lines = made.stderr.strip().splitlines()
        raise ClientError(
            f"the server did not start: {lines[-1] if lines else f'the command ended with code {made.returncode}'}"
        )
    return made.stdout.split()[-1]


def _environment() -> dict[str, str]:
    """Returns the environment without the database setting of a site, because a server for one run must not use the
    site's database.
    """
    return {name: value for name, value in os.environ.items() if name not in {"CONOID_DATABASE", "CONOID_RUNS"}}


def _address(path: Path) -> Address | None:
    try:
        return msgspec.json.decode(path.read_bytes(), type=Address)
    except (FileNotFoundError, msgspec.MsgspecError):
        return None


def _last_line(path: Path) -> str:
    lines = path.read_text(errors="replace").strip().splitlines() if path.is_file() else []
    return lines[-1] if lines else "it printed nothing"
