"""Routes for events of a run from its journal: past events, and a live stream."""

from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi.responses import StreamingResponse

from conoid.cases.output import layout

from ..answers import stream
from ..errors import ServiceError
from ..requests.auth import Pass, Reader
from ..requests.thread_pool import blocking
from ..requests.user_limits import place_of
from ..runs import journal
from ..service import ServiceOf
from .runs import OwnedRun

router = APIRouter()
After = Annotated[int, Query(ge=0, description="the seq of the last event that is known")]

_PAGE = 1 << 20
"""Largest size in bytes of the events of one answer; an answer has at least one event. The answers of a user are in
memory until they are sent (reason of the chosen value)."""
Seconds = Annotated[
    float | None, Query(ge=0, le=86400, allow_inf_nan=False, description="s after which the answer ends; none: never")
]


@router.get("/v1/runs/{run_id}/events")
@blocking
def replay(
    run: OwnedRun, service: ServiceOf, after: After = 0, limit: Annotated[int, Query(ge=1, le=10_000)] = 1000
) -> Response:
    """Returns the events with ``seq`` above ``after``, oldest first: at most ``limit`` events, and at most about 1 MiB.
    ``last``: the number with which the next request begins; ``more``: whether there are more events now.
    """
    path = service.settings.runs / run.id / layout.JOURNAL
    found: list[journal.Line] = []
    size = 0
    for line in journal.lines(path, after):
        size += len(line.raw)
        if len(found) == limit or (found and size > _PAGE):
            return _page(found, after, more=True)
        found.append(line)
    return _page(found, after, more=False)


def _page(found: list[journal.Line], after: int, *, more: bool) -> Response:
    """Returns an answer with the journal lines as they are."""
    last = found[-1].seq if found else after
    body = b'{"events":[%s],"last":%d,"more":%s}' % (
        b",".join(line.raw for line in found),
        last,
        b"true" if more else b"false",
    )
    return Response(body, media_type="application/json")


@router.get("/v1/runs/{run_id}/stream")
async def follow(
    request: Request,
    run: OwnedRun,
    service: ServiceOf,
    identity: Reader,
    after: After = 0,
    last_event_id: Annotated[str | None, Header(json_schema_extra={"pattern": "^[0-9]{1,18}$"})] = None,
    seconds: Seconds = None,
) -> Response:
    """Sends server-sent events: past events after ``Last-Event-ID`` (or ``after``), then new events until the run ends.
    If the run has ended and no event is left, the status is 204; a browser then does not reconnect.
    """
    if last_event_id:
        if not last_event_id.isdecimal() or len(last_event_id) > 18:
            detail = f"Last-Event-ID {last_event_id[:40]!r}: the seq of an event, a whole number"
            raise ServiceError(400, "bad_parameter", detail, pointer="Last-Event-ID")
        after = int(last_event_id)
    path = service.settings.runs / run.id / layout.JOURNAL
    if not service.supervisor.is_open(run.id):
        tail = journal.Tail(path, after)
        if not await service.pool.run(tail.read):
            return Response(status_code=204)
    place_of(request).lengthen()
    body = stream.events(service, Pass(service, identity, seconds), run.id, path, after)
    return StreamingResponse(body, media_type=stream.MEDIA_TYPE, headers=stream.HEADERS)
