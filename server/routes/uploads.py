"""Routes for uploaded files, which cases may name. Users cannot see the uploads of other users."""

from typing import Annotated, Any

from fastapi import APIRouter, Request, Response
from fastapi import Path as PathParameter
from fastapi.responses import JSONResponse

from ..answers import openapi
from ..errors import not_found
from ..intake.uploads import Upload
from ..requests.auth import Pass, Submitter, unauthorized
from ..requests.thread_pool import blocking
from ..service import ServiceOf

router = APIRouter()
Hash = Annotated[str, PathParameter(pattern="^[0-9a-f]{64}$", description="the sha256 of the file")]


@router.get("/v1/files")
@blocking
def listing(service: ServiceOf, identity: Submitter) -> dict[str, Any]:
    """Returns the user's uploaded files, complete and incomplete: sha256, size, arrived bytes, time of the last
    request.
    """
    found = service.uploads.of(identity.owner)
    return {"files": [_shown(sent) for sent in found], "bytes": sum(sent.size for sent in found)}


@router.get("/v1/files/{sha256}")
@blocking
def show(service: ServiceOf, identity: Submitter, sha256: Hash) -> Response:
    """Returns the state of an upload. The field ``offset`` (header Upload-Offset) is the byte with which the next PUT
    continues.
    """
    found = service.uploads.find(identity.owner, sha256)
    if found is None:
        raise not_found(f"file {sha256} of yours")
    return _answer(found)


@router.put("/v1/files/{sha256}", openapi_extra=openapi.FILE_BODY)
async def put(request: Request, service: ServiceOf, identity: Submitter, sha256: Hash) -> Response:
    """Receives an uploaded file, or the next piece of a file (Content-Range), as raw bytes. Status 201: the file is
    complete under its hash; 200: the file existed before, or is not complete yet. Bytes that have arrived are kept when
    the connection breaks.
    """
    may = Pass(service, identity)

    async def check() -> None:
        if not await may.holds():
            raise unauthorized()

    found, fresh = await service.receiver.receive(request, identity.owner, sha256, check)
    return _answer(found, 201 if fresh else 200)


@router.delete("/v1/files/{sha256}")
@blocking
def remove(service: ServiceOf, identity: Submitter, sha256: Hash) -> Response:
    """Removes an uploaded file, complete or incomplete. Runs keep their own copies of the file."""
    if not service.uploads.remove(identity.owner, sha256):
        raise not_found(f"file {sha256} of yours")
    return Response(status_code=204)


def _answer(sent: Upload, status: int = 200) -> Response:
    headers = {
        "Upload-Offset": str(sent.offset), "Upload-Length": str(sent.size),
        "Upload-Complete": "?1" if sent.whole else "?0", "Cache-Control": "no-store",
    }  # fmt: skip
    return JSONResponse(_shown(sent), status, headers)


def _shown(sent: Upload) -> dict[str, Any]:
    return {
        "sha256": sent.sha256, "size": sent.size, "offset": sent.offset, "whole": sent.whole, "asked": sent.asked,
        "url": f"/v1/files/{sent.sha256}",
    }  # fmt: skip
