"""A run as JSON. A time is a Unix time in s unless its name contains another unit."""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.outcome import Outcome
from conoid.cases.run import State

from ..errors import ServiceError
from ..runs import folder, pins
from ..runs.events import Run
from ..service import Service
from .rows import short

_SHORT = 7
"""Smallest length of a short id, in characters: the length that git uses (chosen value)."""


@dataclass(frozen=True)
class Snapshot:
    """The JSON of a run at one moment, and its ETag."""

    state: State
    body: bytes

    @property
    def etag(self) -> str:
        """ETag of the body; a change of the body changes the ETag."""
        return f'"{hashlib.sha256(self.body).hexdigest()[:32]}"'


def snapshot(service: Service, run: Run) -> Snapshot:
    """Returns the data of a run: state, progress, and after its end the outcome."""
    path = service.settings.runs / run.id
    made = _submission(path)
    progress = service.supervisor.progress(run.id)
    ended = outcome(path) if run.state.final else None
    body = {
        **brief(service, run),
        "title": made.title if made else run.title,
        "case_file": made.case_file if made else "",
        "estimate": made.estimate if made else {},
        "progress": progress,
        "outcome": ended,
    }
    return Snapshot(run.state, msgspec.json.encode(body))


def _submission(path: Path) -> folder.Submission | None:
    """Returns the content of submission.json; None if the file is missing or damaged, because the answer is also useful
    without it.
    """
    try:
        return folder.submission(path)
    except (OSError, msgspec.MsgspecError):
        return None


def outcome(path: Path) -> Outcome | None:
    """Returns the content of outcome.json; None if the file is missing, damaged or not readable."""
    try:
        return folder.outcome(path)
    except OSError:
        return None


def brief(service: Service, run: Run, labels: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Returns the data of a run for the list of runs. Labels that the caller does not give are read from the run's
    folder.
    """
    return {
        "id": run.id,
        "owner": run.owner,
        "name": run.name,
        "title": run.title,
        "state": run.state,
        "cause": run.cause,
        "message": run.message,
        "reason": service.supervisor.reason(run.id),
        "ranks": run.ranks,
        "threads": run.threads,
        "submitted": run.submitted,
        "started": run.started or None,
        "finished": run.finished or None,
        "labels": pins.labels(service.settings.runs / run.id) if labels is None else labels,
        "url": f"/v1/runs/{run.id}",
    }


def briefs(service: Service, runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Returns the data of several runs for the list of runs, in their present states. The labels of runs are read from
    the database, so that no file is opened.
    """
    labels = service.store.labels([run.id for run in runs])
    shorts = short_ids(service, runs)
    return [
        {**brief(service, service.supervisor.current(run.id) or run, labels[run.id]), "short": shorts[run.id]}
        for run in runs
    ]


def short_ids(service: Service, runs: Sequence[Run]) -> dict[str, str]:
    """Returns, for each run id, the shortest prefix that is unique among the runs of the owner."""
    if not runs:
        return {}
    ids = [run.id for run in runs]
    return short(service.store.ids_about(runs[0].owner, min(ids), max(ids)), _SHORT)


def to_cursor(run: Run) -> str:
    """Returns the cursor of the next page: an opaque text for the client."""
    return base64.urlsafe_b64encode(run.id.encode()).decode().rstrip("=")


def from_cursor(cursor: str) -> str:
    """Returns the id that a cursor contains. Raises ServiceError with status 400 if the cursor is invalid."""
    try:
        run_id = base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode("ascii")
    except ValueError:
        run_id = ""
    if not folder.is_id(run_id):
        raise ServiceError(400, "bad_parameter", f"cursor = {cursor[:80]!r}: send 'next' of a page", pointer="cursor")
    return run_id
