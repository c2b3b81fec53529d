"""Sweeps: hand in, look at, cancel, and the table of what came out."""

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Response
from fastapi.responses import JSONResponse
from msgspec import structs

from conoid.cases.outcome import Outcome, known

from .. import openapi, view
from ..auth import Identity, Reader, Submitter
from ..errors import not_found
from ..events import Run
from ..lanes import blocking
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
    plan = await service.sweepers.run(service.sweeps.submit, identity.owner, body, idempotency_key)
    shown = await service.lanes.run(_shown, service, plan)
    return JSONResponse(shown, 202, {"Location": f"/v1/sweeps/{plan.id}"})


@router.get("/v1/sweeps")
@blocking
def page(
    service: ServiceOf,
    identity: Reader,
    before: Annotated[str, Query(description="the id of a sweep: those older than it")] = "",
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
) -> dict[str, Any]:
    """Own sweeps, newest first; ``next`` is the ``before`` of the following page, null on the last."""
    plans = [plan for plan in service.sweeps.of(identity.owner) if not before or plan.id < before]
    following = plans[limit - 1].id if len(plans) > limit else None
    return {"sweeps": [_brief(service, plan) for plan in plans[:limit]], "next": following}


@router.get("/v1/sweeps/{sweep_id}")
@blocking
def show(service: ServiceOf, identity: Reader, sweep_id: str) -> dict[str, Any]:
    """The sweep: how many of its runs are in each state, and each point with its run."""
    return _shown(service, _find(service, identity, sweep_id))


_FORMULA = re.compile(r"[=@\t\r]|[+-](?!(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?( [^\W\d][\w*/^ -]*)?$)")
"""The beginning of a text that a spreadsheet computes. A number with a sign, and perhaps a unit, is not one."""


def cell(value: Any) -> Any:
    """A value of a CSV table. A text that a spreadsheet would compute gets an apostrophe, which makes it a text."""
    return f"'{value}" if isinstance(value, str) and _FORMULA.match(value) else value


@router.get("/v1/sweeps/{sweep_id}/table")
@blocking
def table(service: ServiceOf, identity: Reader, sweep_id: str) -> Response:
    """A line a point as CSV: what was changed, the state of the run, and its results as far as it has any."""
    plan = _find(service, identity, sweep_id)
    lines = [_line(service, point, run) for point, run in _pairs(service, plan)]
    out = io.StringIO()
    columns = list(dict.fromkeys(name for line in lines for name in line))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(cell(name) for name in columns)
    writer.writerows([cell(line.get(name, "")) for name in columns] for line in lines)
    return Response(out.getvalue(), media_type="text/csv; charset=utf-8")


@router.post("/v1/sweeps/{sweep_id}:cancel", status_code=202)
async def cancel(service: ServiceOf, identity: Submitter, sweep_id: str) -> dict[str, Any]:
    """Cancels every run of the sweep that has not ended. Asking again changes nothing."""
    return await service.sweepers.run(_cancelled, service, identity, sweep_id)


def _cancelled(service: Service, identity: Identity, sweep_id: str) -> dict[str, Any]:
    plan = _find(service, identity, sweep_id)
    for run_id in service.sweeps.cancel(plan):
        if service.supervisor.is_open(run_id):
            ask_to_stop(service, run_id)
    return _shown(service, plan)


def _find(service: Service, identity: Identity, sweep_id: str) -> Plan:
    plan = service.sweeps.get(sweep_id, identity.owner)
    if plan is None:
        raise not_found(f"sweep {sweep_id[:40]!r}")
    return plan


def _pairs(service: Service, plan: Plan) -> list[tuple[dict[str, Any], Run]]:
    """Each point with its run; without those whose folder has been removed, or of which nothing is known any more."""
    kept = service.store.some(plan.runs)
    found = [run for run_id in plan.runs if (run := service.supervisor.current(run_id) or kept.get(run_id))]
    left = {run.id: run for run in service.present.left(found)}
    return [(point, left[run_id]) for point, run_id in zip(plan.points, plan.runs, strict=False) if run_id in left]


def _brief(service: Service, plan: Plan) -> dict[str, Any]:
    return _headed(plan, _pairs(service, plan))


def _headed(plan: Plan, pairs: Sequence[tuple[dict[str, Any], Run]]) -> dict[str, Any]:
    states = Counter(run.state.value for _, run in pairs)
    return {
        "id": plan.id, "owner": plan.owner, "name": plan.name, "submitted": plan.submitted, "at_once": plan.at_once,
        "total": len(plan.points), "states": dict(states), "removed": len(plan.runs) - len(pairs),
        "url": f"/v1/sweeps/{plan.id}",
    }  # fmt: skip


def _shown(service: Service, plan: Plan) -> dict[str, Any]:
    pairs = _pairs(service, plan)
    lines = view.briefs(service, [run for _, run in pairs])
    points = [{"values": point, "run": line} for (point, _), line in zip(pairs, lines, strict=True)]
    return {**_headed(plan, pairs), "points": points}


def _line(service: Service, point: dict[str, Any], run: Run) -> dict[str, Any]:
    ended = view.outcome(service.settings.runs / run.id) if run.state.final else None
    values = {key: value if isinstance(value, int | float | str) else repr(value) for key, value in point.items()}
    return {**values, "run": run.id, "state": run.state.value, "cause": run.cause or "", **_results(ended)}


def _results(ended: Outcome | None) -> dict[str, Any]:
    """The numbers of an outcome that stand alone, the terms of the energy, the references, the last values of the
    probes; with units in brackets.
    """
    if ended is None:
        return {}
    names = ("elements", "nodes", "fragments", "broken", "eroded", "worst_residual")
    times = {f"{name} [s]": getattr(ended, name) for name in ("time", "elapsed", "cpu")}
    energy = {} if ended.energy is None else structs.asdict(ended.energy)
    terms = {_with_unit(f"energy.{name}", "" if name == "residual" else "J"): joule for name, joule in energy.items()}
    checks = {_with_unit(f"reference.{check.name}", check.unit): check.value for check in ended.reference}
    probes = {_with_unit(f"probe.{each.name}", each.unit): each.value for each in ended.probes}
    numbers = {"steps": ended.steps, **times, **{name: getattr(ended, name) for name in names}}
    found = {**numbers, **terms, **checks, **probes}
    return {**{name: "" if known(value) is None else value for name, value in found.items()}, "digest": ended.digest}


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
