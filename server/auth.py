"""Who asks, and what they may: dependencies that give the routes an identity, or refuse."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from .errors import ServiceError
from .service import Service, ServiceOf
from .settings import loopback
from .store import Token
from .tokens import SCOPES, check_token

LOCAL_OWNER = "local"
"""Owns all runs of a server without access control."""


@dataclass(frozen=True)
class Identity:
    """Who asks."""

    owner: str
    token: Token | None
    """None on a server without access control."""

    def allows(self, scope: str) -> bool:
        """True when the token carries ``scope``."""
        return self.token is None or scope in self.token.scopes


def identify(request: Request, service: ServiceOf) -> Identity:
    """The identity behind a request. Raises ServiceError 401."""
    if not service.settings.auth:
        _same_machine_page(request)
        return Identity(LOCAL_OWNER, None)
    scheme, _, text = request.headers.get("authorization", "").partition(" ")
    token = check_token(service.store, text.strip()) if scheme.lower() == "bearer" else None
    if token is None:
        raise ServiceError(
            401, "unauthorized", "this needs a valid token", headers={"WWW-Authenticate": "Bearer"},
            hint="send the header 'Authorization: Bearer <token>'; the server's operator makes tokens",
        )  # fmt: skip
    return Identity(token.owner, token)


def _same_machine_page(request: Request) -> None:
    """Without tokens a web page from elsewhere must not reach the server through the user's browser."""
    host = request.url.hostname or ""
    if not loopback(host):
        raise ServiceError(403, "forbidden", f"Host {host!r}: a server without tokens answers on loopback names only")
    origin = request.headers.get("origin")
    if origin is not None and origin != f"{request.url.scheme}://{request.url.netloc}":
        raise ServiceError(403, "forbidden", f"Origin {origin!r}: pages of other sites may not use this server")


def requires(scope: str) -> Callable[[Identity], Identity]:
    """A dependency that gives the identity. Raises ServiceError 401, or 403 when the token lacks ``scope``."""

    def check(identity: Annotated[Identity, Depends(identify)]) -> Identity:
        if not identity.allows(scope):
            detail = f"the token lacks the scope {scope!r} ({SCOPES[scope]})"
            raise ServiceError(403, "forbidden", detail, hint="ask the server's operator for a token that has it")
        return identity

    return check


Reader = Annotated[Identity, Depends(requires("read"))]
Submitter = Annotated[Identity, Depends(requires("submit"))]


def still_valid(service: Service, identity: Identity) -> bool:
    """False once the token behind a long answer has been revoked."""
    return identity.token is None or service.store.token(identity.token.id) is not None
