"""HEAD requests for every route with GET. The answer to a HEAD request has the headers of the answer to GET and no
body.
"""

import anyio
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class HeadRequests:
    """Middleware for HEAD requests: calls the application with GET and ends the answer after the headers."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles a HEAD request; passes any other request on unchanged."""
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
