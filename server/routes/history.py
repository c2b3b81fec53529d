"""The history of a run, thinned: what a page draws before it follows the stream."""

from typing import Annotated

from fastapi import APIRouter, Header, Query, Response

from conoid.cases import layout

from .. import download, series
from ..lanes import blocking
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
    cuts (``balance``) and ``snapshots``, ``state``, and ``elapsed`` wall time in s. The stream goes on from ``last``.
    """
    found = service.histories.of(service.settings.runs / run.id / layout.JOURNAL)
    with found.lock:
        found.catch_up()
        return download.tagged(series.body(found, points), if_none_match)
