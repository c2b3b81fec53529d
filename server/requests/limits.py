"""Checks of a request before it uses resources: unknown parameters, large bodies, cases above a limit, a full queue, a
full disk.
"""

import asyncio
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

import msgspec
from fastapi import Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from starlette.requests import ClientDisconnect

from conoid.cases.estimates.cores import threads_of
from conoid.cases.estimates.estimate import Estimate
from conoid.cases.figures import count, crew, number, size
from conoid.cases.model.schema import Case
from conoid.cases.reading.files import files_of
from conoid.cases.reading.problems import Problem, problem, shown
from conoid.cases.reading.similar import allowed
from conoid.cases.site.policy import Quota

from ..errors import ServiceError
from ..settings import Caps, Settings
from .connections import BODY

_BODY_TIMEOUT = 30.0
"""Time in s for a whole request body (chosen value); a body of 1 MiB arrives in this time at 35 kB/s."""


_COUNTABLE = 1 << 53
"""Number that stands for a missing limit in messages: the largest integer that every JSON reader supports (IEEE
754)."""


async def check_query(request: Request) -> None:
    """Raises ServiceError with status 400 for an unknown parameter, and for a parameter that is given twice but can
    have only one value. An unknown parameter may be a misspelt one, which would otherwise be ignored.
    """
    if not request.query_params:
        return
    route: APIRoute = request.scope["route"]
    fields = {field.alias: field for field in _query(route.dependant)}
    known = sorted(fields)
    for name, values in Counter(name for name, _ in request.query_params.multi_items()).items():
        if values > 1 and name in fields and not _many(fields[name].field_info.annotation):
            detail = f"{name} = {shown(request.query_params[name])}: it has one value, and is given {values} times"
            raise ServiceError(400, "bad_parameter", detail, pointer=name)
        if name not in known:
            detail = f"{name[:80]}: {request.url.path} has no such parameter; {allowed(name, known)}"
            raise ServiceError(400, "bad_parameter", detail, pointer=name[:80])


def _many(annotation: Any) -> bool:
    """Whether a query parameter of this type may be given several times."""
    return any(get_origin(each) is list for each in (annotation, *get_args(annotation)))


def _query(dependant: Dependant) -> Iterator[Any]:
    """Yields the query parameters of a route, from FastAPI."""
    yield from dependant.query_params
    for inner in dependant.dependencies:
        yield from _query(inner)


async def read_body(request: Request) -> bytes:
    """Returns the body of a request, of at most ``BODY`` bytes. Raises ServiceError with status 415 for an encoded
    body, 413 for a large body, 408 for a slow body, and 400 for an incomplete body.
    """
    check_encoding(request)
    length = request.headers.get("content-length", "0")
    if length.isdigit() and int(length) > BODY:
        raise _too_large(int(length))
    try:
        return await asyncio.wait_for(_collect(request), _BODY_TIMEOUT)
    except TimeoutError:
        raise ServiceError(408, "timeout", "the body did not arrive in time", retryable=True) from None
    except ClientDisconnect:
        raise ServiceError(400, "incomplete", "the request body was interrupted", retryable=True) from None


def check_encoding(request: Request) -> None:
    """Raises ServiceError with status 415 for an encoded request body, because its decoded size is not known."""
    encoding = request.headers.get("content-encoding", "identity").strip().lower()
    if encoding not in {"", "identity"}:
        detail = f"Content-Encoding {encoding[:80]!r}: a request body must not be encoded"
        headers = {"Accept-Encoding": "identity"}
        raise ServiceError(415, "unsupported_encoding", detail, pointer="Content-Encoding", headers=headers)


async def _collect(request: Request) -> bytes:
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > BODY:
            raise _too_large(len(body))
    return bytes(body)


def _too_large(length: int) -> ServiceError:
    return ServiceError(413, "too_large", f"the body has {length} bytes or more; allowed: {BODY}")


class Limits(msgspec.Struct, frozen=True):
    """The resources that a case needs, and the limits of this server; None: no limit."""

    slots: int
    elements: int | None
    steps: int | None
    memory: int | None
    core_seconds: float | None
    wall_time: float | None
    threads: int | None = None
    """Threads of each rank of a run whose case gives none; None: as many as the free cores and the number of tets
    allow."""


def of(settings: Settings) -> Limits:
    """Returns the resource limits of a site."""
    caps = settings.caps
    memory = min((most for most in (caps.memory, settings.site.queue.memory) if most is not None), default=None)
    threads = settings.site.queue.threads or (1 if settings.site.launcher == "slurm" else None)
    return Limits(settings.slots, caps.elements, caps.steps, memory, caps.core_seconds, caps.wall_time, threads)


def check(case: Case, limits: Limits) -> list[Problem]:
    """Returns all problems that a valid case has with the limits of this server."""
    return [*_cores(case, limits), *_files(case), *_time(case, limits)]


def on_threads(case: Case, tets: int | None, limits: Limits) -> Case:
    """Returns the case with a number of threads; the case stays unchanged if it gives one."""
    run = case.run
    if "threads" in run.model_fields_set:
        return case
    wanted = threads_of(run.ranks, limits.slots, tets) if limits.threads is None else limits.threads
    threads = min(wanted, limits.slots // run.ranks)
    return case.model_copy(update={"run": run.model_copy(update={"threads": threads})})


def check_size(estimate: Estimate, caps: Limits) -> list[Problem]:
    """Returns a problem for each resource of which the case needs more than the limit. A need that is not known gives
    no problem.
    """
    needs = (
        ("parts", "elements", count, estimate.elements, caps.elements),
        ("run.end_time", "steps", count, estimate.steps, caps.steps),
        ("parts", "of memory", size, estimate.memory_bytes, caps.memory),
        ("run.end_time", "core-seconds", number, estimate.core_seconds, caps.core_seconds),
    )
    return [
        Problem(key, "", f"the case needs about {shown(value)} {what}; this server allows {shown(cap or _COUNTABLE)}")
        for key, what, shown, value, cap in needs
        if value is not None and value > (_COUNTABLE if cap is None else cap)
    ]


def _cores(case: Case, settings: Limits) -> Iterator[Problem]:
    run, slots = case.run, settings.slots
    if run.ranks > slots:
        yield Problem("run.ranks", str(run.ranks), f"this server has {slots} slots; allowed: 1 to {slots}")
    elif run.cores > slots:
        message = f"{crew(run.ranks, run.threads)} take {run.cores} slots, and this server has {slots}"
        yield Problem("run.threads", str(run.threads), f"{message}; allowed: 1 to {slots // run.ranks}")


def _files(case: Case) -> Iterator[Problem]:
    """Yields a problem for each file for which the case gives no hash. The paths in the case are valid only on the
    machine on which the case was written.
    """
    for file in files_of(case.model_dump(include={"parts"})):
        if file.sha256 is None:
            message = "this key is missing: a server finds a file by its hash; conoid submit adds this key"
            yield problem((*file.table, "sha256"), ..., message)


def _time(case: Case, caps: Limits) -> Iterator[Problem]:
    asked, cap = case.run.max_wall_time, caps.wall_time
    if asked is not None and cap is not None and asked > cap:
        yield Problem("run.max_wall_time", f"{asked:g} s", f"this server allows {cap:g} s")


def figures(estimate: Estimate) -> dict[str, int | float]:
    """Returns the numbers of an estimate that are known: elements, nodes, dt, steps, memory_bytes, core_seconds, and
    seconds (wall time). If parts can break, also dust_bytes.
    """
    values = {
        "elements": estimate.elements,
        "nodes": estimate.nodes,
        "dt": estimate.dt,
        "steps": estimate.steps,
        "memory_bytes": estimate.memory_bytes,
        "core_seconds": estimate.core_seconds,
        "seconds": None if estimate.clock is None else estimate.clock.seconds,
        "dust_bytes": estimate.dust_bytes or None,
    }
    return {name: value for name, value in values.items() if value is not None}


def wall_time(case: Case, caps: Limits) -> float | None:
    """Returns the wall time in s after which the run is stopped; None: the run has no time limit."""
    cost = None if caps.core_seconds is None else caps.core_seconds / case.run.cores
    asked = [limit for limit in (case.run.max_wall_time, caps.wall_time, cost) if limit is not None]
    return min(asked) if asked else None


def later(code: str, detail: str, hint: str | None = None) -> ServiceError:
    """Returns the error with status 429: a user has reached a limit. The client may repeat the request later."""
    return ServiceError(429, code, detail, hint=hint, retryable=True, headers={"Retry-After": "60"})


def check_output(kept: int, quota: Quota) -> None:
    """Raises ServiceError with status 429 if the folders of the owner's runs have reached their limit. ``kept``: size
    in bytes of the folders of the owner's runs.
    """
    if quota.output_bytes is not None and kept >= quota.output_bytes:
        detail = f"your runs have {size(kept)} on disk; this server allows {size(quota.output_bytes)}: remove some"
        raise later("output_quota", detail)


def check_room(runs: Path, open_runs: int, caps: Caps, more: int = 1) -> None:
    """Raises ServiceError if ``more`` new runs would exceed a limit. Status 429: the owner would have too many open
    runs; 422: the new runs alone are too many; 507: the disk is nearly full.
    """
    if more > max(1, caps.queued):
        raise ServiceError(422, "invalid_sweep", f"{more} points; this server allows {caps.queued} open runs of a user")
    if open_runs + more > caps.queued:
        new = f", and the sweep has {more}" if more > 1 else ""
        detail = f"{open_runs} of your runs have not ended{new}; this server allows {caps.queued}"
        raise later("queue_full", detail)
    free = shutil.disk_usage(runs).free
    if free < caps.free_disk:
        detail = f"{size(free)} are free on the server's disk; {size(caps.free_disk)} must stay free"
        raise ServiceError(507, "disk_full", detail, retryable=True)
