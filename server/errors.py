"""Refusals and failures of the server as RFC 9457 problem+json.

::

    ServiceError            anything below
    ├── invalid_case        the case is wrong; every error at once
    ├── not_found, unauthorized, forbidden, ...
    └── unavailable         the same request may succeed later
"""

import logging
import re
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from fastapi.routing import APIRoute
from sqlalchemy.exc import SQLAlchemyError
from starlette.exceptions import HTTPException

from conoid.cases.reading.problems import Problem

from .runs.retries import DAMAGE

MEDIA_TYPE = "application/problem+json"
_log = logging.getLogger("conoid.server")
_CODES = {400: "bad_request", 401: "unauthorized", 404: "not_found", 405: "method_not_allowed"}


class ServiceError(Exception):
    """An HTTP answer with an error. ``detail``: a text of one line for users; ``code``: a fixed word for programs."""

    def __init__(
        self,
        status: int,
        code: str,
        detail: str,
        *,
        pointer: str | None = None,
        hint: str | None = None,
        retryable: bool = False,
        errors: Sequence[Problem] = (),
        headers: Mapping[str, str] | None = None,
        outcome: Mapping[str, Any] | None = None,
    ) -> None:
        """Creates the exception. ``pointer``: JSON pointer into the request body, or name of a parameter or header;
        ``outcome``: the record of a run that was removed.
        """
        super().__init__(detail)
        self.status, self.headers = status, dict(headers or {})
        body: dict[str, Any] = {
            "type": f"urn:conoid:problem:{code}",
            "title": HTTPStatus(status).phrase,
            "status": status,
            "detail": detail,
            "code": code,
            "retryable": retryable,
        }
        if pointer is not None:
            body["pointer"] = pointer
        if hint is not None:
            body["hint"] = hint
        if errors:
            body["errors"] = [entry(problem) for problem in errors]
        if outcome is not None:
            body["outcome"] = dict(outcome)
        self.body = body

    def response(self) -> Response:
        """Returns the answer as problem+json."""
        return JSONResponse(self.body, self.status, self.headers, MEDIA_TYPE)


def invalid_case(problems: Sequence[Problem]) -> ServiceError:
    """Returns the error with status 422 for a case; ``detail`` and ``pointer`` describe its first problem, ``errors``
    lists all problems.
    """
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    first = problems[0]
    return ServiceError(
        422, "invalid_case", f"{first}{more}", pointer=json_pointer(first.key) if first.key else None, errors=problems
    )


def not_found(what: str) -> ServiceError:
    """Returns the error with status 404. The text is the same for an unknown run and for a run of another user."""
    return ServiceError(404, "not_found", f"{what}: there is none")


def entry(problem: Problem) -> dict[str, str]:
    """Returns a problem of a case as JSON."""
    return {
        "key": problem.key, "value": problem.value, "message": problem.message, "pointer": json_pointer(problem.key),
    }  # fmt: skip


def json_pointer(key: str) -> str:
    """Returns the JSON pointer of a key, for example ``#/parts/0/mesh/radius`` for ``parts[0].mesh.radius``; ``#`` for
    the whole body.
    """
    items = [item for item in re.split(r"[.\[\]]+", key) if item]
    return "#" + "".join(f"/{item}" for item in items)


def install(app: FastAPI) -> None:
    """Registers handlers with which ``app`` answers every error as problem+json."""
    app.add_exception_handler(ServiceError, _service_error)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(RequestValidationError, _parameter_error)
    app.add_exception_handler(SQLAlchemyError, _database)
    app.add_exception_handler(OSError, _storage)
    app.add_exception_handler(Exception, _crash)


async def _service_error(_: Request, error: Exception) -> Response:
    assert isinstance(error, ServiceError)
    return error.response()


async def _http_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    code = _CODES.get(error.status_code, "error")
    detail = f"{request.method} {request.url.path}: {error.detail}"
    headers = error.headers
    if error.status_code == 405:
        headers = {"Allow": allowed(request.app, request.url.path) or "GET, HEAD"}
    return ServiceError(error.status_code, code, detail, headers=headers).response()


def allowed(app: FastAPI, path: str) -> str:
    """Returns the HTTP methods of the routes for a path. If the patterns of several routes match the path, the longest
    pattern counts. The result is empty if no route matches the path.
    """
    found: dict[str, set[str]] = {}
    for router in app.state.routers:
        for route in router.routes:
            if isinstance(route, APIRoute) and route.path_regex.match(path):
                methods = route.methods or set()
                found.setdefault(route.path, set()).update(methods, {"HEAD"} if "GET" in methods else ())
    return ", ".join(sorted(found[max(found, key=len)])) if found else ""


async def _parameter_error(_: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    name = str(first["loc"][-1])
    detail = f"{name} = {str(first.get('input'))[:80]!r}: {first['msg']}"
    return ServiceError(400, "bad_parameter", detail, pointer=name).response()


async def _storage(request: Request, error: Exception) -> Response:
    """Answers an error of the operating system: a file cannot be read at present, or is damaged."""
    assert isinstance(error, OSError)
    _log.error("%s %s: %s", request.method, request.url.path, error)
    detail = f"a file of the run cannot be used: {error.strerror or error}"
    return ServiceError(503, "unavailable", detail, retryable=error.errno not in DAMAGE).response()


async def _database(request: Request, error: Exception) -> Response:
    """Answers an error of the database: it is locked by another process, full, or not reachable. The client may repeat
    the request later.
    """
    _log.error("%s %s: the database cannot be used: %s", request.method, request.url.path, error)
    return database_away(error).response()


def database_away(error: Exception) -> ServiceError:
    """Returns the error for a database that cannot be used: status 507 for a full disk, 503 for any other cause."""
    reason = str(error).splitlines()[0]
    if "disk is full" in reason:
        return ServiceError(507, "storage", "the disk of the server's database is full", retryable=True)
    detail = "the server's database cannot be used now"
    return ServiceError(503, "unavailable", detail, retryable=True, headers={"Retry-After": "5"})


async def _crash(request: Request, error: Exception) -> Response:
    """Answers an unexpected exception with status 500; the log of the server contains the traceback."""
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    detail = "the server failed to answer; its log has the reason"
    return ServiceError(500, "internal", detail, retryable=True).response()
