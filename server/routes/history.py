"""Routes for the history of a run, with a limited number of points. A page draws the history before it reads the
stream of events."""

from typing import Annotated

import msgspec
from fastapi import APIRouter, Header, Query, Response

from conoid.cases.output import layout

from ..answers import download, series
from ..answers.columns import Columns
from ..errors import ServiceError
from ..requests.thread_pool import blocking
from ..service import ServiceOf
from .runs import OwnedRun

router = APIRouter()
Known = Annotated[str, Header(alias="If-None-Match")]


@router.get("/v1/runs/{run_id}/history")
@blocking
def history(
    run: OwnedRun,
    service: ServiceOf,
    points: Annotated[int, Query(ge=1, le=4096, description="reports, at most")] = 1000,
    if_none_match: Known = "",
) -> Response:
    """Returns the reports of a run, reduced to ``points``: ``series`` by name over ``t`` (step, dt, counts,
    imbalance, each term of the energy, shares of the phases of a step as ``share_...``), ``ranks`` with CPU seconds
    by phase and rank, all balance events (``balance``) and ``snapshots``, the ``log`` and its ``warnings``,
    ``state``, and ``elapsed`` wall time in s. The stream continues after ``last``.
    """
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.catch_up()
        return download.tagged(series.body(found, points), if_none_match)


@router.get("/v1/runs/{run_id}/columns")
@blocking
def columns(
    run: OwnedRun,
    service: ServiceOf,
    name: Annotated[list[str], Query(description="columns whose values are sent besides those of t; all: `*`")] = [],  # noqa: B006
    points: Annotated[int, Query(ge=1, le=8192, description="lines, about as many at most")] = 1000,
    if_none_match: Known = "",
) -> Response:
    """Returns history.csv: unit, last value, minimum and maximum of each column of numbers (``columns``), and the
    ``values`` of the named columns, with t in s. A file with more ``lines`` than ``points`` is reduced: each group
    of lines becomes two values of each column, its minimum and maximum in the order of their occurrence. ``behind``:
    the file is long, and the next answer has more of it. A run without the file has no columns.
    """
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.columns.catch_up()
        return download.tagged(_columns(found.columns, name, points), if_none_match)


def _columns(found: Columns, names: list[str], points: int) -> bytes:
    """Raises ServiceError 400 for an unknown name of a column."""
    known = found.units
    if known and (strange := next((name for name in names if name not in known and name != "*"), None)):
        detail = f"name = {strange[:80]!r}: columns of numbers are: {', '.join(known)}"
        raise ServiceError(400, "bad_parameter", detail[:2000], pointer="name")
    chosen = list(known) if "*" in names else ["t", *names] if names else []
    values = found.values(chosen, points)
    body = {"lines": found.lines, "behind": found.behind, "columns": found.statistics(), "values": values}
    return msgspec.json.encode(body)
