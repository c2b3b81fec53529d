"""Stand of a fault: a server with a folder of runs, a user, and a record of the work of the workers."""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx2

from conoid.cases.run import State
from conoid.server.database.store import Store
from conoid.server.launch import processes
from conoid.server.requests.tokens import create_token
from conoid.server.settings import Settings

from ..server.running import TOML, case_text

HERE = Path(__file__).parent
START = 180.0
"""Time in s within which a server must have started, or have printed the reason of the failed start."""
PATIENCE = 60.0
"""Time in s for which a user waits for an answer."""
UNPRIVILEGED = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
"""Prefix of a command with which root obeys the permissions of files like other users."""
FINAL = {state.value for state in State if state.final}
TOLERATED = {503, 507}
"""Statuses of server errors that name a temporary cause."""


@dataclass
class Stand:
    """A server with workers that compute no physics; ``root`` contains the record of the workers, the order files and
    the folder of runs."""

    root: Path
    options: Sequence[str] = ()
    before: Sequence[str] = ()
    """Prefix of the command that starts the server."""
    environment: Mapping[str, str] = field(default_factory=dict)
    slots: int = 5
    large: int = 2
    """Number of ranks of a run that must wait while four other runs use cores."""
    patience: float = 30.0
    """Time in s after the fault within which the state must be true."""
    profile: str = ""
    child: subprocess.Popen[bytes] | None = None
    http: httpx2.Client | None = None
    errors: list[str] = field(default_factory=list)
    """Answers with unexpected server errors such as 500; each text contains the id of the run."""

    @property
    def runs(self) -> Path:
        """Folder of the runs of the server."""
        return self.root / "runs"

    @property
    def order(self) -> Path:
        """Order file that makes operations of the server fail (``tests.drill.server``)."""
        return self.root / "order.json"

    @property
    def book(self) -> Path:
        """Record of the starts and ends of the workers."""
        return self.root / "book.jsonl"

    # The server -------------------------------------------------------------------------------------------------------

    def start(self, patience: float = START) -> bool:
        """Starts the server. Returns False if the server ends with a message, or does not answer in time."""
        self.runs.mkdir(0o700, parents=True, exist_ok=True)
        address = self.runs / "server.json"
        with suppress(OSError):
            address.unlink()
        worker = shlex.join(["env", "-u", "LD_PRELOAD", sys.executable, str(HERE / "worker.py"), str(self.book)])
        command = [
            *self.before, sys.executable, "-m", "tests.drill.server", str(self.order), "--runs", str(self.runs),
            "--port", "0", "--no-zenoh", "--worker", worker, "--slots", str(self.slots), "--grace", "1.5",
            *self.options,
        ]  # fmt: skip
        with (self.root / "server.log").open("ab") as log:
            self.child = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=HERE.parents[1],
                env={**os.environ, **self.environment},
            )  # fmt: skip
        deadline = time.monotonic() + patience
        while (found := self._address(address)) is None:
            if self.child.poll() is not None or time.monotonic() > deadline:
                self.kill()
                return False
            time.sleep(0.02)
        self._connect(found["url"])
        return True

    def _address(self, path: Path) -> dict[str, Any] | None:
        with suppress(OSError, ValueError):
            found: dict[str, Any] = json.loads(path.read_text())
            if self.child is not None and found["pid"] in {self.child.pid, *_children(self.child.pid)}:
                return found
        return None

    def _connect(self, url: str) -> None:
        if self.http is not None:
            token = self.http.headers["Authorization"]
            self.http.close()
        else:
            token = f"Bearer {self.token()}"
        self.http = httpx2.Client(base_url=url, headers={"Authorization": token}, timeout=PATIENCE)

    def token(self) -> str:
        """Creates a token of the user."""
        store = Store(Settings(runs=self.runs).database_url)
        made = create_token(store, "ann", frozenset({"read", "submit", "metrics"}))
        store.close()
        return made

    def new_token(self) -> None:
        """Creates a new token after the loss of the database, because only the database contains the tokens."""
        assert self.http is not None
        self.http.headers["Authorization"] = f"Bearer {self.token()}"

    def signal(self, number: signal.Signals) -> None:
        """Sends a signal to the server."""
        assert self.child is not None
        os.kill(self.child.pid, number)

    def kill(self) -> None:
        """Kills the server, which simulates a crash."""
        if self.child is not None and self.child.poll() is None:
            self.child.kill()
            self.child.wait(20)

    def again(self) -> None:
        """Kills the server and starts a new server. Raises AssertionError if the new server does not start."""
        self.kill()
        assert self.start(), f"the server does not start: {self.last_line()}"

    def last_line(self) -> str:
        """Returns the last line of the server's log."""
        return (self.root / "server.log").read_text(errors="replace").strip().rpartition("\n")[2][:200]

    def close(self) -> None:
        """Ends the server and all processes of the stand."""
        self.order.unlink(missing_ok=True)
        self.kill()
        if self.http is not None:
            self.http.close()
        for entry in Path("/proc").iterdir():
            with suppress(OSError):
                if entry.name.isdigit() and str(self.root).encode() in (entry / "cmdline").read_bytes():
                    os.kill(int(entry.name), signal.SIGKILL)

    # Its users --------------------------------------------------------------------------------------------------------

    def ask(self, method: str, path: str, **words: Any) -> tuple[int, Any]:
        """Sends a request; returns status and body, or the status 0 if no answer arrives."""
        assert self.http is not None
        try:
            answer = self.http.request(method, path, **words)
        except httpx2.HTTPError as error:
            return 0, type(error).__name__
        if answer.status_code >= 500 and answer.status_code not in TOLERATED:
            self.errors.append(f"{method} {path}: {answer.status_code}")
        try:
            return answer.status_code, answer.json()
        except ValueError:
            return answer.status_code, answer.text

    @contextmanager
    def giving_up(self, seconds: float) -> Iterator[None]:
        """Sets the time for which users wait for an answer within the block."""
        assert self.http is not None
        self.http.timeout = seconds
        yield
        self.http.timeout = PATIENCE

    def hand_in(self, key: str = "", **plan: Any) -> tuple[int, Any]:
        """Tries once to submit a run."""
        query = {"profile": self.profile} if self.profile else {}
        headers = {**TOML, **({"Idempotency-Key": key} if key else {})}
        return self.ask("POST", "/v1/runs", content=case_text(**plan), headers=headers, params=query)

    def submit(self, **plan: Any) -> str:
        """Submits a run; returns the id of the run."""
        status, answer = self.hand_in(**plan)
        assert status == 202, answer
        return str(answer["id"])

    def running(self, **plan: Any) -> str:
        """Submits a run that waits for the signal of ``go``; returns the id of the run. After the submission the run
        may still be in the queue.
        """
        name = f"go-{time.monotonic_ns()}"
        run = self.submit(wait=str(self.root / name), **plan)
        (self.root / f"sign-{run}").write_text(name)
        return run

    def go(self, run: str) -> None:
        """Creates the file for which the run waits."""
        (self.root / (self.root / f"sign-{run}").read_text()).touch()

    def cancel(self, run: str) -> int:
        """Tries once to cancel a run; returns the status of the answer."""
        return self.ask("POST", f"/v1/runs/{run}:cancel")[0]

    def state(self, run: str) -> str:
        """Returns state and cause of a run, such as ``succeeded`` or ``lost/node``; if the server refuses, the status
        of the answer."""
        status, answer = self.ask("GET", f"/v1/runs/{run}")
        if status != 200:
            return str(status)
        return f"{answer['state']}/{answer['cause']}" if answer["cause"] else str(answer["state"])

    def reached(self, run: str, *states: str) -> str:
        """Waits until the run has one of the given states, by default any final state; returns the last state of the
        run, also after the time limit."""
        deadline = time.monotonic() + self.patience
        while (seen := self.state(run)).partition("/")[0] not in (states or FINAL):
            if time.monotonic() > deadline:
                break
            time.sleep(0.1)
        return seen

    def entries(self, run: str) -> list[dict[str, Any]]:
        """Returns the entries of a run in the record of the workers."""
        lines = self.book.read_text().splitlines() if self.book.exists() else []
        return [entry for entry in map(json.loads, lines) if entry["run"] == run]

    def ranks(self, run: str) -> list[int]:
        """Returns the process ids of rank 0 that still exist."""
        started = [entry["pid"] for entry in self.entries(run) if entry["what"] == "start"]
        return [pid for pid in started if processes.start_time(pid) is not None]


def _children(pid: int) -> Iterator[int]:
    """Yields the child processes of a process. setpriv and faketime replace themselves with their command; a wrapper
    that stays has child processes."""
    with suppress(OSError):
        yield from map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())


def can_drop() -> bool:
    """True if file permissions limit the processes that a stand starts."""
    return os.geteuid() != 0 or shutil.which(UNPRIVILEGED[0]) is not None
