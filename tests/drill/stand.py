"""Where a fault is tried: a server of its own on a folder of its own, its user, a book of what its workers did."""

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
"""s in which a server must be up, or have said why not."""
PATIENCE = 60.0
"""s for which a user waits for an answer."""
UNPRIVILEGED = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
"""Before a command: root obeys the permissions of files as everybody does."""
FINAL = {state.value for state in State if state.final}
TOLERATED = {503, 507}
"""Server errors that say what is wrong and that it passes."""


@dataclass
class Stand:
    """A server with workers that compute nothing; ``root`` has its book, its orders and the folder of its runs."""

    root: Path
    options: Sequence[str] = ()
    before: Sequence[str] = ()
    """What stands before the server's command."""
    environment: Mapping[str, str] = field(default_factory=dict)
    slots: int = 5
    large: int = 2
    """Ranks of a run that finds no room beside four others."""
    patience: float = 30.0
    """s in which the state must be true again."""
    profile: str = ""
    child: subprocess.Popen[bytes] | None = None
    http: httpx2.Client | None = None
    errors: list[str] = field(default_factory=list)
    """Answers that are none: 500 and the like, by run."""

    @property
    def runs(self) -> Path:
        """The server's folder."""
        return self.root / "runs"

    @property
    def order(self) -> Path:
        """What is to fail in the server, see ``tests.drill.server``."""
        return self.root / "order.json"

    @property
    def book(self) -> Path:
        """What the workers did."""
        return self.root / "book.jsonl"

    # The server -------------------------------------------------------------------------------------------------------

    def start(self, patience: float = START) -> bool:
        """Starts the server; False when it refuses, in so many words."""
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
        while (told := self._address(address)) is None:
            if self.child.poll() is not None or time.monotonic() > deadline:
                self.kill()
                return False
            time.sleep(0.02)
        self._connect(told["url"])
        return True

    def _address(self, path: Path) -> dict[str, Any] | None:
        with suppress(OSError, ValueError):
            told: dict[str, Any] = json.loads(path.read_text())
            if self.child is not None and told["pid"] in {self.child.pid, *_children(self.child.pid)}:
                return told
        return None

    def _connect(self, url: str) -> None:
        if self.http is not None:
            token = self.http.headers["Authorization"]
            self.http.close()
        else:
            token = f"Bearer {self.token()}"
        self.http = httpx2.Client(base_url=url, headers={"Authorization": token}, timeout=PATIENCE)

    def token(self) -> str:
        """Of a user, made by the operator."""
        store = Store(Settings(runs=self.runs).database_url)
        made = create_token(store, "ann", frozenset({"read", "submit", "metrics"}))
        store.close()
        return made

    def new_token(self) -> None:
        """After a database was lost, which is the only place that has them."""
        assert self.http is not None
        self.http.headers["Authorization"] = f"Bearer {self.token()}"

    def signal(self, number: signal.Signals) -> None:
        """To the server."""
        assert self.child is not None
        os.kill(self.child.pid, number)

    def kill(self) -> None:
        """As a crash does."""
        if self.child is not None and self.child.poll() is None:
            self.child.kill()
            self.child.wait(20)

    def again(self) -> None:
        """Kills the server and starts the next one. Raises AssertionError when it does not start."""
        self.kill()
        assert self.start(), f"the server does not start: {self.said()}"

    def said(self) -> str:
        """The last line of the server."""
        return (self.root / "server.log").read_text(errors="replace").strip().rpartition("\n")[2][:200]

    def close(self) -> None:
        """Ends everything."""
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
        """Status and body; status 0 when there was no answer."""
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
        """Users wait no longer than so for an answer."""
        assert self.http is not None
        self.http.timeout = seconds
        yield
        self.http.timeout = PATIENCE

    def hand_in(self, key: str = "", **plan: Any) -> tuple[int, Any]:
        """One try to submit a run."""
        query = {"profile": self.profile} if self.profile else {}
        headers = {**TOML, **({"Idempotency-Key": key} if key else {})}
        return self.ask("POST", "/v1/runs", content=case_text(**plan), headers=headers, params=query)

    def submit(self, **plan: Any) -> str:
        """The id of a new run."""
        status, told = self.hand_in(**plan)
        assert status == 202, told
        return str(told["id"])

    def running(self, **plan: Any) -> str:
        """The id of a run that waits for its sign; it may not run yet when this returns."""
        name = f"go-{time.monotonic_ns()}"
        run = self.submit(wait=str(self.root / name), **plan)
        (self.root / f"sign-{run}").write_text(name)
        return run

    def go(self, run: str) -> None:
        """The sign."""
        (self.root / (self.root / f"sign-{run}").read_text()).touch()

    def cancel(self, run: str) -> int:
        """One try."""
        return self.ask("POST", f"/v1/runs/{run}:cancel")[0]

    def state(self, run: str) -> str:
        """``succeeded``, ``lost/node``, or what was answered instead."""
        status, told = self.ask("GET", f"/v1/runs/{run}")
        if status != 200:
            return str(status)
        return f"{told['state']}/{told['cause']}" if told["cause"] else str(told["state"])

    def reached(self, run: str, *states: str) -> str:
        """The state once it is one of these (any final one when none is named), or whatever it is too late."""
        deadline = time.monotonic() + self.patience
        while (seen := self.state(run)).partition("/")[0] not in (states or FINAL):
            if time.monotonic() > deadline:
                break
            time.sleep(0.1)
        return seen

    def entries(self, run: str) -> list[dict[str, Any]]:
        """What the book says of a run."""
        lines = self.book.read_text().splitlines() if self.book.exists() else []
        return [entry for entry in map(json.loads, lines) if entry["run"] == run]

    def ranks(self, run: str) -> list[int]:
        """The processes of rank 0 that live."""
        started = [entry["pid"] for entry in self.entries(run) if entry["what"] == "start"]
        return [pid for pid in started if processes.start_time(pid) is not None]


def _children(pid: int) -> Iterator[int]:
    """setpriv replaces itself, faketime as well; a wrapper that stays has children."""
    with suppress(OSError):
        yield from map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())


def can_drop() -> bool:
    """Whether permissions hold for what a stand starts."""
    return os.geteuid() != 0 or shutil.which(UNPRIVILEGED[0]) is not None
