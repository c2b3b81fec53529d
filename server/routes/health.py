"""For those who watch the server itself."""

import time
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Response
from fastapi.responses import JSONResponse

from conoid.cases.run import State

from ..auth import Identity, requires
from ..service import ServiceOf

router = APIRouter()


@router.get("/healthz")
def alive() -> dict[str, str]:
    """The process answers."""
    return {"status": "ok"}


@router.get("/readyz")
def ready(service: ServiceOf) -> Response:
    """Runs can be taken and looked after: 200, or 503 with what is wrong."""
    checks = {"supervisor": service.supervisor.alive, **service.readiness.checks()}
    body: dict[str, Any] = {"status": "ok" if all(checks.values()) else "unavailable", "checks": checks}
    return JSONResponse(body, 200 if all(checks.values()) else 503)


@router.get("/metrics")
def metrics(service: ServiceOf, identity: Annotated[Identity, Depends(requires("metrics"))]) -> Response:
    """Counts in the text form that Prometheus reads."""
    counts = service.store.count_by_state()
    lines = ["# HELP conoid_runs Runs by state.", "# TYPE conoid_runs gauge"]
    lines += [f'conoid_runs{{state="{state}"}} {counts.get(state, 0)}' for state in State]
    for name, kind, text, value in (
        ("conoid_slots", "gauge", "Ranks that may run at a time.", service.settings.slots),
        ("conoid_slots_used", "gauge", "Ranks that run now.", service.supervisor.slots_used()),
        ("conoid_listeners", "gauge", "Open event streams and waiting requests.", service.bell.listening),
        ("process_cpu_seconds_total", "counter", "CPU time of the server.", time.process_time()),
    ):
        lines += [f"# HELP {name} {text}", f"# TYPE {name} {kind}", f"{name} {value}"]
    return Response("\n".join(lines) + "\n", media_type="text/plain; version=0.0.4; charset=utf-8")
