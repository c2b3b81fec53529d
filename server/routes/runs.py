"""Routes for runs: submit, list, show, cancel; request a checkpoint or a snapshot."""

import json
import time
from collections.abc import Iterator
from itertools import islice, takewhile
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Header, Query, Request, Response
from fastapi.responses import JSONResponse

from conoid.cases.load import CaseError
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.cases.site.policy import PRIORITY

from ..answers import download, openapi, view
from ..answers.filters import Chosen
from ..errors import ServiceError, invalid_case, not_found
from ..intake.copies import names_files
from ..intake.submission import Wishes, labels_of
from ..requests.auth import Identity, Pass, Reader, Submitter, unauthorized
from ..requests.limits import read_body
from ..requests.thread_pool import blocking
from ..requests.user_limits import place_of
from ..runs import folder, pins, restarts
from ..runs.events import Run
from ..service import Service, ServiceOf
from .list_query import ChosenOf

router = APIRouter()
Body = Annotated[bytes, Depends(read_body)]
_MOST_RANKS = _MOST_THREADS = 1_000_000
_MOST_STEPS = 2**53
"""Largest number that a parameter accepts (chosen value); the server has lower limits for most parameters."""
_LAST = "z" * 22
"""Text that, added to the beginning of an id, sorts after every id with this beginning."""
MAX_WAIT = 60.0
"""Largest value of the parameter ``wait`` of a request, s."""


@router.post("/v1/runs", status_code=202, openapi_extra=openapi.CASE_BODY)
async def submit(
    service: ServiceOf,
    identity: Submitter,
    body: Body,
    content_type: Annotated[str, Header(include_in_schema=False)] = "",
    idempotency_key: Annotated[str | None, Header()] = None,
    label: Annotated[list[str] | None, Query(description="NAME=VALUE, by which the run is found again")] = None,
    profile: Annotated[str, Query(description="of the site's batch system; the site's default when empty")] = "",
    priority: Annotated[int, Query(ge=-PRIORITY, le=PRIORITY, description="among your own runs")] = 0,
) -> Response:
    """Submits a case as TOML or JSON. A request with the same Idempotency-Key and the same body returns the same run
    and the same answer.
    """
    wishes = Wishes(labels_of(label or ()), profile, priority)
    pool = service.surveyors if names_files(body) else service.readers
    receipt = await pool.run(service.desk.submit, identity.owner, body, content_type, idempotency_key, wishes)
    return JSONResponse(receipt, 202, {"Location": receipt["url"]})


Cursor = Annotated[str | None, Query(json_schema_extra={"pattern": "^[A-Za-z0-9_-]{30}$"})]


@router.get("/v1/runs")
@blocking
def page(
    service: ServiceOf,
    identity: Reader,
    chosen: ChosenOf,
    cursor: Cursor = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
    prefix: Annotated[str, Query(pattern="^[0-9a-z]{0,22}$", description="the beginning of their ids")] = "",
) -> dict[str, Any]:
    """Returns the user's runs, newest first, without runs whose folder has been removed. The field ``next`` is the
    cursor of the next page; ``next`` is null on the last page.
    """
    runs = listed(service, identity.owner, chosen, cursor, limit + 1, prefix)
    following = view.to_cursor(runs[limit - 1]) if len(runs) > limit else None
    return {"runs": view.briefs(service, runs[:limit]), "next": following}


def listed(service: Service, owner: str, chosen: Chosen, cursor: str | None, most: int, prefix: str = "") -> list[Run]:
    """Returns at most ``limit`` runs of an owner after the cursor, newest first; each run has a folder. Raises
    ServiceError with status 400 if the cursor is invalid.
    """
    before = view.from_cursor(cursor) if cursor is not None else prefix + _LAST if prefix else None
    pages = _pages(service, owner, chosen, before, most)
    return list(islice(takewhile(lambda run: run.id.startswith(prefix), pages), most))


def _pages(service: Service, owner: str, chosen: Chosen, before: str | None, size: int) -> Iterator[Run]:
    """Yields the runs of an owner that have a folder, newest first, read from the database in blocks."""
    while some := service.store.page(owner, chosen, before, size):
        yield from service.existing.left(some)
        if len(some) < size:
            return
        before = some[-1].id


@blocking
def owned_run(run_id: str, service: ServiceOf, identity: Reader) -> Run:
    """Returns a run of the user. An unknown run and a run of another user give the same ServiceError with status
    404.
    """
    return find(service, identity, run_id)


OwnedRun = Annotated[Run, Depends(owned_run)]


def find(service: Service, identity: Identity, run_id: str) -> Run:
    """Returns the present state of the run. Raises ServiceError with status 404 if the run is unknown, or 410 if the
    run has ended and has no folder. Raises OSError if the folder of all runs is missing.
    """
    run = (service.supervisor.current(run_id) or service.store.get(run_id)) if folder.is_id(run_id) else None
    if run is None or run.owner != identity.owner:
        raise not_found(f"run {run_id[:40]!r}")
    if run.state.final and not service.existing.there(run.id):
        raise _gone(service, run)
    return run


def _gone(service: Service, run: Run) -> ServiceError:
    """Returns the error with status 410 for a removed run, with its record."""
    line = service.removed_runs.get(run.id)
    why = f" ({line.why})" if line is not None else ""
    return ServiceError(
        410, "gone", f"run {run.id}: its folder has been removed{why}; it ended as {run.state.value}",
        outcome=msgspec.to_builtins(line) if line is not None else None,
    )  # fmt: skip


@router.get("/v1/runs/{run_id}")
async def show(
    request: Request,
    run: OwnedRun,
    service: ServiceOf,
    identity: Reader,
    wait: Annotated[float, Query(ge=0, le=MAX_WAIT)] = 0.0,
) -> Response:
    """Returns the run. With the parameter ``wait`` the answer is sent when the state of the run has changed, but after
    ``wait`` seconds at the latest. With ``wait`` and the header If-None-Match, any change of the run counts; a run that
    has ended is answered at once.
    """
    known = request.headers.get("if-none-match")
    first = await service.pool.run(view.snapshot, service, run)
    if wait > 0.0 and not first.state.final:
        place_of(request).lengthen()
    latest, deadline, may = first, time.monotonic() + wait, Pass(service, identity)
    with service.wakeups.listen(run.id) as listener:
        while not (latest.state.final or service.wakeups.closed):
            changed = latest.state is not first.state if known is None else not download.is_known(latest.etag, known)
            left = deadline - time.monotonic()
            if changed or left <= 0:
                break
            news = await listener.wait(min(left, may.left))
            listener.clear()
            if not await may.holds():
                raise unauthorized()
            if news:
                latest = await service.pool.run(lambda: view.snapshot(service, find(service, identity, run.id)))
    headers = {"ETag": latest.etag, "Cache-Control": "private, no-cache"}
    if known is not None and download.is_known(latest.etag, known):
        return Response(status_code=304, headers=headers)
    return Response(latest.body, 200, headers, "application/json")


@router.delete("/v1/runs/{run_id}", status_code=204)
@blocking
def purge(run_id: str, service: ServiceOf, identity: Submitter) -> Response:
    """Removes a run that has ended, with all its files. Later requests for the removed run are answered with status
    410. The removal of a run cannot be undone.
    """
    run = find(service, identity, run_id)
    if not run.state.final or service.supervisor.current(run.id) is not None:
        raise ServiceError(409, "not_ended", f"run {run.id} is {run.state.value}; a run that has ended can be removed")
    try:
        service.removal.remove(run, f"by {identity.owner}")
        service.existing.there(run.id)
    except FileNotFoundError:
        raise _gone(service, run) from None
    except OSError as error:
        raise ServiceError(503, "unavailable", f"not removed: {error.strerror}", retryable=True) from error
    return Response(status_code=204)


@router.post("/v1/runs/{run_id}:keep")
@blocking
def keep(run_id: str, service: ServiceOf, identity: Submitter) -> Response:
    """Keeps the run permanently: only its owner can remove the run, no rule of the site."""
    return _pin(service, find(service, identity, run_id), True)


@router.post("/v1/runs/{run_id}:release")
@blocking
def release(run_id: str, service: ServiceOf, identity: Submitter) -> Response:
    """Allows the rules of the site to remove the run, even if the run was submitted with the label ``keep``."""
    return _pin(service, find(service, identity, run_id), False)


def _pin(service: Service, run: Run, keep: bool) -> Response:
    try:
        pins.pin(service.settings.runs / run.id, keep)
    except OSError as error:
        raise ServiceError(507, "storage", f"not recorded: {error.strerror}", retryable=True) from error
    service.store.relabel(run, pins.labels(service.settings.runs / run.id))
    return Response(view.snapshot(service, run).body, media_type="application/json")


@router.post("/v1/runs/{run_id}:cancel", status_code=202)
@blocking
def cancel(run_id: str, service: ServiceOf, identity: Submitter) -> Response:
    """Stops a run at its next step, or kills the run if it does not stop. A repeated request to stop changes
    nothing.
    """
    run = find(service, identity, run_id)
    ask_to_stop(service, run.id)
    return Response(view.snapshot(service, find(service, identity, run_id)).body, 202, media_type="application/json")


def ask_to_stop(service: Service, run_id: str) -> None:
    """Requests that a run is stopped. Raises ServiceError with status 503 if the request cannot be recorded."""
    try:
        service.supervisor.cancel(run_id)
    except Exception as error:
        detail = f"the request could not be recorded: {str(error) or 'no answer in time'}".splitlines()[0]
        raise ServiceError(503, "unavailable", detail, retryable=True) from error


@router.post("/v1/runs/{run_id}:restart", status_code=202)
async def restart(
    run_id: str,
    service: ServiceOf,
    identity: Submitter,
    idempotency_key: Annotated[str | None, Header()] = None,
    ranks: Annotated[int | None, Query(ge=1, le=_MOST_RANKS, description="those of the case if not given")] = None,
    threads: Annotated[int | None, Query(ge=1, le=_MOST_THREADS, description="of each rank, likewise")] = None,
    max_steps: Annotated[int | None, Query(ge=1, le=_MOST_STEPS, description="run.max_steps, likewise")] = None,
    profile: Annotated[str, Query(description="of the site's batch system")] = "",
    priority: Annotated[int, Query(ge=-PRIORITY, le=PRIORITY, description="among your own runs")] = 0,
) -> Response:
    """Starts a new run of the same case that continues from the newest checkpoint of this run. The final results of the
    new run equal those of an uninterrupted run; the old run is not changed. A run that has reached run.max_steps needs
    a larger max_steps, else the answer has status 409.
    """
    run = await service.pool.run(find, service, identity, run_id)
    wishes = Wishes({restarts.LABEL: run.id}, profile, priority, run.id)
    numbers = ranks, threads, max_steps
    receipt = await service.surveyors.run(_restarted, service, run, numbers, idempotency_key, wishes)
    return JSONResponse(receipt, 202, {"Location": receipt["url"]})


def _restarted(
    service: Service, run: Run, numbers: tuple[int | None, int | None, int | None], key: str | None, wishes: Wishes
) -> dict[str, Any]:
    path = service.settings.runs / run.id
    try:
        case = path / folder.submission(path).case_file
        body = json.dumps(restarts.body(case, *numbers)).encode()
        restarts.check(path, numbers[-1])
    except (OSError, msgspec.MsgspecError) as error:
        raise ServiceError(409, "no_case", f"run {run.id}: its case cannot be read") from error
    except CaseError as error:
        raise invalid_case(error.problems) from None
    return service.desk.submit(run.owner, body, "application/json", key, wishes)


@router.post("/v1/runs/{run_id}:checkpoint", status_code=202)
@blocking
def checkpoint(run_id: str, service: ServiceOf, identity: Submitter) -> Response:
    """Requests a checkpoint of the run; a message of the journal reports the checkpoint when it is on disk. A repeated
    request before this message changes nothing.
    """
    return _ask(service, find(service, identity, run_id), layout.CHECKPOINT_REQUEST, "keeps one")


@router.post("/v1/runs/{run_id}:snapshot", status_code=202)
@blocking
def snapshot(run_id: str, service: ServiceOf, identity: Submitter) -> Response:
    """Requests a snapshot of the fragments; a message of the journal with the cause "asked for" reports the snapshot
    when it is on disk. A repeated request before this message changes nothing.
    """
    return _ask(service, find(service, identity, run_id), layout.SNAPSHOT_REQUEST, "makes one")


def _ask(service: Service, run: Run, request: str, words: str) -> Response:
    """Writes the file with which the server asks the worker for something. Raises ServiceError with status 409 or
    503.
    """
    if run.state is not State.RUNNING:
        raise ServiceError(409, "not_running", f"run {run.id} is {run.state.value}; a run that is running {words}")
    try:
        (service.settings.runs / run.id / request).touch()
    except OSError as error:
        detail = f"the request could not be recorded: {error.strerror}"
        raise ServiceError(503, "unavailable", detail, retryable=True) from error
    return Response(view.snapshot(service, run).body, 202, media_type="application/json")
