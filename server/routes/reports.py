"""The route for the report of a run, which is one HTML file."""

from typing import Any

from fastapi import APIRouter, Request

from conoid.cases.output import report as form

from ..errors import ServiceError
from ..requests.auth import Submitter
from ..requests.user_limits import place_of
from ..service import ServiceOf
from .runs import find

router = APIRouter()


@router.post("/v1/runs/{run_id}:report")
async def report(request: Request, run_id: str, service: ServiceOf, identity: Submitter) -> dict[str, Any]:
    """Makes the report of a run that has ended: one HTML file that needs no server; answers when the file is among the
    run's files. The report of a run is made once. The server makes one report at a time, with limits of CPU time,
    memory and size. If the report cannot be made, the answer in the next ten minutes is the reason, without another
    attempt.
    """
    run = await service.pool.run(find, service, identity, run_id)
    if not run.state.final:
        raise ServiceError(409, "not_ended", f"run {run.id} is {run.state.value}; a run that has ended has a report")
    service.desk.check_output(run.owner)
    place_of(request).lengthen()
    size = await service.reporters.size_of(service.settings.runs / run.id)
    return {"path": form.NAME, "size": size, "url": f"/v1/runs/{run.id}/files/{form.NAME}"}
