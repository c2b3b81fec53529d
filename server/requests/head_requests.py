"""HEAD requests for every route with GET. The answer has the headers of GET, is sent at once, and has no body."""

import anyio
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class HeadRequests:
    """Middleware that handles HEAD: it calls the app with GET and ends the answer after the headers, for any length of
    the body.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles a HEAD request. Any other request is passed on unchanged."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        with anyio.CancelScope() as answer:

            async def first(message: Message) -> None:
                if message["type"] == "http.response.start" and not answer.cancel_called:
                    await send(message)
                    await send({"type": "http.response.body", "body": b"", "more_body": False})
                    answer.cancel()

            await self._app({**scope, "method": "GET"}, receive, first)
