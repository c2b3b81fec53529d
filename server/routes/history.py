"""Routes for the history of a run, with a limited number of points. A page draws the history before it reads the stream
of events.
"""

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
    """Returns the reports of a run, reduced to about ``points`` times. ``series``: columns by name over the time ``t``:
    step, dt, counts, imbalance, each term of the energy, and the share of each phase in the time of a step as
    ``share_...``. ``ranks``: CPU time in s by phase and rank; ``balance``: all balance events; ``elapsed``: wall time
    in s; ``warnings``: the warnings of the ``log``. ``snapshots``: the messages about snapshots; ``state``: the state
    of the run. The stream of events continues after the event ``last``.
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
    """Returns history.csv: unit, last value, minimum and maximum of each numeric column (``columns``), and the
    ``values`` of the named columns, with t in s. A file with more ``lines`` than ``points`` is reduced: each group of
    lines becomes two values of each column, the minimum and the maximum in the order of their occurrence. ``behind``:
    whether part of a long file has not been read yet; the next answer contains more of the file. The answer for a run
    without history.csv has no columns.
    """
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.columns.catch_up()
        return download.tagged(_columns(found.columns, name, points), if_none_match)


def _columns(found: Columns, names: list[str], points: int) -> bytes:
    """Returns the answer of the route. Raises ServiceError with status 400 if a column is unknown."""
    known = found.units
    if known and (strange := next((name for name in names if name not in known and name != "*"), None)):
        detail = f"name = {strange[:80]!r}: columns of numbers are: {', '.join(known)}"
        raise ServiceError(400, "bad_parameter", detail[:2000], pointer="name")
    chosen = list(known) if "*" in names else ["t", *names] if names else []
    values = found.values(chosen, points)
    body = {"lines": found.lines, "behind": found.behind, "columns": found.statistics(), "values": values}
    return msgspec.json.encode(body)
