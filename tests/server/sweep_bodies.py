"""HTTP requests for sweeps of one case with four end times, and servers that are killed during a submission."""

import json
import time
import tomllib
from typing import Any

from conoid.cases.run import State
from conoid.server.runs import folder
from conoid.server.runs.events import Run
from conoid.server.service import Service

from .running import PATIENCE, User, case_text

ENDS = [f"{n} us" for n in range(1, 5)]


def wish(**extra: Any) -> bytes:
    """Returns the HTTP body that requests a sweep over four end times."""
    points = [{"run.end_time": end} for end in ENDS]
    return json.dumps({"case": tomllib.loads(case_text()), "points": points, **extra}).encode()


def handed_in(user: User, body: bytes, key: str | None = None, status: int = 202) -> dict[str, Any]:
    """Submits a sweep and returns the answer of the server."""
    headers = {"Content-Type": "application/json", **({"Idempotency-Key": key} if key else {})}
    answer = user.http.post("/v1/sweeps", content=body, headers=headers)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


class Killed(BaseException):
    """Simulates a kill of the server."""


class Never(set[str]):
    """A set from which nothing is removed: no run starts before the end of the server."""

    def discard(self, _: object) -> None:
        """Does nothing."""


def after(service: Service, sweep: str, states: set[State]) -> list[Run]:
    """Waits until all runs of the sweep are in one of the given states and returns the runs."""
    deadline = time.monotonic() + PATIENCE
    while True:
        runs = [run for run in service.store.all() if folder.submission(service.settings.runs / run.id).labels]
        if not service.sweeps._filling and {run.state for run in runs} <= states:
            return runs
        assert time.monotonic() < deadline, runs
        time.sleep(0.05)
