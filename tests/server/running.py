"""Servers in this process and in separate processes, and the users of these servers. The workers of these servers
compute nothing.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx2

from conoid.cases.run import State
from conoid.server.database.store import Store
from conoid.server.requests.tokens import create_token
from conoid.server.service import Service
from conoid.server.settings import Settings

FAKE = (sys.executable, str(Path(__file__).with_name("fake_worker.py")))
PATIENCE = 20.0
START = 180.0
"""Time limit for the start of a server on a busy machine, s."""
TOML = {"Content-Type": "application/toml"}


def case_text(
    name: str = "bar", ranks: int = 1, end_time: str = "1 us", extra: str = "", threads: int = 1, **plan: Any
) -> str:
    """Returns a small case in TOML; ``plan`` configures the fake worker."""
    return f"""
name = "{name}"
title = "A bar"
description = {json.dumps(json.dumps(plan))}

[[parts]]
name = "rod"
material = "steel"
[parts.mesh]
shape = "box"
low = ["0 mm", "0 mm", "0 mm"]
high = ["1 mm", "1 mm", "4 mm"]
element_size = "0.5 mm"
generator = "structured"

[materials.steel]
density = "7800 kg/m^3"
elastic = {{ young = "200 GPa", poisson = 0.3 }}

[run]
end_time = "{end_time}"
ranks = {ranks}
threads = {threads}
{extra}
"""


@dataclass
class User:
    """A user of a server; the client ``http`` sends the user's token."""

    http: httpx2.Client
    name: str
    runs: Path
    """Folder of the server's runs."""

    def submit(self, text: str | None = None, **plan: Any) -> str:
        """Submits a run and returns the id of the run."""
        answer = self.http.post("/v1/runs", content=text or case_text(**plan), headers=TOML)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def show(self, run: str) -> dict[str, Any]:
        """Returns the present state of the run."""
        answer = self.http.get(f"/v1/runs/{run}")
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    def wait_for(self, run: str, *states: State) -> dict[str, Any]:
        """Waits until the run is in one of ``states`` (default: any final state) and returns the run."""
        wanted = states or tuple(state for state in State if state.final)
        deadline = time.monotonic() + PATIENCE
        while (seen := self.show(run))["state"] not in wanted:
            assert time.monotonic() < deadline, f"run {run} is still {seen['state']}, not {wanted}"
            self.http.get(f"/v1/runs/{run}", params={"wait": 0.5})
        return seen

    def events(self, run: str, **query: int) -> list[dict[str, Any]]:
        """Returns the journal of the run over REST."""
        found: list[dict[str, Any]] = self.http.get(f"/v1/runs/{run}/events", params=query).json()["events"]
        return found

    def states(self, run: str) -> list[str]:
        """Returns the states of the run in the journal, in order."""
        return [event["state"] for event in self.events(run) if event["type"] == "status"]


@dataclass
class Running:
    """A server in this process and its two users."""

    service: Service
    ann: User
    bob: User
    nobody: User


@dataclass
class Process:
    """A server in a separate process, on a folder, with the arguments for another start."""

    runs: Path
    arguments: tuple[str, ...]
    child: subprocess.Popen[bytes] | None = None
    clients: list[httpx2.Client] = field(default_factory=list)

    def start(self) -> dict[str, Any]:
        """Starts the server and returns the content of server.json."""
        address = self.runs / "server.json"
        address.unlink(missing_ok=True)
        command = [sys.executable, "-m", "conoid.server", "--runs", str(self.runs), "--port", "0", *self.arguments]
        self.child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + START
        while not address.exists():
            assert self.child.poll() is None, "the server ended at its start"
            assert time.monotonic() < deadline
            time.sleep(0.01)
        record: dict[str, Any] = json.loads(address.read_text())
        return record

    def user(self, url: str, name: str = "ann") -> User:
        """Returns a user with a new token."""
        store = Store(Settings(runs=self.runs).database_url)
        token = create_token(store, name, frozenset({"read", "submit"}))
        store.close()
        client = httpx2.Client(base_url=url, headers={"Authorization": f"Bearer {token}"}, timeout=PATIENCE)
        self.clients.append(client)
        return User(client, name, self.runs)

    def close(self) -> None:
        """Kills the server and its workers."""
        for client in self.clients:
            client.close()
        if self.child is not None and self.child.poll() is None:
            self.child.kill()
            self.child.wait(PATIENCE)
        _end_workers(self.runs)

    def end(self, number: signal.Signals) -> int:
        """Sends a signal to the server and waits for the end of the server."""
        assert self.child is not None
        self.child.send_signal(number)
        return self.child.wait(PATIENCE)


MakeProcess = Callable[..., Process]


@contextmanager
def processes(folder: Path) -> Iterator[MakeProcess]:
    """Yields a function that makes servers on ``folder``/runs with given arguments; afterwards ends all servers and
    their workers.
    """
    made: list[Process] = []

    def make(*arguments: str) -> Process:
        fake = " ".join(FAKE)
        made.append(Process(folder / "runs", ("--worker", fake, "--slots", "2", "--grace", "0.5", *arguments)))
        return made[-1]

    try:
        yield make
    finally:
        for one in made:
            one.close()


def _end_workers(folder: Path) -> None:
    """Kills the workers below ``folder`` that the servers of a test have left."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                if str(folder).encode() in (entry / "cmdline").read_bytes():
                    os.kill(int(entry.name), signal.SIGKILL)
            except OSError:
                continue
