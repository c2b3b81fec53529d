"""Requests to a server over HTTP; a refusal of the server becomes one clear line.

Answers have limits: the time until the headers have arrived, the number of bytes, and the mean rate of the bytes.
Therefore no request waits for ever, and no answer fills the memory or the disk.
"""

import base64
import hashlib
import queue
import threading
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Self, TypeVar

import httpx2
import msgspec

from conoid.cases.figures import duration, size
from conoid.cases.messages import AnyMessage

from ..errors import AnswerError, ClientError, UnreachableError, UsageError, passes, refusal
from ..journal import from_line
from . import replies
from .config import address

T = TypeVar("T")

_AS_IT_IS = {"Accept-Encoding": "identity"}
"""Header of a request for a file, so that the answer contains the length of the file."""

_ANSWER, _CONNECTION = 30.0, 5.0
"""Time limits in s for an answer and for a connection; an answer may take long if the server's disk is slow (chosen
values)."""
_TIMEOUT = httpx2.Timeout(_ANSWER, connect=_CONNECTION)
_STREAM_TIMEOUT = httpx2.Timeout(60.0, connect=_CONNECTION)
"""Longest silence of a stream, s: four times the 15 s after which the server sends a comment
(server/answers/stream.py)."""
_SPARE = 10.0
"""Additional time, s, for an answer whose headers arrive byte by byte; after it the request is given up."""
_SLOWEST = 1000.0
"""Smallest mean rate of an answer after its first 30 s, bytes per s (chosen value: slower than any real connection)."""
UNAUTHORIZED = 401
"""HTTP status of a request without a valid token."""
NOT_FOUND = 404
_TRIES = 3
"""Number of tries of a request that may be repeated; the pauses are 0.3 s and 0.6 s (chosen value: most lost
connections are back after these pauses)."""
_PATIENCE = 10.0
"""Time after which a failed request is not repeated, s (chosen value: a server that is silent for this time hangs). In
10 s three connections, or one answer, can reach their time limit."""


class Router(msgspec.Struct, kw_only=True, frozen=True):
    """Address of the Zenoh router, with user and password (both None for a router without access control)."""

    endpoint: str
    user: str | None = None
    password: str | None = None


class Me(msgspec.Struct, kw_only=True, frozen=True):
    """Name of the user on the server, scopes of the token, access to Zenoh (None if there is none), and the numbers
    of cores for runs (``total``, ``used``).
    """

    owner: str
    scopes: list[str] = []
    zenoh: Router | None = None
    slots: dict[str, int] = {}


class Http:
    """An HTTP client of one server. An ``Http`` is a context manager; without a ``with`` statement, call ``close``."""

    def __init__(self, url: str, token: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        """Stores address and token; the first request opens the connection. ``transport`` replaces the network, for
        a server in the same process. Raises UsageError for an impossible token or address.
        """
        shown = (token or "").strip()
        if not replies.visible(shown):
            raise UsageError("token: only visible ASCII characters are allowed; was the token copied completely?")
        headers = {"Authorization": f"Bearer {shown}"} if shown else {}
        self.url = address(url)
        self._has_token = bool(shown)
        try:
            self._http = httpx2.Client(base_url=self.url, headers=headers, timeout=_TIMEOUT, transport=transport)
        except httpx2.InvalidURL as error:
            raise UsageError(f"url = {self.url!r}: {error}") from None

    def __enter__(self) -> Self:
        """Returns the client itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the connections."""
        self.close()

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def me(self) -> Me:
        """Returns the user of the token."""
        return self.get(Me, "/v1/me")

    def get(self, kind: type[T], path: str, **query: str | float | list[str]) -> T:
        """Returns the answer of a GET request. A parameter with a list is sent once for each element. Raises
        ServiceError, UnreachableError.
        """
        return self._decoded(kind, self._request("GET", path, params=query))

    def post(
        self, kind: type[T], path: str, body: bytes = b"", content: str = "", key: str | None = None,
        more: float = 0.0,
    ) -> T:  # fmt: skip
        """Returns the answer of a POST request. After a network error the request is repeated only if it has an
        idempotency key. ``more``: additional time for the answer, s.
        """
        headers = {"Content-Type": content} if content else {}
        if key is not None:
            if not replies.visible(key):
                raise UsageError(f"Idempotency-Key {key[:80]!r}: 1 to 255 visible ASCII characters")
            headers["Idempotency-Key"] = key
        timeout = httpx2.Timeout(_ANSWER + more, connect=_CONNECTION)
        response = self._request("POST", path, content=body, headers=headers, repeat=key is not None, timeout=timeout)
        return self._decoded(kind, response)

    def put(self, kind: type[T], path: str, body: bytes, headers: Mapping[str, str], more: float = 0.0) -> T:
        """Returns the answer of a PUT request, which is sent only once. ``more``: additional time for the answer, s."""
        timeout = httpx2.Timeout(_ANSWER + more, connect=_CONNECTION)
        return self._decoded(kind, self._request("PUT", path, content=body, headers=headers, timeout=timeout))

    def delete(self, path: str) -> None:
        """Sends a DELETE request. Raises ServiceError, UnreachableError."""
        self._request("DELETE", path)

    def fetch(self, path: str) -> bytes:
        """Returns the content of the answer to a GET request. Raises ServiceError, UnreachableError."""
        return self._request("GET", path)

    def download(self, path: str, target: Path, listed: int | None = None) -> None:
        """Downloads a file completely or not at all. The file is compared with the sha256 of the server and with the
        ``listed`` size, if known. Raises ServiceError, UnreachableError, and OSError with the name of the file.
        """
        beside = target.with_name(f".{uuid.uuid4().hex}.part")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with self._opened("GET", path, headers=_AS_IT_IS) as response, beside.open("xb") as file:
                digest = hashlib.sha256()
                for chunk in self._chunks(response, replies.most(response, target)):
                    digest.update(chunk)
                    file.write(chunk)
            if listed is not None and (got := beside.stat().st_size) != listed:
                raise AnswerError(f"{path} has {got} bytes instead of the {listed} in the list of files")
            expected = response.headers.get("Repr-Digest")
            if expected is not None and expected != f"sha-256=:{base64.b64encode(digest.digest()).decode()}:":
                raise AnswerError(f"{path} arrived damaged: its sha256 is not that of the server")
            beside.replace(target)
        except OSError as error:
            error.filename, error.filename2 = str(target), None
            raise
        finally:
            beside.unlink(missing_ok=True)

    def stream(self, path: str, after: int = 0) -> Iterator[AnyMessage]:
        """Yields the messages of an SSE stream after the message number ``after``, as they arrive, until the server
        ends the stream.
        """
        headers = {"Accept": "text/event-stream", "Last-Event-ID": str(after)}
        with self._opened("GET", path, headers=headers, timeout=_STREAM_TIMEOUT) as response:
            for event in httpx2.EventSource(response) if response.status_code == 200 else ():
                if event.data:
                    yield self.line(event.data)

    def line(self, data: str | msgspec.Raw) -> AnyMessage:
        """Decodes a message from the server. Raises AnswerError."""
        try:
            return from_line(data)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise self._unreadable(error) from None

    def _request(self, method: str, path: str, repeat: bool = False, **options: Any) -> bytes:
        """Returns the complete answer to a request. After a network error, a GET request is repeated, and any
        request with ``repeat``.
        """
        tries, began = _TRIES if repeat or method == "GET" else 1, time.monotonic()
        for attempt in range(tries):
            try:
                with self._opened(method, path, **options) as response:
                    return self._body(response)
            except UnreachableError as error:
                if attempt == tries - 1 or not passes(error) or time.monotonic() - began > _PATIENCE:
                    raise
                time.sleep(0.3 * 2**attempt)
        raise AssertionError("unreachable")

    @contextmanager
    def _opened(self, method: str, path: str, **options: Any) -> Iterator[httpx2.Response]:
        """Context with the answer to a request as a stream. Raises ServiceError for a refusal, UnreachableError for
        a broken connection, AnswerError.
        """
        try:
            with closing(self._begun(method, path, **options)) as response:
                if 300 <= response.status_code < 400:
                    raise AnswerError(f"{self.url} redirects to {replies.place(response)}; write this new address")
                if response.status_code >= 400:
                    raise refusal(response.status_code, self._refusal(response))
                yield response
        except httpx2.InvalidURL as error:
            raise UsageError(f"url = {self.url!r}: {error}") from None
        except httpx2.TransportError as error:
            raise UnreachableError(f"no answer from {self.url}: {replies.reason(error)}") from None
        except (httpx2.HTTPError, httpx2.StreamError) as error:
            raise self._unreadable(error) from None

    def _begun(self, method: str, path: str, timeout: httpx2.Timeout = _TIMEOUT, **options: Any) -> httpx2.Response:
        """Returns the answer as soon as its headers have arrived, within a time limit. httpx limits only the silence
        between two bytes.
        """
        request = self._http.build_request(method, path, timeout=timeout, **options)
        done: queue.SimpleQueue[httpx2.Response | Exception] = queue.SimpleQueue()

        def send() -> None:
            try:
                done.put(self._http.send(request, stream=True))
            except Exception as error:
                done.put(error)

        threading.Thread(target=send, name="request", daemon=True).start()
        most = (timeout.read or _ANSWER) + _SPARE
        try:
            answer = done.get(timeout=most)
        except queue.Empty:
            raise AnswerError(f"{self.url} did not answer completely within {duration(most)}") from None
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _body(self, response: httpx2.Response) -> bytes:
        return b"".join(self._chunks(response, replies.LONGEST))

    def _chunks(self, response: httpx2.Response, most: int) -> Iterator[bytes]:
        """Yields the content of an answer. Raises AnswerError if the answer has more than ``most`` bytes or is too
        slow.
        """
        began, got = time.monotonic(), 0
        for chunk in response.iter_bytes():
            got += len(chunk)
            if got > most:
                raise AnswerError(f"the answer of {self.url} is longer than {size(most)}")
            spent = time.monotonic() - began
            if spent > _ANSWER + got / _SLOWEST:
                raise AnswerError(f"the answer of {self.url} is too slow: {size(got)} in {duration(spent)}")
            yield chunk

    def _refusal(self, response: httpx2.Response) -> Mapping[str, Any]:
        """Returns the problem that the server reports. For a missing token the problem explains how this client gets
        a token.
        """
        message = replies.problem(response.status_code, self._body(response))
        if response.status_code != UNAUTHORIZED:
            return message
        if self._has_token:
            hint = (
                "the server does not have the token of --token, CONOID_TOKEN or the configuration file, or the token "
                "was revoked"
            )
        else:
            hint = (
                "no token was sent: set CONOID_TOKEN, or give --token; the operator makes a token with conoid serve "
                "token add"
            )
        return {**message, "hint": f"server {self.url}: {hint}"}

    def _decoded(self, kind: type[T], content: bytes) -> T:
        try:
            return msgspec.json.decode(content, type=kind)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise self._unreadable(error) from None

    def endless(self, what: str) -> ClientError:
        """Returns the error for a list that has more pages than allowed."""
        return AnswerError(f"the list of {what} of {self.url} has no end")

    def _unreadable(self, error: Exception) -> ClientError:
        """Returns the error for an answer that this client cannot read: of another program or of a newer server."""
        why = " ".join(str(error).split())[: replies.WORDS]
        return AnswerError(
            f"the answer of {self.url} cannot be read: {why}; is this a Conoid server of the same or an older version?"
        )
