"""Authentication: dependencies that give a route the identity of the caller and check its scopes."""

import math
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request
from sqlalchemy.exc import SQLAlchemyError

from ..database.store import Token
from ..errors import ServiceError
from ..service import Service, ServiceOf
from ..settings import loopback
from .admission import LOCAL_OWNER
from .tokens import SCOPES

RECHECK = 2.0
"""Time in s after which the token of a long answer is checked again (chosen value). A streamed answer ends 5 s after
the revocation of its token at the latest."""


@dataclass(frozen=True)
class Identity:
    """The caller: the owner of runs, and the token of the request."""

    owner: str
    token: Token | None
    """Token of the caller; None on a server without access control."""

    def allows(self, scope: str) -> bool:
        """True if the token has the scope ``scope``."""
        return self.token is None or scope in self.token.scopes


async def identify(request: Request, service: ServiceOf) -> Identity:
    """Returns the identity of the caller; the middleware ``admission`` has already read the token. Raises ServiceError
    with status 401 without a valid token.
    """
    if not service.settings.auth:
        _same_machine_page(request)
        return Identity(LOCAL_OWNER, None)
    token: Token | None = request.scope["state"]["token"]
    if token is None:
        raise unauthorized()
    return Identity(token.owner, token)


def unauthorized() -> ServiceError:
    """Returns the error for a request without a valid token."""
    return ServiceError(
        401, "unauthorized", "this needs a valid token", headers={"WWW-Authenticate": "Bearer"},
        hint="send the header 'Authorization: Bearer <token>'; the server's operator makes tokens",
    )  # fmt: skip


def _same_machine_page(request: Request) -> None:
    """Refuses a request that a page of another web site sends through the user's browser to a server without tokens."""
    host = request.url.hostname or ""
    if not loopback(host):
        raise ServiceError(403, "forbidden", f"Host {host!r}: a server without tokens answers on loopback names only")
    origin = request.headers.get("origin")
    if origin is not None and origin != f"{request.url.scheme}://{request.url.netloc}":
        raise ServiceError(403, "forbidden", f"Origin {origin!r}: pages of other sites may not use this server")


def requires(scope: str) -> Callable[[Identity], Awaitable[Identity]]:
    """Returns a FastAPI dependency that gives the identity of the caller. The dependency raises ServiceError with
    status 401, or with 403 if the token lacks the scope ``scope``.
    """

    async def check(identity: Annotated[Identity, Depends(identify)]) -> Identity:
        if not identity.allows(scope):
            detail = f"the token lacks the scope {scope!r} ({SCOPES[scope]})"
            raise ServiceError(403, "forbidden", detail, hint="ask the server's operator for a token that has it")
        return identity

    return check


Reader = Annotated[Identity, Depends(requires("read"))]
Submitter = Annotated[Identity, Depends(requires("submit"))]


class Pass:
    """Limits a long answer to the time for which its token is valid, and to ``seconds`` if given."""

    def __init__(self, service: Service, identity: Identity, seconds: float | None = None) -> None:
        self._service, self._identity = service, identity
        self._looked = time.monotonic()
        self._ends = math.inf if seconds is None else self._looked + seconds

    @property
    def left(self) -> float:
        """Time until the token is checked again, s."""
        return max(0.0, min(RECHECK, self._ends - time.monotonic()))

    async def holds(self) -> bool:
        """Whether the token is still valid and the time limit has not passed."""
        now = time.monotonic()
        if now >= self._ends:
            return False
        if now - self._looked < RECHECK:
            return True
        self._looked = now
        return await self._service.pool.run(self._valid)

    def _valid(self) -> bool:
        """Whether the database still has the token of the request. If the database does not answer, the token counts as
        valid.
        """
        token = self._identity.token
        try:
            return token is None or self._service.store.token(token.id) is not None
        except SQLAlchemyError:
            return True
