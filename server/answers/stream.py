"""Server-sent events of a run, from its journal.

The stream follows the file, not Zenoh: the file is the truth and has every line, so a reader who connects late, or
again, or reads slowly, gets each event exactly once and in order. The supervisor looks at the file every 20 ms anyway
and rings a bell when it has grown; every stream then reads on from where it stands. Zenoh is for native clients.
"""

import time
from collections.abc import AsyncIterator
from pathlib import Path

from ..requests.auth import Pass
from ..runs.journal import Line, Tail
from ..service import Service

MEDIA_TYPE = "text/event-stream"
KEEP_ALIVE = 15.0
"""s of silence after which a comment is sent, so that proxies keep the connection."""
HEADERS = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}


def event(line: Line) -> bytes:
    """One journal line as one event; its id is what ``Last-Event-ID`` resumes from."""
    return b"id: %d\nevent: %s\ndata: %s\n\n" % (line.seq, line.type.encode(), line.raw)


async def events(service: Service, may: Pass, run_id: str, path: Path, after: int) -> AsyncIterator[bytes]:
    """Every event with ``seq`` above ``after``, those to come as well; ends when the run has ended, or ``may`` not."""
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
