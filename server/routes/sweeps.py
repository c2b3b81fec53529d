"""Sweeps: hand in, look at, cancel, and the table of what came out."""

import csv
import io
from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Response
from fastapi.responses import JSONResponse
from msgspec import structs
from starlette.concurrency import run_in_threadpool

from conoid.cases.outcome import Outcome, known

from .. import openapi, view
from ..auth import Identity, Reader, Submitter
from ..errors import not_found
from ..events import Run
from ..limits import read_body
from ..service import Service, ServiceOf
from ..sweeps import Plan
from .runs import ask_to_stop

router = APIRouter()
Body = Annotated[bytes, Depends(read_body)]


@router.post("/v1/sweeps", status_code=202, openapi_extra=openapi.SWEEP_BODY)
async def submit(
    service: ServiceOf, identity: Submitter, body: Body, idempotency_key: Annotated[str | None, Header()] = None
) -> Response:
    """Takes a case and the points at which it is to be run; all runs are accepted, or none."""
    async with service.sweep_turns.turn(identity.owner):
        plan = await run_in_threadpool(service.sweeps.submit, identity.owner, body, idempotency_key)
    shown = await run_in_threadpool(_shown, service, plan)
    return JSONResponse(shown, 202, {"Location": f"/v1/sweeps/{plan.id}"})


@router.get("/v1/sweeps")
def page(service: ServiceOf, identity: Reader) -> dict[str, Any]:
    """Own sweeps, newest first."""
    return {"sweeps": [_brief(service, plan) for plan in service.sweeps.of(identity.owner)]}


@router.get("/v1/sweeps/{sweep_id}")
def show(service: ServiceOf, identity: Reader, sweep_id: str) -> dict[str, Any]:
    """The sweep: how many of its runs are in each state, and each point with its run."""
    return _shown(service, _find(service, identity, sweep_id))


@router.get("/v1/sweeps/{sweep_id}/table")
def table(service: ServiceOf, identity: Reader, sweep_id: str) -> Response:
    """A line a point as CSV: what was changed, the state of the run, and its results as far as it has any."""
    plan = _find(service, identity, sweep_id)
    lines = [_line(service, point, run) for point, run in _pairs(service, plan)]
    out = io.StringIO()
    columns = list(dict.fromkeys(name for line in lines for name in line))
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return Response(out.getvalue(), media_type="text/csv; charset=utf-8")


@router.post("/v1/sweeps/{sweep_id}:cancel", status_code=202)
def cancel(service: ServiceOf, identity: Submitter, sweep_id: str) -> dict[str, Any]:
    """Cancels every run of the sweep that has not ended. Asking again changes nothing."""
    plan = _find(service, identity, sweep_id)
    for run_id in plan.runs:
        if service.supervisor.is_open(run_id):
            ask_to_stop(service, run_id)
    return _shown(service, plan)


def _find(service: Service, identity: Identity, sweep_id: str) -> Plan:
    plan = service.sweeps.get(sweep_id, identity.owner)
    if plan is None:
        raise not_found(f"sweep {sweep_id[:40]!r}")
    return plan


def _pairs(service: Service, plan: Plan) -> list[tuple[dict[str, Any], Run]]:
    """Each point with its run; without those of which the server knows nothing any more."""
    found = (service.supervisor.current(run_id) or service.store.get(run_id) for run_id in plan.runs)
    return [(point, run) for point, run in zip(plan.points, found, strict=False) if run is not None]


def _brief(service: Service, plan: Plan) -> dict[str, Any]:
    return _headed(plan, _pairs(service, plan))


def _headed(plan: Plan, pairs: Sequence[tuple[dict[str, Any], Run]]) -> dict[str, Any]:
    states = Counter(run.state.value for _, run in pairs)
    return {
        "id": plan.id, "owner": plan.owner, "name": plan.name, "submitted": plan.submitted, "at_once": plan.at_once,
        "total": len(plan.points), "states": dict(states), "url": f"/v1/sweeps/{plan.id}",
    }  # fmt: skip


def _shown(service: Service, plan: Plan) -> dict[str, Any]:
    pairs = _pairs(service, plan)
    points = [{"values": point, "run": view.brief(service, run)} for point, run in pairs]
    return {**_headed(plan, pairs), "points": points}


def _line(service: Service, point: dict[str, Any], run: Run) -> dict[str, Any]:
    ended = view.outcome(service.settings.runs / run.id) if run.state.final else None
    values = {key: value if isinstance(value, int | float | str) else repr(value) for key, value in point.items()}
    return {**values, "run": run.id, "state": run.state.value, "cause": run.cause or "", **_results(ended)}


def _results(ended: Outcome | None) -> dict[str, Any]:
    """The numbers of an outcome that stand alone, the terms of the energy, the references; with units in brackets."""
    if ended is None:
        return {}
    names = ("elements", "nodes", "fragments", "broken", "eroded", "worst_residual")
    times = {f"{name} [s]": getattr(ended, name) for name in ("time", "elapsed", "cpu")}
    energy = {} if ended.energy is None else structs.asdict(ended.energy)
    terms = {_with_unit(f"energy.{name}", "" if name == "residual" else "J"): joule for name, joule in energy.items()}
    checks = {_with_unit(f"reference.{check.name}", check.unit): check.value for check in ended.reference}
    numbers = {"steps": ended.steps, **times, **{name: getattr(ended, name) for name in names}}
    found = {**numbers, **terms, **checks}
    return {**{name: "" if known(value) is None else value for name, value in found.items()}, "digest": ended.digest}


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
