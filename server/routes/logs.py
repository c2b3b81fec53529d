"""What the ranks wrote for people."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi import Path as PathParameter
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from conoid.cases import layout

from .. import download
from ..auth import Pass, Reader
from ..errors import ServiceError
from ..service import Service, ServiceOf
from .events import Seconds
from .runs import OwnedRun

router = APIRouter()
_CHUNK = 1 << 16
"""Bytes of a log that are sent at once. Chosen."""
_LOOK = 0.25
"""s between two looks at a log that is being followed."""
Rank = Annotated[str, PathParameter(pattern=r"^(\d{1,5}|launcher)$", description="a rank, or 'launcher'")]


@router.head("/v1/runs/{run_id}/logs/{rank}", include_in_schema=False)
@router.get("/v1/runs/{run_id}/logs/{rank}")
def log(
    request: Request,
    run: OwnedRun,
    service: ServiceOf,
    identity: Reader,
    rank: Rank,
    follow: bool = False,
    seconds: Seconds = None,
) -> Response:
    """The log of one rank, or of the launcher; Range as for files. ``follow`` goes on until the run has ended."""
    folder = service.settings.runs / run.id
    relative = f"{layout.LOGS}/{layout.LAUNCHER_LOG if rank == 'launcher' else f'rank-{rank}.log'}"
    if not follow:
        return download.respond(request, folder, relative)
    if rank != "launcher" and int(rank) >= run.ranks:
        raise ServiceError(404, "not_found", f"rank {rank}: the run has ranks 0 to {run.ranks - 1}")
    may = Pass(service, identity, seconds)
    return StreamingResponse(_follow(service, may, run.id, folder, relative), media_type="text/plain; charset=utf-8")


async def _follow(service: Service, may: Pass, run_id: str, folder: Path, relative: str) -> AsyncIterator[bytes]:
    """The log's bytes as they come; it need not exist yet."""
    offset = 0
    with service.bell.listen(run_id) as listener:
        while await may.holds():
            over = service.bell.closed or not service.supervisor.is_open(run_id)
            chunk = await run_in_threadpool(_read, folder, relative, offset)
            offset += len(chunk)
            if chunk:
                yield chunk
            elif over:
                return
            else:
                listener.clear()
                await listener.wait(_LOOK)


def _read(folder: Path, relative: str, offset: int) -> bytes:
    try:
        file = download.open_inside(folder, relative)
    except ServiceError:
        return b""
    with file:
        file.seek(offset)
        return file.read(_CHUNK)
