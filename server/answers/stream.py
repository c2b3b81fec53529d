"""The messages of a run as server-sent events (SSE), read from its journal.

The stream reads the journal, not Zenoh, because the journal contains every message. A client that connects late,
reconnects or reads slowly gets each event exactly once and in order. The supervisor checks the journal every 20 ms, and
wakes the streams when the journal has grown.
"""

import time
from collections.abc import AsyncIterator
from pathlib import Path

from ..requests.auth import Pass
from ..runs.journal import Line, Tail
from ..service import Service

MEDIA_TYPE = "text/event-stream"
KEEP_ALIVE = 15.0
"""Time in s without a message after which a comment line is sent, so that proxies do not close the connection."""
HEADERS = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}


def event(line: Line) -> bytes:
    """Returns a journal line as a server-sent event. A client that reconnects sends the id of its last event in the
    header ``Last-Event-ID``.
    """
    return b"id: %d\nevent: %s\ndata: %s\n\n" % (line.seq, line.type.encode(), line.raw)


async def events(service: Service, may: Pass, run_id: str, path: Path, after: int) -> AsyncIterator[bytes]:
    """Yields every event with ``seq`` above ``after``, present and future. The stream ends with the run, or when the
    time limit ``may`` expires.
    """
    tail, silent = Tail(path, after), time.monotonic()
    with service.wakeups.listen(run_id) as listener:
        yield b"retry: 1000\n\n"
        while not service.wakeups.closed and await may.holds():
            listener.clear()
            over = not service.supervisor.is_open(run_id)
            lines = await service.pool.run(tail.read)
            if lines:
                yield b"".join(map(event, lines))
                silent = time.monotonic()
            elif over:
                return
            elif not await listener.wait(may.left) and time.monotonic() - silent >= KEEP_ALIVE:
                yield b": still here\n\n"
                silent = time.monotonic()
