"""Requests to a server over HTTP, and refusals as one clear line."""

import base64
import hashlib
import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self, TypeVar

import httpx2
import msgspec

from conoid.cases.messages import AnyMessage

from .errors import UnreachableError, UsageError, refusal
from .journal import from_line

T = TypeVar("T")

_ANSWER, _CONNECTION = 30.0, 5.0
"""s: an answer may take a while when a disk is slow, a connection may not. Chosen."""
_TIMEOUT = httpx2.Timeout(_ANSWER, connect=_CONNECTION)
_STREAM_TIMEOUT = httpx2.Timeout(60.0, connect=_CONNECTION)
"""s of silence on a stream: four times the 15 s after which the server sends a comment (server/stream.py)."""
UNAUTHORIZED = 401
"""HTTP's status of a request without a valid token."""
_TRIES = 3
"""Times a request is sent that may be repeated, 0.3 and 0.6 s apart. Chosen: a lost connection is back by then."""


class Router(msgspec.Struct, kw_only=True, frozen=True):
    """Where the Zenoh router is, and the user and password to show it (neither: it asks for none)."""

    endpoint: str
    user: str | None = None
    password: str | None = None


class Me(msgspec.Struct, kw_only=True, frozen=True):
    """Who the server takes us for, what the token allows, and how to subscribe over Zenoh (None: not possible)."""

    owner: str
    scopes: list[str] = []
    zenoh: Router | None = None


class Http:
    """A server that answers requests. Use it as a context manager, or close it."""

    def __init__(self, url: str, token: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        """Connects at the first request. ``transport`` replaces the network, for a server in the same process.

        Raises ClientError for a token, UnreachableError for an address, that cannot be one.
        """
        shown = (token or "").strip()
        if not _visible(shown):
            raise UsageError("token: only visible ASCII characters are allowed; was it copied whole?")
        headers = {"Authorization": f"Bearer {shown}"} if shown else {}
        self.url = url.rstrip("/")
        self._has_token = bool(shown)
        try:
            self._http = httpx2.Client(base_url=self.url, headers=headers, timeout=_TIMEOUT, transport=transport)
        except httpx2.InvalidURL as error:
            raise UnreachableError(f"url = {self.url!r}: {error}") from None

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the connections."""
        self.close()

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def me(self) -> Me:
        """Who we are to the server."""
        return self.get(Me, "/v1/me")

    def get(self, kind: type[T], path: str, **query: str | float | list[str]) -> T:
        """The answer at ``path``; a list gives its name several times. Raises ServiceError, UnreachableError."""
        return self._decoded(kind, self._request("GET", path, params=query))

    def post(
        self, kind: type[T], path: str, body: bytes = b"", content: str = "", key: str | None = None,
        more: float = 0.0,
    ) -> T:  # fmt: skip
        """The answer to a POST. It is tried again, when the network fails, only with an idempotency key. ``more``: s
        that the answer may take beyond what others may.
        """
        headers = {"Content-Type": content} if content else {}
        if key is not None:
            if not _visible(key):
                raise UsageError(f"Idempotency-Key {key[:80]!r}: 1 to 255 visible ASCII characters")
            headers["Idempotency-Key"] = key
        timeout = httpx2.Timeout(_ANSWER + more, connect=_CONNECTION)
        response = self._request("POST", path, content=body, headers=headers, repeat=key is not None, timeout=timeout)
        return self._decoded(kind, response)

    def delete(self, path: str) -> None:
        """Removes what is at ``path``. Raises ServiceError, UnreachableError."""
        self._request("DELETE", path)

    def fetch(self, path: str) -> bytes:
        """The body at ``path``. Raises ServiceError, UnreachableError."""
        return self._request("GET", path).content

    def download(self, path: str, target: Path) -> None:
        """Writes the body at ``path`` to a file that appears whole, with the server's sha256, or not at all.

        Raises ServiceError, UnreachableError, and OSError with the name of the file.
        """
        target.parent.mkdir(parents=True, exist_ok=True)
        beside = target.with_name(f".{target.name}.part")
        try:
            with self._opened("GET", path) as response, beside.open("wb") as file:
                digest = hashlib.sha256()
                for chunk in response.iter_bytes():
                    digest.update(chunk)
                    file.write(chunk)
            told = response.headers.get("Repr-Digest")
            if told is not None and told != f"sha-256=:{base64.b64encode(digest.digest()).decode()}:":
                raise UnreachableError(f"{path} arrived damaged: its sha256 is not the one that the server told")
            beside.replace(target)
        except OSError as error:
            error.filename = str(target)
            raise
        finally:
            beside.unlink(missing_ok=True)

    def stream(self, path: str, after: int = 0) -> Iterator[AnyMessage]:
        """The messages of an SSE stream after a number, as they come; it ends when the server ends it."""
        headers = {"Accept": "text/event-stream", "Last-Event-ID": str(after)}
        with self._opened("GET", path, headers=headers, timeout=_STREAM_TIMEOUT) as response:
            for event in httpx2.EventSource(response) if response.status_code == 200 else ():
                if event.data:
                    yield from_line(event.data)

    def _request(self, method: str, path: str, repeat: bool = False, **options: Any) -> httpx2.Response:
        """The answer, already read; a GET, and what says ``repeat``, is tried again when the network fails."""
        tries = _TRIES if repeat or method == "GET" else 1
        for attempt in range(tries):
            try:
                with self._opened(method, path, **options) as response:
                    response.read()
                return response
            except UnreachableError:
                if attempt == tries - 1:
                    raise
                time.sleep(0.3 * 2**attempt)
        raise AssertionError("unreachable")

    @contextmanager
    def _opened(self, method: str, path: str, **options: Any) -> Iterator[httpx2.Response]:
        """The answer as a stream. Raises ServiceError for a refusal, UnreachableError for a broken connection."""
        try:
            with self._http.stream(method, path, **options) as response:
                if response.status_code >= 300:
                    raise refusal(response.status_code, self._refusal(response))
                yield response
        except httpx2.InvalidURL as error:
            raise UnreachableError(f"url = {self.url!r}: {error}") from None
        except httpx2.TransportError as error:
            raise UnreachableError(f"no answer from {self.url}: {_reason(error)}") from None

    def _refusal(self, response: httpx2.Response) -> Mapping[str, Any]:
        """What the server said; where it misses a token, which way one is given to this client."""
        told = _problem(response)
        if response.status_code != UNAUTHORIZED:
            return told
        if self._has_token:
            hint = "the one of --token, CONOID_TOKEN or the configuration file is not known there, or was revoked"
        else:
            hint = (
                "none was sent: set CONOID_TOKEN, or give --token; the operator makes one with conoid serve token add"
            )
        return {**told, "hint": hint}

    def _decoded(self, kind: type[T], response: httpx2.Response) -> T:
        try:
            return msgspec.json.decode(response.content, type=kind)
        except msgspec.MsgspecError as error:
            raise UnreachableError(f"the answer of {self.url} cannot be read: {error}") from None


def _problem(response: httpx2.Response) -> Mapping[str, Any]:
    try:
        body = json.loads(response.read())
    except ValueError:
        body = None
    return body if isinstance(body, dict) else {"title": f"the server answered {response.status_code}"}


def _reason(error: Exception) -> str:
    if isinstance(error, httpx2.ConnectError):
        return "is it running there? (conoid serve)"
    return " ".join(str(error).split()) or type(error).__name__


def _visible(text: str) -> bool:
    """Whether all of it is visible ASCII, which a header can have."""
    return all("!" <= letter <= "~" for letter in text)
