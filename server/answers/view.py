"""A run as JSON. Times are Unix s unless their name says otherwise."""

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
"""Letters of a short id, at least. Chosen: those of git."""


@dataclass(frozen=True)
class Snapshot:
    """A run at one moment, as it is sent."""

    state: State
    body: bytes

    @property
    def etag(self) -> str:
        """Changes when anything in the body does."""
        return f'"{hashlib.sha256(self.body).hexdigest()[:32]}"'


def snapshot(service: Service, run: Run) -> Snapshot:
    """Everything about a run: where it is, how far, and once it has ended the whole outcome."""
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
    """None where the file is gone or damaged: the state of the run is true all the same."""
    try:
        return folder.submission(path)
    except (OSError, msgspec.MsgspecError):
        return None


def outcome(path: Path) -> Outcome | None:
    """None where the file is gone, damaged, or locked away."""
    try:
        return folder.outcome(path)
    except OSError:
        return None


def brief(service: Service, run: Run, labels: Mapping[str, str] | None = None) -> dict[str, Any]:
    """A run's line in a list; its labels are read where they are not given."""
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
    """Lines of a list, as the runs are now; the labels from the database, so that no file is read."""
    labels = service.store.labels([run.id for run in runs])
    shorts = short_ids(service, runs)
    return [
        {**brief(service, service.supervisor.current(run.id) or run, labels[run.id]), "short": shorts[run.id]}
        for run in runs
    ]


def short_ids(service: Service, runs: Sequence[Run]) -> dict[str, str]:
    """The shortest beginning of the id of each of an owner's runs that no other run of the owner has, by its id."""
    if not runs:
        return {}
    ids = [run.id for run in runs]
    return short(service.store.ids_about(runs[0].owner, min(ids), max(ids)), _SHORT)


def to_cursor(run: Run) -> str:
    """Where the next page begins; an opaque word for the client."""
    return base64.urlsafe_b64encode(run.id.encode()).decode().rstrip("=")


def from_cursor(cursor: str) -> str:
    """The id in a cursor. Raises ServiceError 400."""
    try:
        run_id = base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode("ascii")
    except ValueError:
        run_id = ""
    if not folder.is_id(run_id):
        raise ServiceError(400, "bad_parameter", f"cursor = {cursor[:80]!r}: send 'next' of a page", pointer="cursor")
    return run_id
