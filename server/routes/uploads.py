"""Files that cases name: what the server has of a user's, and the way in. Nobody sees what another one has sent."""

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
    """Own files, whole and on their way: sha256, size, how much of it is there, when each was last wanted."""
    found = service.uploads.of(identity.owner)
    return {"files": [_shown(sent) for sent in found], "bytes": sum(sent.size for sent in found)}


@router.get("/v1/files/{sha256}")
@blocking
def show(service: ServiceOf, identity: Submitter, sha256: Hash) -> Response:
    """How much of a file is there. ``offset`` (Upload-Offset) is the byte with which a PUT goes on."""
    found = service.uploads.find(identity.owner, sha256)
    if found is None:
        raise not_found(f"file {sha256} of yours")
    return _answer(found)


@router.put("/v1/files/{sha256}", openapi_extra=openapi.FILE_BODY)
async def put(request: Request, service: ServiceOf, identity: Submitter, sha256: Hash) -> Response:
    """Takes a file, or the next piece of it (Content-Range), as it is. It is there, under its hash, when the answer is
    201; 200: it was there, or is not whole yet. What has arrived stays when the connection breaks.
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
    """Removes a file, or what has arrived of it. Runs keep their own."""
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
