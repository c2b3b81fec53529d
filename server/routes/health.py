"""Routes for health and metrics of the server."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import JSONResponse
from prometheus_client import CONTENT_TYPE_PLAIN_0_0_4

from ..answers.metrics import Metrics
from ..requests.auth import Identity, requires
from ..requests.thread_pool import blocking
from ..service import ServiceOf

router = APIRouter()


@router.get("/healthz")
async def alive() -> dict[str, str]:
    """Returns status 200 if the server process can answer requests."""
    return {"status": "ok"}


@router.get("/readyz")
async def ready(service: ServiceOf) -> Response:
    """Returns status 200 if runs can be accepted and supervised, else status 503 with the failed checks."""
    checks = {"supervisor": service.supervisor.alive, **await service.readiness.checks()}
    body: dict[str, Any] = {"status": "ok" if all(checks.values()) else "unavailable", "checks": checks}
    return JSONResponse(body, 200 if all(checks.values()) else 503)


@router.get("/metrics")
@blocking
def metrics(
    request: Request, service: ServiceOf, identity: Annotated[Identity, Depends(requires("metrics"))]
) -> Response:
    """Returns the metrics in the text form of Prometheus: runs, slots, number of answers and their durations."""
    found: Metrics = request.app.state.metrics
    return Response(found.text(), media_type=CONTENT_TYPE_PLAIN_0_0_4)
