"""Routes for the user of the request, and for the resources that the server offers to the user."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request

from ..errors import ServiceError
from ..requests.auth import Identity, identify
from ..requests.connections import BODY
from ..requests.thread_pool import blocking
from ..service import Service, ServiceOf
from ..settings import loopback
from ..telemetry import TelemetryError

router = APIRouter()


@router.get("/v1/me")
@blocking
def me(request: Request, service: ServiceOf, identity: Annotated[Identity, Depends(identify)]) -> dict[str, Any]:
    """Returns name and scopes of the user, access to Zenoh (null: no access), slots, limits of a case (``caps``),
    limits of requests and long answers, quota and used quota.
    """
    caps = service.settings.caps
    return {
        "owner": identity.owner,
        "scopes": sorted(identity.token.scopes) if identity.token else ["metrics", "read", "submit"],
        "zenoh": _zenoh(request, service, identity),
        "slots": {"total": service.settings.slots, "used": service.supervisor.slots_used()},
        "limits": {
            "body_bytes": BODY,
            "ranks": service.settings.slots,
            "elements": caps.elements,
            "steps": caps.steps,
            "memory_bytes": caps.memory,
            "core_seconds": caps.core_seconds,
            "wall_time": caps.wall_time,
            "output_bytes": caps.output_bytes,
            "file_bytes": service.settings.site.files.size,
            **{name: getattr(service.settings.site.http, name) for name in ("requests", "waiting", "streams")},
        },
        "quota": _quota(service),
        "used": _used(service, identity.owner),
    }


def _quota(service: Service) -> dict[str, float | None]:
    """Returns the quota of the user; null: no limit."""
    quota = service.settings.site.quota
    named = {name: getattr(quota, name) for name in quota.__struct_fields__}
    files = service.settings.site.files
    return {**named, "queued": service.settings.caps.queued, "file_bytes": files.bytes, "files": files.number}


def _used(service: Service, owner: str) -> dict[str, float]:
    running, seconds = service.supervisor.taken(owner)
    files = service.uploads.of(owner)
    return {
        "queued": service.store.open_runs(owner),
        "running": running,
        "core_seconds": seconds,
        "output_bytes": service.removal.kept_now(owner),
        "file_bytes": sum(file.size for file in files),
        "files": len(files),
    }


def _zenoh(request: Request, service: Service, identity: Identity) -> dict[str, Any] | None:
    """Returns the Zenoh endpoint, with the host name that the client has used for this server; null without Zenoh."""
    host = request.url.hostname or "127.0.0.1"
    hidden = loopback(service.settings.host) and not loopback(host)
    if service.telemetry is None or hidden or not identity.allows("read"):
        return None
    try:
        reader = service.telemetry.reader(identity.owner, identity.token)
    except TelemetryError as error:
        raise ServiceError(503, "unavailable", str(error), retryable=True) from None
    return {
        "endpoint": f"tcp/{f'[{host}]' if ':' in host else host}:{reader.port}",
        "prefix": reader.prefix,
        "user": reader.user or None,
        "password": reader.password or None,
    }
