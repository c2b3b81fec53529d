"""Routes for sweeps: submit, show, cancel, repeat, and the table of results."""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Header, Query, Response
from fastapi.responses import JSONResponse

from conoid.cases.output.points import Point, results, to_csv
from conoid.cases.output.points import table as points_table
from conoid.cases.run import State

from ..answers import openapi, view
from ..errors import ServiceError, not_found
from ..intake.plans import Plan
from ..requests.auth import Identity, Reader, Submitter
from ..requests.limits import read_body
from ..requests.thread_pool import blocking
from ..runs.events import Run
from ..service import Service, ServiceOf
from .runs import ask_to_stop

router = APIRouter()
Body = Annotated[bytes, Depends(read_body)]


@router.post("/v1/sweeps", status_code=202, openapi_extra=openapi.SWEEP_BODY)
async def submit(
    service: ServiceOf, identity: Submitter, body: Body, idempotency_key: Annotated[str | None, Header()] = None
) -> Response:
    """Submits a sweep: a case, and the points at which the case is run. Either all runs of the sweep are accepted, or
    none.
    """
    plan = await service.sweepers.run(service.sweeps.submit, identity.owner, body, idempotency_key)
    shown = await service.pool.run(_shown, service, plan)
    return JSONResponse(shown, 202, {"Location": f"/v1/sweeps/{plan.id}"})


@router.put("/v1/sweeps/adaptive/{name}", openapi_extra=openapi.SEARCH_BODY)
async def report(service: ServiceOf, identity: Submitter, name: str, body: Body) -> dict[str, Any]:
    """Stores the report of an adaptive sweep, whose client chooses the points and submits them as runs. The first
    report with a new ``name`` (16 to 64 hexadecimal digits) creates the sweep. Runs of other users in the report are
    ignored. The server keeps the newest 100 adaptive sweeps of a user. ``stop``: the sweep was cancelled on the server,
    and the client command with this start time ``began`` must submit no further point.
    """
    plan = await service.pool.run(service.searches.report, identity.owner, name, body)
    stop = plan.search is not None and plan.cancelled == plan.search.began
    return {"id": plan.id, "url": f"/v1/sweeps/{plan.id}", "stop": stop}


@router.get("/v1/sweeps")
@blocking
def page(
    service: ServiceOf,
    identity: Reader,
    before: Annotated[str, Query(description="the id of a sweep; the answer has older sweeps only")] = "",
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
) -> dict[str, Any]:
    """Returns the user's sweeps, newest first. The field ``next`` is the parameter ``before`` of the next page;
    ``next`` is null on the last page.
    """
    plans = [plan for plan in service.sweeps.plans.of(identity.owner) if not before or plan.id < before]
    following = plans[limit - 1].id if len(plans) > limit else None
    return {"sweeps": [_brief(service, plan) for plan in plans[:limit]], "next": following}


@router.get("/v1/sweeps/{sweep_id}")
@blocking
def show(service: ServiceOf, identity: Reader, sweep_id: str) -> dict[str, Any]:
    """Returns the sweep: number of runs in each state, and each point with its run."""
    return _shown(service, find(service, identity, sweep_id))


@router.get("/v1/sweeps/{sweep_id}/table")
@blocking
def table(service: ServiceOf, identity: Reader, sweep_id: str) -> Response:
    """Returns CSV text with one line for each point: changed values, state of the run, results as far as they exist."""
    plan = find(service, identity, sweep_id)
    points = [_point(service, values, run) for values, run in _pairs(service, plan)]
    return Response(to_csv(points_table(points)), media_type="text/csv; charset=utf-8")


@router.post("/v1/sweeps/{sweep_id}:cancel", status_code=202)
async def cancel(service: ServiceOf, identity: Submitter, sweep_id: str) -> dict[str, Any]:
    """Cancels every open run of the sweep. A repeated cancel changes nothing."""
    return await service.sweepers.run(_cancelled, service, identity, sweep_id)


@router.post("/v1/sweeps/{sweep_id}:again", status_code=202, openapi_extra=openapi.SWEEP_BODY)
async def again(service: ServiceOf, identity: Submitter, sweep_id: str, body: Body) -> Response:
    """Repeats the points whose runs have ended without success or were removed. The body is the original request for
    the sweep. A repeated request changes nothing while the new runs are open.
    """
    plan = await service.pool.run(find, service, identity, sweep_id)
    if plan.search is not None:
        raise ServiceError(409, "adaptive", "the points of an adaptive sweep are decided by the command that began it")
    failed = await service.pool.run(_failed, service, plan)
    plan = await service.sweepers.run(service.sweeps.again, plan, body, failed)
    return JSONResponse(await service.pool.run(_shown, service, plan), 202)


def _failed(service: Service, plan: Plan) -> dict[int, str]:
    """Returns the points whose run has failed or was removed, with these runs; points with a run that is open or has
    succeeded are left out.
    """
    good = {run.id for _, run in _pairs(service, plan) if not run.state.final or run.state is State.SUCCEEDED}
    return {n: run_id for n, run_id in enumerate(plan.runs) if run_id not in good}


def _cancelled(service: Service, identity: Identity, sweep_id: str) -> dict[str, Any]:
    plan = find(service, identity, sweep_id)
    if plan.search is not None:
        service.searches.cancel(plan)
    for run_id in service.sweeps.cancel(plan):
        if service.supervisor.is_open(run_id):
            ask_to_stop(service, run_id)
    return _shown(service, plan)


def find(service: Service, identity: Identity, sweep_id: str) -> Plan:
    """Returns the sweep if the sweep belongs to the user. Raises ServiceError with status 404 if the user has no such
    sweep.
    """
    plan = service.sweeps.get(sweep_id, identity.owner)
    if plan is None:
        raise not_found(f"sweep {sweep_id[:40]!r}")
    return plan


def _pairs(service: Service, plan: Plan) -> list[tuple[dict[str, Any], Run]]:
    """Returns the changed values of each point with its run; points whose run was removed are left out."""
    kept = service.store.some(plan.runs)
    found = [run for run_id in plan.runs if (run := service.supervisor.current(run_id) or kept.get(run_id))]
    left = {run.id: run for run in service.existing.left(found)}
    return [(point, left[run_id]) for point, run_id in zip(plan.points, plan.runs, strict=False) if run_id in left]


def _brief(service: Service, plan: Plan) -> dict[str, Any]:
    return _headed(plan, _pairs(service, plan))


def _headed(plan: Plan, pairs: Sequence[tuple[dict[str, Any], Run]]) -> dict[str, Any]:
    states = Counter(run.state.value for _, run in pairs)
    return {
        "id": plan.id, "owner": plan.owner, "name": plan.name, "submitted": plan.submitted, "at_once": plan.at_once,
        "total": len(plan.points), "states": dict(states), "removed": len(plan.runs) - len(pairs),
        "url": f"/v1/sweeps/{plan.id}",
        "search": plan.search and msgspec.to_builtins(plan.search), "reported": plan.reported or None,
    }  # fmt: skip


def _shown(service: Service, plan: Plan) -> dict[str, Any]:
    pairs = _pairs(service, plan)
    lines = view.briefs(service, [run for _, run in pairs])
    points = [{"values": point, "run": line} for (point, _), line in zip(pairs, lines, strict=True)]
    return {**_headed(plan, pairs), "points": points}


def _point(service: Service, values: dict[str, Any], run: Run) -> Point:
    ended = view.outcome(service.settings.runs / run.id) if run.state.final else None
    return Point(values=values, run=run.id, state=run.state.value, cause=run.cause or "", results=results(ended))
