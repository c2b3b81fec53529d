"""Routes for snapshots of the fragments of a run (docs/reference/snapshots.md)."""

from pathlib import Path
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Request, Response
from fastapi import Path as PathParameter

from conoid.cases.messages import Snapshot
from conoid.cases.output import layout

from ..answers import download, fragment_history, series
from ..errors import not_found
from ..requests.thread_pool import blocking
from ..runs.events import Run
from ..service import Service, ServiceOf
from .history import Known
from .runs import OwnedRun

router = APIRouter()
Label = Annotated[int, PathParameter(ge=0, le=2**63 - 1, description="the number of the fragment")]
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
    """Returns the snapshots that the journal reports: n, step, t in s, bytes, triangles, fragments, sha256 and more."""
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.catch_up()
        body = msgspec.json.encode({"snapshots": series.listed(found)})
    return download.tagged(body, if_none_match)


@router.get("/v1/runs/{run_id}/snapshots/{n}", responses=_BYTES, response_class=Response)
async def content(
    request: Request, run: OwnedRun, service: ServiceOf, n: Number, if_none_match: Known = ""
) -> Response:
    """Returns one snapshot in the format of docs/reference/snapshots.md. The ETag of a snapshot is its sha256; a
    snapshot never changes.
    """
    announced = await service.pool.run(_announced, service, run, n)
    return await _sent(request, service, run, announced.path, announced.bytes, announced.sha256, if_none_match)


@router.get("/v1/runs/{run_id}/snapshots/{n}/tets", responses=_BYTES, response_class=Response)
async def tets(request: Request, run: OwnedRun, service: ServiceOf, n: Number, if_none_match: Known = "") -> Response:
    """Returns all tets of a snapshot for sections, compressed by gzip; status 404 if the snapshot has no tets."""
    announced = await service.pool.run(_announced, service, run, n)
    if not announced.tets:
        raise not_found(f"the tets of snapshot {n} of run {run.id}")
    path = str(Path(announced.path).with_suffix(layout.TETS_SUFFIX))
    return await _sent(request, service, run, path, announced.tets, f"{announced.sha256}-tets", if_none_match)


@router.get("/v1/runs/{run_id}/fragments/{label}")
@blocking
def fragment(run: OwnedRun, service: ServiceOf, label: Label, if_none_match: Known = "") -> Response:
    """Returns the history of a fragment over at most 200 snapshots of a run: n, t in s, mass in kg, speed in m/s, size
    in m, number of tets.
    """
    folder = service.settings.runs / run.id
    found = service.histories.of(folder / layout.JOURNAL)
    with found.lock:
        found.catch_up()
        announced = [_decode(found.snapshots[n]) for n in sorted(found.snapshots)]
    return download.tagged(msgspec.json.encode(fragment_history.course(folder, announced, label)), if_none_match)


async def _sent(
    request: Request, service: Service, run: Run, path: str, size: int, tag: str, known: str
) -> Response:  # fmt: skip
    """Sends a file of ``size`` bytes that never changes. ``tag``: ETag of the file; ``known``: ETag that the client
    has.
    """
    headers = {"ETag": f'"{tag}"', "Cache-Control": "private, max-age=31536000, immutable"}
    if download.is_known(headers["ETag"], known):
        return Response(status_code=304, headers=headers)
    return await service.downloads.whole(request, service.settings.runs / run.id, path, size, headers, _TYPE)


def _announced(service: Service, run: Run, n: int) -> Snapshot:
    """Returns the journal message about snapshot ``n``. Raises ServiceError with status 404 if the run has no such
    snapshot.
    """
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        if n not in found.snapshots:
            found.catch_up()
        line = found.snapshots.get(n)
    if line is None:
        raise not_found(f"snapshot {n} of run {run.id}")
    return _decode(line)
