"""The history of a run, thinned: what a page draws before it follows the stream."""

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
    """The reports of a run, thinned to ``points``: ``series`` by name over ``t`` (step, dt, counts, imbalance, each
    term of the energy, and as ``share_...`` the phases of the step), ``ranks`` with CPU seconds by phase and rank, all
    cuts (``balance``) and ``snapshots``, the ``log`` and its ``warnings``, ``state``, and ``elapsed`` wall time in s.
    The stream goes on from ``last``.
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
    """history.csv: of each column of numbers the unit and the last, least and greatest value (``columns``), and the
    ``values`` of those that are named, with t in s. Where there are more than ``points`` ``lines``, groups of them are
    two lines each: of every column the least and the greatest value, in the order in which they come. ``behind``: the
    file is long and not all of it has been read, the next answer has more. No column while there is no file.
    """
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.columns.catch_up()
        return download.tagged(_columns(found.columns, name, points), if_none_match)


def _columns(found: Columns, names: list[str], points: int) -> bytes:
    """Raises ServiceError 400 for a name that no column has."""
    known = found.units
    if known and (strange := next((name for name in names if name not in known and name != "*"), None)):
        detail = f"name = {strange[:80]!r}: columns of numbers are: {', '.join(known)}"
        raise ServiceError(400, "bad_parameter", detail[:2000], pointer="name")
    chosen = list(known) if "*" in names else ["t", *names] if names else []
    values = found.values(chosen, points)
    body = {"lines": found.lines, "behind": found.behind, "columns": found.statistics(), "values": values}
    return msgspec.json.encode(body)
