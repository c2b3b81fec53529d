"""For those who watch the server itself."""

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
    """The process answers, whatever it waits for."""
    return {"status": "ok"}


@router.get("/readyz")
async def ready(service: ServiceOf) -> Response:
    """Runs can be taken and looked after: 200, or 503 with what is wrong."""
    checks = {"supervisor": service.supervisor.alive, **await service.readiness.checks()}
    body: dict[str, Any] = {"status": "ok" if all(checks.values()) else "unavailable", "checks": checks}
    return JSONResponse(body, 200 if all(checks.values()) else 503)


@router.get("/metrics")
@blocking
def metrics(
    request: Request, service: ServiceOf, identity: Annotated[Identity, Depends(requires("metrics"))]
) -> Response:
    """Runs, slots, answers and their times in the text form that Prometheus reads."""
    found: Metrics = request.app.state.metrics
    return Response(found.text(), media_type=CONTENT_TYPE_PLAIN_0_0_4)
