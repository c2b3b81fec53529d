"""Live messages of a run: over Zenoh if the router can be reached, else over SSE. Missing messages are read over REST.

No other module of the client imports zenoh. A client first subscribes, then reads the past messages, and then the
stream, so that no message is missing or comes twice.
"""

import hashlib
import json
import queue
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from typing import TypeVar, cast

import msgspec
import zenoh

from conoid.cases.figures import duration
from conoid.cases.messages import AnyMessage, Log, Snapshot, Status, fragments_from_msgpack, from_msgpack
from conoid.cases.output import keys
from conoid.cases.run import State

from ..errors import AnswerError, ClientError, passes
from .http import Router
from .link import Link
from .message_order import InOrder, Refill

T = TypeVar("T")

_CAPACITY = 4096
"""Largest number of messages that wait to be read (chosen value: a run sends about ten messages per second, so that
they last for minutes)."""
_BLOBS = 4
"""Number of snapshots that are kept until they are read. With the chosen number, a snapshot that is read is at most
some seconds old."""
_OPEN_SECONDS = 5.0
"""Time limit for the answer of the Zenoh router, s; afterwards SSE is used (chosen value)."""
_CLOSE_SECONDS = 2.0
"""Time limit for closing a subscription, s (chosen value: a subscription that stays open does no harm)."""
_SILENCE = 3.0
"""Time without a message after which the journal is read, s (chosen value: a run sends a message four times a
second)."""
_PATIENCE = 60.0
"""Time without an answer of the server after which the client stops following a run, s (chosen value: a server restarts
in less time)."""


class StreamError(ClientError):
    """Zenoh cannot be used, because there is no router or because the router refuses the user."""


class Mailbox:
    """A bounded queue of messages between receiving threads and the reading thread. A full queue drops new messages;
    gaps in ``seq`` are filled from the journal.
    """

    def __init__(self) -> None:
        """Makes an empty queue."""
        self._queue: queue.Queue[AnyMessage] = queue.Queue(_CAPACITY)

    def put(self, message: AnyMessage) -> None:
        """Adds a message without waiting; a full queue drops the message."""
        with suppress(queue.Full):
            self._queue.put_nowait(message)

    def get(self, timeout: float) -> AnyMessage | None:
        """Returns the oldest message; None if there is no message within ``timeout`` s."""
        try:
            return self._queue.get(timeout=timeout)
        except queue.Empty:
            return None


class ZenohLink:
    """A Zenoh subscription to all messages of a run."""

    name, trouble = "Zenoh", ""

    def __init__(self, router: Router, prefix: str) -> None:
        """Opens a Zenoh session and subscribes. Raises StreamError if the subscription fails or takes too long."""
        self._mailbox = Mailbox()
        self.blobs: dict[str, bytes] = {}
        """The newest snapshots that have arrived; the keys are their sha256."""
        self._session = _within(_OPEN_SECONDS, lambda: zenoh.open(_config(router)))
        self._subscriber = self._session.declare_subscriber(keys.everything(prefix), self._receive)

    def _receive(self, sample: zenoh.Sample) -> None:
        with suppress(msgspec.MsgspecError):
            payload = sample.payload.to_bytes()
            message = from_msgpack(payload)
            if isinstance(message, Snapshot):
                self._keep(message, payload)
            self._mailbox.put(message)

    def _keep(self, message: Snapshot, payload: bytes) -> None:
        """Keeps the bytes of a snapshot that has arrived completely."""
        with suppress(msgspec.MsgspecError):
            data = fragments_from_msgpack(payload).blob
            if hashlib.sha256(data).hexdigest() == message.sha256:
                kept = list(self.blobs.items())[1 - _BLOBS :]
                self.blobs = dict([*kept, (message.sha256, data)])

    def get(self, timeout: float) -> AnyMessage | None:
        """Returns the next message; None if no message arrives within ``timeout`` s."""
        return self._mailbox.get(timeout)

    def close(self) -> None:
        """Closes the session without waiting for a router that does not answer."""
        with suppress(StreamError):
            _within(_CLOSE_SECONDS, self._session.close)


def _config(router: Router) -> zenoh.Config:
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "client", "connect/endpoints": [router.endpoint], "connect/timeout_ms": 500,
        "scouting/multicast/enabled": False, "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False, "transport/unicast/open_timeout": 3000,
    }  # fmt: skip
    if router.user is not None:
        settings |= {"transport/auth/usrpwd/user": router.user, "transport/auth/usrpwd/password": router.password}
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _within(seconds: float, work: Callable[[], T]) -> T:
    """Returns the result of ``work``, which is computed in a thread. Raises StreamError if ``work`` fails or exceeds
    the time limit.
    """
    done: queue.Queue[tuple[T | None, Exception | None]] = queue.Queue()

    def attempt() -> None:
        try:
            done.put((work(), None))
        except Exception as error:
            done.put((None, error))

    threading.Thread(target=attempt, name="zenoh", daemon=True).start()
    try:
        value, error = done.get(timeout=seconds)
    except queue.Empty:
        raise StreamError(f"the Zenoh router did not answer within {duration(seconds)}") from None
    if error is not None:
        raise StreamError(f"the Zenoh router refused or cannot be reached: {' '.join(str(error).split())}") from None
    return cast(T, value)


class SseLink:
    """Subscription to the SSE stream of the server, which is read in a thread. After a break of the stream no more
    messages come from the subscription, and the journal is read.
    """

    name, trouble = "SSE", ""

    def __init__(self, events: Callable[[], Iterator[AnyMessage]]) -> None:
        """``events``: function that opens the stream and yields its messages."""
        self._mailbox = Mailbox()
        self._closed = threading.Event()
        threading.Thread(target=self._read, args=(events,), name="sse", daemon=True).start()

    def _read(self, events: Callable[[], Iterator[AnyMessage]]) -> None:
        try:
            for message in events():
                if self._closed.is_set():
                    return
                self._mailbox.put(message)
        except AnswerError as error:
            self.trouble = f"the event stream of the server broke, and the journal is read instead: {error}"
        except ClientError:  # The stream is broken or refused: the journal is read instead.
            return

    def get(self, timeout: float) -> AnyMessage | None:
        """Returns the next message; None if no message arrives within ``timeout`` s."""
        return self._mailbox.get(timeout)

    def close(self) -> None:
        """Requests the end of the reading thread; the thread ends at the next message or with the process."""
        self._closed.set()


def follow(link: Link, refill: Refill, ended: Callable[[], bool], after: int = 0) -> Generator[AnyMessage]:
    """Yields every message after the number ``after`` once and in order, until the final status of the run; then closes
    ``link``.

    ``refill`` reads the journal, ``ended`` asks the server whether the run has ended. While the link is silent, both
    are called every few seconds, so that a failed router delays messages and loses none. UnreachableError or
    ServiceError is raised if the server does not answer, or is unavailable, for a minute. A message that cannot be
    decoded has no number and is not in the journal; a warning about it precedes the next message.
    """
    order, warned = InOrder(_patient(refill), after), False
    try:
        for message in _in_order(link, order, ended):
            if link.trouble and not warned:
                warned = True
                yield Log(run=message.run, level="warning", text=link.trouble)
            yield message
            if isinstance(message, Status) and State(message.state).final:
                return
    finally:
        link.close()


def _in_order(link: Link, order: InOrder, ended: Callable[[], bool]) -> Iterator[AnyMessage]:
    yield from order.catch_up()
    over = False
    while not over:
        message = link.get(_SILENCE)
        if message is not None:
            yield from order.take(message)
            continue
        over = _asked(ended)
        yield from order.catch_up()


def _asked(ended: Callable[[], bool]) -> bool:
    """Returns True if the run has ended, False if it has not ended or no server answers."""
    try:
        return ended()
    except ClientError as error:
        if not passes(error):
            raise
        return False


def _patient(refill: Refill) -> Refill:
    def refilled(after: int) -> list[AnyMessage]:
        deadline = time.monotonic() + _PATIENCE
        while True:
            try:
                return refill(after)
            except ClientError as error:
                if not passes(error) or time.monotonic() > deadline:
                    raise
                time.sleep(1.0)

    return refilled
