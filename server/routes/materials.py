"""The route for the material library."""

from functools import cache

import msgspec
from fastapi import APIRouter, Response

from conoid.cases.reading.library import constants, library

from ..answers.schemas.materials import LibraryConstant, LibraryMaterial, Materials
from ..requests.auth import Reader
from ..requests.thread_pool import blocking
from ..service import ServiceOf

router = APIRouter()


@router.get("/v1/materials")
@blocking
def materials(service: ServiceOf, identity: Reader) -> Response:
    """Returns the material library of the server: each constant with its confidence and source."""
    return Response(_materials(), media_type="application/json")


@cache
def _materials() -> bytes:
    """Returns the material library; the answer is made once, because the library does not change while a server
    runs.
    """
    listed = [
        LibraryMaterial(
            name=name,
            description=made.description,
            law="" if made.strength is None else made.strength.model,
            constants=[
                LibraryConstant(key=one.key, value=one.value, confidence=one.confidence, source=one.cited)
                for one in constants(name)
            ],
        )
        for name, made in library().items()
    ]
    return msgspec.json.encode(Materials(materials=listed))
