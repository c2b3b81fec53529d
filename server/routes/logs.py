"""Routes for the log files of the ranks and of the launcher."""

import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi import Path as PathParameter
from fastapi.responses import StreamingResponse

from conoid.cases.output import layout

from ..answers import download, stream
from ..errors import ServiceError
from ..requests.auth import Pass, Reader
from ..requests.user_limits import place_of
from ..service import Service, ServiceOf
from .events import Seconds
from .runs import OwnedRun

router = APIRouter()
_CHUNK = 1 << 16
"""Number of bytes of a log file that are sent at once (chosen value)."""
ALIVE = b"\0"
"""Byte that is sent while a log that is followed gets no new text, so that proxies do not close the connection. Log
files do not contain it."""
_LOOK = 0.25
"""Time in s between two readings of a log that is followed."""
Rank = Annotated[str, PathParameter(pattern="^([0-9]{1,5}|launcher)$", description="a rank, or 'launcher'")]


@router.get("/v1/runs/{run_id}/logs/{rank}")
async def log(
    request: Request,
    run: OwnedRun,
    service: ServiceOf,
    identity: Reader,
    rank: Rank,
    follow: bool = False,
    seconds: Seconds = None,
) -> Response:
    """Sends the log file of one rank, or of the launcher; the header Range works as for other files. With the parameter
    ``follow`` the answer continues until the run has ended. After each 15 s without new text the server sends a byte 0,
    which is not part of the log file.
    """
    folder = service.settings.runs / run.id
    relative = f"{layout.LOGS}/{layout.LAUNCHER_LOG if rank == 'launcher' else f'rank-{rank}.log'}"
    if not follow or not service.supervisor.is_open(run.id):
        return await service.downloads.respond(request, folder, relative, run.state.final)
    if rank != "launcher" and int(rank) >= run.ranks:
        raise ServiceError(404, "not_found", f"rank {rank}: the run has ranks 0 to {run.ranks - 1}")
    place_of(request).lengthen()
    body = _follow(service, Pass(service, identity, seconds), run.id, folder, relative)
    return StreamingResponse(body, media_type="text/plain; charset=utf-8", headers=stream.HEADERS)


async def _follow(service: Service, may: Pass, run_id: str, folder: Path, relative: str) -> AsyncIterator[bytes]:
    """Yields the new bytes of a log file, without its zero bytes; yields a zero byte while there is no new text. The
    file need not exist yet.
    """
    offset, spoke = 0, time.monotonic()
    with service.wakeups.listen(run_id) as listener:
        while await may.holds():
            over = service.wakeups.closed or not service.supervisor.is_open(run_id)
            chunk = await service.pool.run(_read, folder, relative, offset)
            offset += len(chunk)
            if text := chunk.replace(ALIVE, b""):
                yield text
                spoke = time.monotonic()
            elif over and not chunk:
                return
            elif time.monotonic() - spoke >= stream.KEEP_ALIVE:
                yield ALIVE
                spoke = time.monotonic()
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
