"""Requests to a server over HTTP, and refusals as one clear line.

An answer has limits: of time until its head has come, of bytes, and of the time that so many bytes may take. Whatever
answers at an address, nobody waits without end, and no memory or disk is filled.
"""

import base64
import hashlib
import json
import queue
import shutil
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
from .config import address

T = TypeVar("T")

_WORDS = 300
"""Characters of an error's words that are shown. Chosen."""
_AS_IT_IS = {"Accept-Encoding": "identity"}
"""A file comes with its length."""

_ANSWER, _CONNECTION = 30.0, 5.0
"""s: an answer may take a while when a disk is slow, a connection may not. Chosen."""
_TIMEOUT = httpx2.Timeout(_ANSWER, connect=_CONNECTION)
_STREAM_TIMEOUT = httpx2.Timeout(60.0, connect=_CONNECTION)
"""s of silence on a stream: four times the 15 s after which the server sends a comment (server/answers/stream.py)."""
_SPARE = 10.0
"""s beyond the silence that is allowed, after which the head of an answer is given up that comes letter by letter."""
_SLOWEST = 1000.0
"""Bytes a second that an answer must come with in the mean, after its first 30 s. Chosen: no line is that slow."""
_LONGEST = 1 << 28
"""Bytes of an answer that is read at once, or does not say how long it is. Chosen: ten times the largest snapshot."""
UNAUTHORIZED = 401
"""HTTP's status of a request without a valid token."""
NOT_FOUND = 404
_TRIES = 3
"""Times a request is sent that may be repeated, 0.3 and 0.6 s apart. Chosen: a lost connection is back by then."""
_PATIENCE = 10.0
"""s after which a request that has failed is not sent again: a server that has not answered for so long hangs. Chosen:
three connections that time out are tried, and one answer that does."""


class Router(msgspec.Struct, kw_only=True, frozen=True):
    """Where the Zenoh router is, and the user and password to show it (neither: it asks for none)."""

    endpoint: str
    user: str | None = None
    password: str | None = None


class Me(msgspec.Struct, kw_only=True, frozen=True):
    """Who the server takes us for, what the token allows, how to subscribe over Zenoh (None: not possible), and the
    cores of its runs: ``total`` and ``used``.
    """

    owner: str
    scopes: list[str] = []
    zenoh: Router | None = None
    slots: dict[str, int] = {}


class Http:
    """A server that answers requests. Use it as a context manager, or close it."""

    def __init__(self, url: str, token: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        """Connects at the first request. ``transport`` replaces the network, for a server in the same process.

        Raises UsageError for a token, or an address, that cannot be one.
        """
        shown = (token or "").strip()
        if not _visible(shown):
            raise UsageError("token: only visible ASCII characters are allowed; was it copied whole?")
        headers = {"Authorization": f"Bearer {shown}"} if shown else {}
        self.url = address(url)
        self._has_token = bool(shown)
        try:
            self._http = httpx2.Client(base_url=self.url, headers=headers, timeout=_TIMEOUT, transport=transport)
        except httpx2.InvalidURL as error:
            raise UsageError(f"url = {self.url!r}: {error}") from None

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

    def put(self, kind: type[T], path: str, body: bytes, headers: Mapping[str, str], more: float = 0.0) -> T:
        """The answer to a PUT, which is sent once. ``more``: as for ``post``."""
        timeout = httpx2.Timeout(_ANSWER + more, connect=_CONNECTION)
        return self._decoded(kind, self._request("PUT", path, content=body, headers=headers, timeout=timeout))

    def delete(self, path: str) -> None:
        """Removes what is at ``path``. Raises ServiceError, UnreachableError."""
        self._request("DELETE", path)

    def fetch(self, path: str) -> bytes:
        """The body at ``path``. Raises ServiceError, UnreachableError."""
        return self._request("GET", path)

    def download(self, path: str, target: Path, listed: int | None = None) -> None:
        """Writes the body at ``path`` to a file that appears whole, with the server's sha256 and as many bytes as are
        ``listed``, where that is known, or not at all.

        Raises ServiceError, UnreachableError, and OSError with the name of the file.
        """
        beside = target.with_name(f".{uuid.uuid4().hex}.part")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with self._opened("GET", path, headers=_AS_IT_IS) as response, beside.open("xb") as file:
                digest = hashlib.sha256()
                for chunk in self._chunks(response, _most(response, target)):
                    digest.update(chunk)
                    file.write(chunk)
            if listed is not None and (got := beside.stat().st_size) != listed:
                raise AnswerError(f"{path} has {got} bytes, where the list of files has {listed}")
            told = response.headers.get("Repr-Digest")
            if told is not None and told != f"sha-256=:{base64.b64encode(digest.digest()).decode()}:":
                raise AnswerError(f"{path} arrived damaged: its sha256 is not the one that the server told")
            beside.replace(target)
        except OSError as error:
            error.filename, error.filename2 = str(target), None
            raise
        finally:
            beside.unlink(missing_ok=True)

    def stream(self, path: str, after: int = 0) -> Iterator[AnyMessage]:
        """The messages of an SSE stream after a number, as they come; it ends when the server ends it."""
        headers = {"Accept": "text/event-stream", "Last-Event-ID": str(after)}
        with self._opened("GET", path, headers=headers, timeout=_STREAM_TIMEOUT) as response:
            for event in httpx2.EventSource(response) if response.status_code == 200 else ():
                if event.data:
                    yield self.line(event.data)

    def line(self, data: str | msgspec.Raw) -> AnyMessage:
        """A message as the server sends it. Raises AnswerError."""
        try:
            return from_line(data)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise self._unreadable(error) from None

    def _request(self, method: str, path: str, repeat: bool = False, **options: Any) -> bytes:
        """The whole answer; a GET, and what says ``repeat``, is tried again when the network fails."""
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
        """The answer as a stream. Raises ServiceError for a refusal, UnreachableError for a broken connection,
        AnswerError.
        """
        try:
            with closing(self._begun(method, path, **options)) as response:
                if 300 <= response.status_code < 400:
                    raise AnswerError(f"{self.url} is elsewhere: it points to {_place(response)}; write that address")
                if response.status_code >= 400:
                    raise refusal(response.status_code, self._refusal(response))
                yield response
        except httpx2.InvalidURL as error:
            raise UsageError(f"url = {self.url!r}: {error}") from None
        except httpx2.TransportError as error:
            raise UnreachableError(f"no answer from {self.url}: {_reason(error)}") from None
        except (httpx2.HTTPError, httpx2.StreamError) as error:
            raise self._unreadable(error) from None

    def _begun(self, method: str, path: str, timeout: httpx2.Timeout = _TIMEOUT, **options: Any) -> httpx2.Response:
        """The answer when its head has come, within a time: httpx limits the silence between two letters alone."""
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
            raise AnswerError(f"{self.url} has not answered whole within {duration(most)}") from None
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _body(self, response: httpx2.Response) -> bytes:
        return b"".join(self._chunks(response, _LONGEST))

    def _chunks(self, response: httpx2.Response, most: int) -> Iterator[bytes]:
        """The pieces of an answer, ``most`` bytes of it. Raises AnswerError for one without end, or too slow."""
        began, got = time.monotonic(), 0
        for chunk in response.iter_bytes():
            got += len(chunk)
            if got > most:
                raise AnswerError(f"the answer of {self.url} is longer than {size(most)}")
            spent = time.monotonic() - began
            if spent > _ANSWER + got / _SLOWEST:
                raise AnswerError(f"the answer of {self.url} comes too slowly: {size(got)} in {duration(spent)}")
            yield chunk

    def _refusal(self, response: httpx2.Response) -> Mapping[str, Any]:
        """What the server said; where it misses a token, which way one is given to this client."""
        told = _problem(response.status_code, self._body(response))
        if response.status_code != UNAUTHORIZED:
            return told
        if self._has_token:
            hint = "the one of --token, CONOID_TOKEN or the configuration file is not known there, or was revoked"
        else:
            hint = (
                "none was sent: set CONOID_TOKEN, or give --token; the operator makes one with conoid serve token add"
            )
        return {**told, "hint": f"server {self.url}: {hint}"}

    def _decoded(self, kind: type[T], content: bytes) -> T:
        try:
            return msgspec.json.decode(content, type=kind)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise self._unreadable(error) from None

    def endless(self, what: str) -> ClientError:
        """Of a list whose pages have no end."""
        return AnswerError(f"the list of {what} of {self.url} has no end")

    def _unreadable(self, error: Exception) -> ClientError:
        """Of another program, or of a newer server."""
        why = " ".join(str(error).split())[:_WORDS]
        return AnswerError(f"the answer of {self.url} cannot be read: {why}; is it a Conoid server, and no newer?")


def _problem(status: int, content: bytes) -> Mapping[str, Any]:
    try:
        body = json.loads(content)
    except (ValueError, RecursionError):
        body = None
    return body if isinstance(body, dict) else {"title": f"the server answered {status}"}


def _place(response: httpx2.Response) -> str:
    """Where an answer points to; the address as it is written may be none."""
    return repr(response.headers.get("location", "nowhere")[:_WORDS])


def _most(response: httpx2.Response, target: Path) -> int:
    """Bytes that a file may have: as many as the answer says, where the disk has room for them. Raises ClientError."""
    told = response.headers.get("content-length", "")
    if not told.isdecimal() or "content-encoding" in response.headers:
        return _LONGEST
    free = shutil.disk_usage(target.parent).free
    if int(told) > free:
        raise ClientError(f"{target}: cannot be written: it has {size(int(told))}, and {size(free)} are free")
    return int(told)


def _reason(error: Exception) -> str:
    if isinstance(error, httpx2.ConnectError):
        return "is it running there? (conoid serve; another address: CONOID_URL or --url)"
    return " ".join(str(error).split()) or type(error).__name__


def _visible(text: str) -> bool:
    """Whether all of it is visible ASCII, which a header can have."""
    return all("!" <= letter <= "~" for letter in text)
