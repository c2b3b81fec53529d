"""Snapshots of the fragments of a run (docs/reference/snapshots.md)."""

from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Request, Response
from fastapi import Path as PathParameter

from conoid.cases import layout
from conoid.cases.messages import Snapshot

from .. import download, series
from ..errors import not_found
from ..events import Run
from ..lanes import blocking
from ..service import Service, ServiceOf
from .history import Known
from .runs import OwnedRun

router = APIRouter()
Number = Annotated[int, PathParameter(ge=0, le=10**9, description="the number of the snapshot")]
_TYPE = "application/octet-stream"
_BYTES: dict[int | str, dict[str, Any]] = {
    200: {"content": {_TYPE: {"schema": {"type": "string", "format": "binary"}}}, "description": "the snapshot"},
    304: {"description": "the one that is known"},
}
_decode = msgspec.json.Decoder(Snapshot).decode


@router.get("/v1/runs/{run_id}/snapshots")
@blocking
def listing(run: OwnedRun, service: ServiceOf, if_none_match: Known = "") -> Response:
    """The snapshots that the journal tells of: n, step, t in s, bytes, triangles, fragments, sha256 and more."""
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.catch_up()
        body = msgspec.json.encode({"snapshots": series.listed(found)})
    return download.tagged(body, if_none_match)


@router.get("/v1/runs/{run_id}/snapshots/{n}", responses=_BYTES, response_class=Response)
async def content(
    request: Request, run: OwnedRun, service: ServiceOf, n: Number, if_none_match: Known = ""
) -> Response:
    """One snapshot, as docs/reference/snapshots.md has it; its ETag is its sha256, and it never changes."""
    told = await service.lanes.run(_told, service, run, n)
    headers = {"ETag": f'"{told.sha256}"', "Cache-Control": "private, max-age=31536000, immutable"}
    if download.is_known(headers["ETag"], if_none_match):
        return Response(status_code=304, headers=headers)
    return await service.downloads.whole(request, service.settings.runs / run.id, told.path, headers, _TYPE)


def _told(service: Service, run: Run, n: int) -> Snapshot:
    """What the journal tells of a snapshot. Raises ServiceError 404."""
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        if n not in found.snapshots:
            found.catch_up()
        line = found.snapshots.get(n)
    if line is None:
        raise not_found(f"snapshot {n} of run {run.id}")
    return _decode(line)
