"""The table of runs: all data of many runs that the page shows in one list."""

from dataclasses import replace
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Header, Query, Response

from ..answers import download, view
from ..answers.rows import Table
from ..requests.auth import Reader
from ..requests.thread_pool import blocking
from ..service import ServiceOf
from .list_query import ChosenOf
from .runs import Cursor, listed
from .sweeps import find

router = APIRouter()


@router.get("/v1/table")
@blocking
def table(
    service: ServiceOf,
    identity: Reader,
    chosen: ChosenOf,
    cursor: Cursor = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 500,
    changed: Annotated[
        float | None, Query(allow_inf_nan=False, description="open, or submitted or ended then or later, Unix s")
    ] = None,
    sweep: Annotated[str, Query(description="id of a sweep: the runs of its points")] = "",
    if_none_match: Annotated[str, Header(alias="If-None-Match")] = "",
) -> Response:
    """Returns the user's runs, newest first, with title, progress, values of the cases, and results.

    The field ``cases`` has groups of similar cases with common values and units. ``case`` of a run: index of its group;
    ``values``: values that differ from the common values of the group (null: the case of the run has no such key).
    ``results`` of a run have the order of the results of its group; null before the end of the run, and while the
    results are not read yet (``pending`` runs of this page: repeat the request). The field ``next`` is the cursor of
    the next page; ``next`` is null on the last page. An answer has at most 500 runs and about 4 MB.
    """
    asked = replace(chosen, changed=changed, runs=find(service, identity, sweep).runs if sweep else None)
    runs = listed(service, identity.owner, asked, cursor, limit + 1)
    cards, made = service.cards.of(runs[:limit]), Table()
    lines = view.briefs(service, runs[:limit])
    for line in lines:
        if not made.add({**line, "progress": service.supervisor.progress(line["id"])}, cards.get(line["id"])):
            break
    last = runs[len(made.rows) - 1] if len(made.rows) < len(runs) else None
    body: dict[str, Any] = {
        "runs": made.rows, "cases": [group.shown() for group in made.groups], "pending": made.pending,
        "next": view.to_cursor(last) if last is not None else None,
    }  # fmt: skip
    return download.tagged(msgspec.json.encode(body), if_none_match)
