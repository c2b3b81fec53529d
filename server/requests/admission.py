"""Middleware that reads the token of a request, and lets the request wait until it may begin (module
``request_order``). The limits of requests are in the module ``user_limits``.
"""

import hashlib
import time
from collections import OrderedDict
from typing import Any

from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..database.store import Token
from ..errors import ServiceError, database_away
from ..service import Service
from .request_order import RequestOrder
from .thread_pool import asking
from .tokens import check_token

ALIVE = "/healthz"
"""Path of the check whether the server process runs. Requests for it need no token and have no limits; they only wait
for their turn."""
LOCAL_OWNER = "local"
"""Owner of all runs on a server without access control."""
_SEEN = 1000
"""Number of tokens that are cached, those that were used last (chosen value)."""
_FRESH = 1.0
"""Time in s for which a token counts as valid before it is read from the database again; a revoked token is refused
after this time at the latest (chosen value)."""


class Admission:
    """Middleware for all requests. The application reads the token and the entry of the request (module
    ``user_limits``) from the state of the ASGI scope.
    """

    def __init__(self, app: ASGIApp, service: Service) -> None:
        self._app, self._service = app, service
        self._seen: OrderedDict[bytes, tuple[float, Token]] = OrderedDict()
        """Valid tokens by their hash: the time until which the token counts as valid, and the token. After this time a
        thread reads the token from the database again."""
        self._turns = RequestOrder()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers a refused request with status 429 or 503."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if scope["path"] == ALIVE:
            await self._turns.wait(_address(scope))
            await self._app(scope, receive, send)
            return
        began = False

        async def noted(message: Message) -> None:
            nonlocal began
            began = True
            await send(message)

        try:
            await self._enter(scope, receive, noted)
        except ServiceError as error:
            if began:
                raise
            await error.response()(scope, receive, send)

    async def _enter(self, scope: Scope, receive: Receive, send: Send) -> None:
        state: dict[str, Any] = scope.setdefault("state", {})
        token = state["token"] = await self._token(scope)
        who = self._who(scope, token)
        asking.set(who)
        if (connection := state.get("connection")) is not None:
            connection.owner = token.owner if token is not None else ""
        async with self._service.user_limits.place(who) as state["place"]:
            await self._app(scope, receive, send)

    def _who(self, scope: Scope, token: Token | None) -> str:
        if not self._service.settings.auth:
            return LOCAL_OWNER
        return token.owner if token is not None else _address(scope)

    async def _token(self, scope: Scope) -> Token | None:
        """Returns the token of the request; None if the request has no valid token. Raises ServiceError with status
        429, 503 or 507.
        """
        scheme, _, text = Headers(scope=scope).get("authorization", "").partition(" ")
        if not self._service.settings.auth:
            await self._turns.wait(LOCAL_OWNER)
            return None
        if scheme.lower() != "bearer":
            await self._turns.wait(_address(scope))
            return None
        shown = hashlib.sha256(text.strip().encode()).digest()
        until, known = self._seen.get(shown, (0.0, None))
        who = known.owner if known is not None else _address(scope)
        await self._turns.wait(who)
        if time.monotonic() < until:
            return known
        asking.set(who)
        try:
            token = await self._service.pool.run(check_token, self._service.store, text.strip())
        except SQLAlchemyError as error:
            raise database_away(error) from error
        self._note(shown, token)
        return token

    def _note(self, shown: bytes, token: Token | None) -> None:
        self._seen.pop(shown, None)
        if token is not None:
            self._seen[shown] = time.monotonic() + _FRESH, token
            if len(self._seen) > _SEEN:
                self._seen.popitem(last=False)


def _address(scope: Scope) -> str:
    """Returns a name for the network address of the client. The name contains a blank, so that it differs from all
    names of users.
    """
    client = scope.get("client")
    return f"address {client[0]}" if client else "address"
