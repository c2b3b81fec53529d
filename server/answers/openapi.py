"""The OpenAPI document of the routes. The document has the schema of each answer, and the schema of a case, whose
request body FastAPI sees only as bytes.
"""

import math
from functools import cache
from typing import Any

import msgspec
from fastapi import FastAPI

from conoid.cases.reference import json_schema

from . import schemas

_CASE = "#/components/schemas/Case"
CASE_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "application/toml": {"schema": {"type": "string", "description": f"A case in TOML; its keys: {_CASE}"}},
            "application/json": {"schema": {"$ref": _CASE}},
        },
    }
}
"""Request body of routes that take a case."""


SWEEP_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Wish"}}},
    }
}
"""Request body of the route that takes a sweep."""
SEARCH_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Search"}}},
    }
}
"""Request body of the route that takes the report of an adaptive sweep."""
FILE_BODY: dict[str, Any] = {
    "parameters": [
        {
            "name": "Content-Range", "in": "header", "required": False, "schema": {"type": "string"},
            "description": "bytes FIRST-LAST/SIZE: a piece, which begins at Upload-Offset; without it the whole file",
        }
    ],
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    },
}  # fmt: skip
"""Request body of the route that takes a file."""
_JSON, _PROBLEM, _BYTES = "application/json", "application/problem+json", "application/octet-stream"
_TEXT, _FILE = "text/plain", "*/*"
ANSWERS: dict[tuple[str, str], dict[int, tuple[str, str]]] = {
    ("post", "/v1/cases:validate"): {200: (_JSON, "Validation")},
    ("get", "/v1/case.schema.json"): {200: ("application/schema+json", "")},
    ("get", "/v1/cases"): {200: (_JSON, "Gallery")},
    ("get", "/v1/cases/{name}"): {200: ("application/toml", "")},
    ("get", "/v1/cases/{name}/files/{file}"): {200: (_BYTES, "")},
    ("get", "/v1/materials"): {200: (_JSON, "Materials")},
    ("post", "/v1/runs"): {202: (_JSON, "Receipt")},
    ("get", "/v1/runs"): {200: (_JSON, "RunPage")},
    ("get", "/v1/table"): {200: (_JSON, "Table"), 304: ("", "")},
    ("get", "/v1/runs/{run_id}"): {200: (_JSON, "RunStatus"), 304: ("", "")},
    ("delete", "/v1/runs/{run_id}"): {204: ("", "")},
    ("post", "/v1/runs/{run_id}:keep"): {200: (_JSON, "RunStatus")},
    ("post", "/v1/runs/{run_id}:release"): {200: (_JSON, "RunStatus")},
    ("post", "/v1/runs/{run_id}:cancel"): {202: (_JSON, "RunStatus")},
    ("post", "/v1/runs/{run_id}:restart"): {202: (_JSON, "Receipt")},
    ("post", "/v1/runs/{run_id}:checkpoint"): {202: (_JSON, "RunStatus")},
    ("post", "/v1/runs/{run_id}:report"): {200: (_JSON, "Report")},
    ("post", "/v1/runs/{run_id}:snapshot"): {202: (_JSON, "RunStatus")},
    ("get", "/v1/runs/{run_id}/events"): {200: (_JSON, "EventPage")},
    ("get", "/v1/runs/{run_id}/stream"): {200: ("text/event-stream", ""), 204: ("", "")},
    ("get", "/v1/runs/{run_id}/history"): {200: (_JSON, "History"), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/columns"): {200: (_JSON, "History"), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/snapshots"): {200: (_JSON, "Snapshots"), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/snapshots/{n}"): {200: (_BYTES, ""), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/snapshots/{n}/tets"): {200: (_BYTES, ""), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/fragments/{label}"): {200: (_JSON, "FragmentCourse"), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/logs/{rank}"): {200: (_TEXT, ""), 206: (_TEXT, ""), 304: ("", "")},
    ("get", "/v1/runs/{run_id}/files"): {200: (_JSON, "Files")},
    ("get", "/v1/runs/{run_id}/files/{path}"): {200: (_FILE, ""), 206: (_FILE, ""), 304: ("", "")},
    ("get", "/v1/files"): {200: (_JSON, "SentFiles")},
    ("get", "/v1/files/{sha256}"): {200: (_JSON, "SentFile")},
    ("put", "/v1/files/{sha256}"): {200: (_JSON, "SentFile"), 201: (_JSON, "SentFile")},
    ("delete", "/v1/files/{sha256}"): {204: ("", "")},
    ("post", "/v1/sweeps"): {202: (_JSON, "Sweep")},
    ("put", "/v1/sweeps/adaptive/{name}"): {200: (_JSON, "Reported")},
    ("get", "/v1/sweeps"): {200: (_JSON, "SweepPage")},
    ("get", "/v1/sweeps/{sweep_id}"): {200: (_JSON, "Sweep")},
    ("get", "/v1/sweeps/{sweep_id}/table"): {200: ("text/csv", "")},
    ("post", "/v1/sweeps/{sweep_id}:again"): {202: (_JSON, "Sweep")},
    ("post", "/v1/sweeps/{sweep_id}:cancel"): {202: (_JSON, "Sweep")},
    ("get", "/v1/me"): {200: (_JSON, "Me")},
    ("get", "/healthz"): {200: (_JSON, "Health")},
    ("get", "/readyz"): {200: (_JSON, "Health"), 503: (_JSON, "Health")},
    ("get", "/metrics"): {200: (_TEXT, "")},
}
"""Successful answer of each route: status, media type, and the schema of a JSON answer."""
_OPEN = {"/v1/case.schema.json", "/healthz", "/readyz"}
_REFUSALS = {
    400: "a parameter is wrong", 401: "no valid token", 403: "the token lacks the scope", 404: "there is none",
    408: "the body did not arrive in time", 409: "not in this state", 410: "the run's folder has been removed",
    411: "the length is missing", 413: "the body is too large", 415: "not a type of a case",
    416: "no such range", 422: "the case is wrong",
    429: "too many requests of the user are in progress or wait", 500: "the server failed", 501: "packages are missing",
    503: "not now",
    507: "the disk is full",
}  # fmt: skip


def refusals(method: str, path: str) -> set[int]:
    """Returns the error statuses of a route."""
    found = {400, 500, 503} | (set() if path in _OPEN else {401, 403}) | (set() if path == "/healthz" else {429})
    if "{" in path:
        found |= {404}
    if "{run_id}" in path:
        found |= {410}
    if method == "post" and "{" not in path:
        found |= {408, 410, 413, 415, 422, 429, 507}
    if method == "put":
        found |= {408, 409, 411, 413, 415, 422, 507}
    if path.endswith((":checkpoint", ":snapshot")) or (method == "delete" and "{run_id}" in path):
        found |= {409}
    if path.endswith(":restart"):
        found |= {409, 415, 422, 429, 507}
    if path.endswith(":report"):
        found |= {409, 501, 507}
    if path.endswith((":keep", ":release")):
        found |= {507}
    if path.endswith(("{path}", "{rank}")):
        found |= {416}
    return found


def install(app: FastAPI) -> None:
    """Completes the OpenAPI document of ``app``: adds the schema of a case, the schema of each answer, each status, and
    the token.
    """
    own = app.openapi

    @cache
    def openapi() -> dict[str, Any]:
        made = own()
        case = json_schema.json_schema("#/components/schemas/{model}")
        _, answers = msgspec.json.schema_components(schemas.ALL, ref_template="#/components/schemas/{name}")
        for schema in answers.values():
            _mark_null(schema.get("properties", {}))
        made["components"] = {
            "schemas": {**case.pop("$defs"), "Case": case, **answers},
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        }
        for path, operations in made["paths"].items():
            for method, operation in operations.items():
                _complete(operation, method, path)
        return made

    app.openapi = openapi  # type: ignore[method-assign]


def _mark_null(properties: dict[str, dict[str, Any]]) -> None:
    """Marks numbers with the default NaN as nullable, because JSON has no NaN and an unknown number is null."""
    for schema in properties.values():
        default = schema.get("default")
        if isinstance(default, float) and math.isnan(default):
            schema |= {"type": ["number", "null"], "default": None}


def _complete(operation: dict[str, Any], method: str, path: str) -> None:
    operation["security"] = [] if path in _OPEN else [{"token": []}]
    answers = ANSWERS[method, path]
    operation["responses"] = {
        **{str(status): _answer(_PROBLEM, "Problem", _REFUSALS[status]) for status in sorted(refusals(method, path))},
        **{str(status): _answer(kind, shape, "") for status, (kind, shape) in answers.items()},
    }


def _answer(kind: str, shape: str, words: str) -> dict[str, Any]:
    if not kind:
        return {"description": "nothing new"}
    schema = {"$ref": f"#/components/schemas/{shape}"} if shape else {}
    return {"description": words or shape or kind, "content": {kind: {"schema": schema}}}
