"""Cases: the check before anything runs, and the gallery that comes with Conoid."""

import json
from typing import Annotated, Any

from fastapi import APIRouter, Header, Response
from starlette.concurrency import run_in_threadpool

from conoid.cases import reference
from conoid.cases.load import CaseError, read_case, shipped

from .. import openapi
from ..auth import Reader, Submitter
from ..errors import entry, not_found
from ..service import ServiceOf
from .runs import Body

router = APIRouter()


@router.post("/v1/cases:validate", openapi_extra=openapi.CASE_BODY)
async def validate(
    service: ServiceOf,
    identity: Submitter,
    body: Body,
    content_type: Annotated[str, Header(include_in_schema=False)] = "",
) -> dict[str, Any]:
    """Whether the case could be submitted: every problem at once, or warnings, estimate, the case with all defaults."""
    try:
        async with service.turns.turn(identity.owner):
            reading = await run_in_threadpool(service.desk.read, body, content_type)
    except CaseError as error:
        return {"valid": False, "problems": [entry(problem) for problem in error.problems]}
    odd = [entry(doubt) for doubt in reading.doubts]
    case = json.loads(reading.case)
    return {"valid": True, "problems": [], "warnings": odd, "estimate": reading.estimate, "case": case}


@router.get("/v1/case.schema.json")
def schema() -> Response:
    """The JSON schema of a case: the file that the first line of a shipped case names. Asks for no token."""
    return Response(reference.schema_text(), media_type="application/schema+json")


@router.get("/v1/cases")
def gallery(identity: Reader) -> dict[str, Any]:
    """The shipped cases."""
    cases = {name: read_case(path) for name, path in shipped().items()}
    return {
        "cases": [
            {"name": name, "title": case.title, "description": case.description, "url": f"/v1/cases/{name}"}
            for name, case in cases.items()
        ]
    }


@router.get("/v1/cases/{name}")
def shipped_case(identity: Reader, name: str) -> Response:
    """The TOML of a shipped case, ready to be changed and submitted."""
    path = shipped().get(name)
    if path is None:
        raise not_found(f"case {name[:80]!r}")
    return Response(path.read_bytes(), media_type="application/toml")
