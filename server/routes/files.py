"""A run's folder, to list and to download."""

from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, Request, Response

from .. import download
from ..lanes import blocking
from ..service import ServiceOf
from .runs import OwnedRun

router = APIRouter()


@router.get("/v1/runs/{run_id}/files")
@blocking
def listing(run: OwnedRun, service: ServiceOf) -> dict[str, Any]:
    """Every file of the run: path, size in bytes, time of the last change. HEAD of a file gives its sha256."""
    entries = download.listing(service.settings.runs / run.id)
    return {"files": [{**asdict(entry), "url": f"/v1/runs/{run.id}/files/{entry.path}"} for entry in entries]}


@router.get("/v1/runs/{run_id}/files/{path:path}")
async def content(request: Request, run: OwnedRun, path: str, service: ServiceOf) -> Response:
    """One file, whole or a Range of it; ETag, and in Repr-Digest its sha256, unless it is large and its run goes on."""
    return await service.downloads.respond(request, service.settings.runs / run.id, path, run.state.final)
