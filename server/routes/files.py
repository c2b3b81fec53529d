"""A run's folder, to list and to download."""

from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, Request, Response

from .. import download
from ..service import ServiceOf
from .runs import OwnedRun

router = APIRouter()


@router.get("/v1/runs/{run_id}/files")
def listing(run: OwnedRun, service: ServiceOf) -> dict[str, Any]:
    """Every file of the run: path, size in bytes, time of the last change. HEAD of a file gives its sha256."""
    entries = download.listing(service.settings.runs / run.id)
    return {"files": [{**asdict(entry), "url": f"/v1/runs/{run.id}/files/{entry.path}"} for entry in entries]}


@router.head("/v1/runs/{run_id}/files/{path:path}", include_in_schema=False)
@router.get("/v1/runs/{run_id}/files/{path:path}")
def content(request: Request, run: OwnedRun, path: str, service: ServiceOf) -> Response:
    """One file, whole or a Range of it; ETag, and its sha256 in Repr-Digest."""
    return download.respond(request, service.settings.runs / run.id, path)
