"""Routes for the files of a run's folder: list and download."""

import os
from dataclasses import asdict
from typing import Any
from urllib.parse import quote, unquote_to_bytes

from fastapi import APIRouter, Request, Response
from starlette.convertors import PathConvertor, register_url_convertor

from ..answers import download
from ..requests.thread_pool import blocking
from ..runs.events import Run
from ..service import ServiceOf
from .runs import OwnedRun


class _AnyPath(PathConvertor):
    """Part of an address that may contain any characters, also line feeds, because names of files may contain them."""

    regex = "(?s:.*)"


register_url_convertor("path", _AnyPath())
router = APIRouter()
_BEFORE = 5
"""Number of slashes in an address before the path of a file."""


@router.get("/v1/runs/{run_id}/files")
@blocking
def listing(run: OwnedRun, service: ServiceOf) -> dict[str, Any]:
    """Returns every file of the run: path, size in bytes, time of the last change. The answer to a HEAD request for a
    file contains its SHA-256 hash.
    """
    entries = download.listing(service.settings.runs / run.id)
    return {"files": [_line(run, entry) for entry in entries]}


def _line(run: Run, entry: download.Entry) -> dict[str, Any]:
    """Returns a file of the list as JSON. Bytes of its name that are not UTF-8 are written as ``\xff`` in ``path``;
    ``url`` has the exact name.
    """
    name = os.fsencode(entry.path)
    return {
        **asdict(entry), "path": name.decode(errors="backslashreplace"),
        "url": f"/v1/runs/{run.id}/files/{quote(name)}",
    }  # fmt: skip


@router.get("/v1/runs/{run_id}/files/{path:path}")
async def content(request: Request, run: OwnedRun, path: str, service: ServiceOf) -> Response:
    """Sends one file, whole or in part (header Range), with ETag and, in the header Repr-Digest, its sha256. The answer
    for a large file of an open run has no Repr-Digest.
    """
    relative = os.fsdecode(unquote_to_bytes(request.scope["raw_path"]).split(b"/", _BEFORE)[-1])
    return await service.downloads.respond(request, service.settings.runs / run.id, relative, run.state.final)
