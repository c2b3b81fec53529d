"""Routes for cases: the check of a case before its submission, and the shipped cases."""

import json
from functools import cache
from typing import Annotated, Any

from fastapi import APIRouter, Header, Response
from msgspec import to_builtins

from conoid.cases.load import CaseError, read_case, read_data, shipped
from conoid.cases.reading.files import files_of
from conoid.cases.reference import json_schema

from ..answers import openapi
from ..errors import entry, not_found
from ..intake.copies import names_files
from ..intake.reading import WrongCaseError
from ..requests.auth import Reader, Submitter
from ..requests.thread_pool import blocking
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
    """Checks a case without submitting it. Returns every problem of an invalid case; for a valid case returns warnings,
    estimate, the case with all defaults, and a survey of its mesh files. The answer always contains ``files``, the list
    of the files that the case names.
    """
    try:
        pool, desk = service.surveyors if names_files(body) else service.readers, service.desk
        reading = await pool.run(desk.read, body, content_type, desk.source(identity.owner))
    except CaseError as error:
        files = error.files if isinstance(error, WrongCaseError) else []
        problems = [entry(problem) for problem in error.problems]
        return {"valid": False, "problems": problems, "files": [to_builtins(file) for file in files]}
    odd = [entry(doubt) for doubt in reading.doubts]
    case = json.loads(reading.case)
    survey = {"survey": json.loads(reading.survey)} if reading.survey else {}
    files = [to_builtins(file) for file in reading.files]
    return {
        "valid": True, "problems": [], "warnings": odd, "estimate": reading.estimate, "case": case, "files": files,
        **survey,
    }  # fmt: skip


@router.get("/v1/case.schema.json")
@blocking
def schema(service: ServiceOf) -> Response:
    """Returns the JSON schema of a case. The first line of a shipped case names the address of the schema; the request
    needs no token.
    """
    return Response(_schema(), media_type="application/schema+json")


@router.get("/v1/cases")
@blocking
def gallery(service: ServiceOf, identity: Reader) -> Response:
    """Returns the shipped cases."""
    return Response(_gallery(), media_type="application/json")


@router.get("/v1/cases/{name}")
@blocking
def shipped_case(service: ServiceOf, identity: Reader, name: str) -> Response:
    """Returns the TOML text of a shipped case, ready to be changed and submitted."""
    path = shipped().get(name)
    if path is None:
        raise not_found(f"case {name[:80]!r}")
    return Response(path.read_bytes(), media_type="application/toml")


@router.get("/v1/cases/{name}/files/{file}")
@blocking
def shipped_file(service: ServiceOf, identity: Reader, name: str, file: str) -> Response:
    """Returns a file that a shipped case names."""
    path = shipped().get(name)
    if path is None or file not in {named.path for named in files_of(read_data(path))}:
        raise not_found(f"file {file[:80]!r} of case {name[:80]!r}")
    return Response(path.with_name(file).read_bytes(), media_type="application/octet-stream")


@cache
def _schema() -> str:
    return json_schema.schema_text()


@cache
def _gallery() -> bytes:
    """Returns the shipped cases; the list is made once, because it does not change while a server runs."""
    cases = {name: read_case(path) for name, path in shipped().items()}
    entries = [
        {"name": name, "title": case.title, "description": case.description, "url": f"/v1/cases/{name}"}
        for name, case in cases.items()
    ]
    return json.dumps({"cases": entries}).encode()
