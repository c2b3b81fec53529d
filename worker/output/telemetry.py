"""Sending of messages by Zenoh. A thread with a bounded queue sends the messages, so that the solver never waits for
the network.

A snapshot is sent with its bytes. If several snapshots wait, the older ones are sent without their bytes, and readers
fetch the bytes over HTTP. Zenoh's ``put`` reports no loss and may block, so it is called in the thread. When the queue
is full, the oldest message is dropped. A reader that finds a gap in ``seq`` reads the journal. Without a router the
thread tries to connect at intervals; the run is not affected.
"""

import json
import logging
import os
import threading
from collections import deque

import zenoh

from conoid.cases import messages
from conoid.cases.output import keys

_RING = 1024
"""Largest number of messages that wait for the network. Chosen value: more than a minute of a run, which sends about
ten messages a second."""
_BLOBS = 2
"""Largest number of snapshots that wait for the network with their bytes. A snapshot has about a megabyte. Chosen
value: the snapshot that is being sent, and the newest snapshot."""
_RETRY = 2.0
"""Interval between two attempts to reach a router, s. Chosen value."""
_LINGER = 1.0
"""Longest time in which the last messages are sent at the end of a run, s. Chosen value: messages that are not sent are
still in the journal."""

log = logging.getLogger("conoid.worker")


class Telemetry:
    """Sender of messages by Zenoh."""

    def __init__(self, endpoint: str, prefix: str) -> None:
        self._endpoint = endpoint
        self._prefix = prefix
        self._ring: deque[messages.AnyMessage | messages.Fragments] = deque()
        self.dropped = self.bare = 0
        """Two numbers: messages that were not sent, and snapshots that were sent without their bytes."""
        self._wake = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._work, name="telemetry", daemon=True)
        self._thread.start()

    def tell(self, message: messages.AnyMessage, blob: bytes = b"") -> None:
        """Queue a message for sending; a snapshot is queued with its bytes. The call never waits for the network."""
        whole = isinstance(message, messages.Snapshot) and blob
        with self._wake:
            if len(self._ring) == _RING:
                self._ring.popleft()
                self.dropped += 1
            self._ring.append(messages.with_blob(message, blob) if whole else message)  # type: ignore[arg-type]
            if whole:
                self._thin_out()
            self._wake.notify()

    def _thin_out(self) -> None:
        """Remove the bytes of waiting snapshots, except those of the newest snapshots."""
        waiting = [i for i, message in enumerate(self._ring) if isinstance(message, messages.Fragments)]
        for i in waiting[:-_BLOBS]:
            self._ring[i] = messages.without_blob(self._ring[i])  # type: ignore[arg-type]
            self.bare += 1

    def close(self) -> None:
        """Wait a short time until the last messages are sent. If the network hangs, the thread ends with the
        process.
        """
        with self._wake:
            self._closing = True
            self._wake.notify()
        self._thread.join(_LINGER)
        if self.dropped or self.bare:
            log.warning("Zenoh: %d messages not sent, %d snapshots sent without their bytes", self.dropped, self.bare)

    def _work(self) -> None:
        session = None
        while session is None:
            session = self._open()
            if session is None and self._pause(_RETRY):
                return
        token = session.liveliness().declare_token(keys.alive(self._prefix))
        while (message := self._next()) is not None:
            session.put(
                keys.message_key(self._prefix, message.channel),
                messages.to_msgpack(message),
                congestion_control=zenoh.CongestionControl.DROP,
            )
        token.undeclare()  # type: ignore[no-untyped-call]
        session.close()  # type: ignore[no-untyped-call]

    def _open(self) -> "zenoh.Session | None":
        try:
            return zenoh.open(_config(self._endpoint))
        except zenoh.ZError:
            return None

    def _pause(self, seconds: float) -> bool:
        with self._wake:
            return self._closing or self._wake.wait_for(lambda: self._closing, seconds)

    def _next(self) -> messages.AnyMessage | messages.Fragments | None:
        with self._wake:
            self._wake.wait_for(lambda: self._ring or self._closing)
            return self._ring.popleft() if self._ring else None


def _config(endpoint: str) -> zenoh.Config:
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 1000,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
    }
    if user := os.environ.get("CONOID_ZENOH_USER"):
        settings["transport/auth/usrpwd/user"] = user
        settings["transport/auth/usrpwd/password"] = os.environ.get("CONOID_ZENOH_PASSWORD", "")
    if authority := os.environ.get("CONOID_ZENOH_AUTHORITY"):
        settings["transport/link/tls/root_ca_certificate"] = authority
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config
