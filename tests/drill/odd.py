"""Files and addresses with unusual names: each request is answered, and a link leads to the file that the link
names.
"""

import os
import time
from collections.abc import Callable, Iterator

import httpx2

from .judge import TRUE, Row
from .stand import Stand
from .strike import Strike
from .strikes import killed, started

NAMES: tuple[bytes, ...] = (
    b"a blank", b"50%", b"%41", b"%00", b"a<b>c", b"a#b", b"a?b=c", b"back\\slash", b"a\nline", b"a\ttab", b'a"quote',
    b"not-\xff-utf-8", b"\xc3\x28", b"\xed\xa0\x80", "\u4e2d\u6587".encode(), "\u202egnp.exe".encode(), b"\x1b[31m",
    b"a;b&c+d=e", b"~tilde", b"x" * 255, b"more..", b"{}[]", b"'", b"*",
)  # fmt: skip
ADDRESSES: tuple[str, ...] = (
    "/%00", "/app.js%00", "/v1/runs/%00", "/v1/runs/%ff", "/v1/runs/RUN%00", "/v1/runs/RUN/files/%00",
    "/v1/runs/RUN/files/case.toml%00", "/v1/runs/RUN/files/%2e%2e/server.secret", "/v1/runs/RUN/files/..%2fx",
    f"/v1/runs/RUN/files/{'x' * 5000}", "/v1/runs/RUN/logs/0%00", "/v1/runs/RUN/logs/%0a", "/v1/runs/RUN/snapshots/%00",
    "/v1/cases/%00", "/v1/cases/demo%00", "/v1/sweeps/%ff", "/v1/sweeps/%00/table", f"/v1/runs/{'%f0%9f' * 900}",
)  # fmt: skip
Deed = Callable[[Stand], Iterator[Row]]


def groups() -> dict[str, tuple[str, Deed]]:
    """Returns the groups of faults by name."""
    found: dict[str, Deed] = {"files of odd names": files, "odd addresses": addresses, "odd heads": heads}
    return {name: ("plain", deed) for name, deed in found.items()}


def everything() -> list[Strike]:
    """Yields faults of a server whose folder of runs has an unusual name."""
    return [Strike("the server killed, its folder of an odd name", "names", killed, started, "odd")]


def files(stand: Stand) -> Iterator[Row]:
    """Creates a file of each unusual name, also in a folder of that name, and reads the files through the server."""
    run = stand.submit()
    stand.reached(run)
    folder = os.fsencode(stand.runs / run)
    for name in NAMES:
        os.mkdir(folder + b"/in-" + name[:200])
        for path in (folder + b"/in-" + name[:200] + b"/" + name, folder + b"/" + name + b"."[: 254 - len(name)]):
            with open(path, "wb") as file:
                file.write(path)
    began = time.monotonic()
    status, answer = stand.ask("GET", f"/v1/runs/{run}/files")
    urls = [file["url"] for file in answer["files"]] if status == 200 else []
    assert stand.http is not None
    contents = {stand.http.get(url).content for url in urls}
    for name in NAMES:
        inside = folder + b"/in-" + name[:200] + b"/" + name
        wrong = f"lie: the list is answered with {status}" if status != 200 else "lie: its url leads elsewhere"
        verdict = TRUE if inside in contents else wrong
        yield Row(f"a file of the name {name[:20]!r}", "names", f"{status}", time.monotonic() - began, verdict)


def addresses(stand: Stand) -> Iterator[Row]:
    """Checks that GET and HEAD of each address are answered with an error of the client."""
    run = stand.submit()
    stand.reached(run)
    for address in ADDRESSES:
        began = time.monotonic()
        found = [_status(stand, method, address.replace("RUN", run)) for method in ("GET", "HEAD")]
        verdict = TRUE if set(found) <= {400, 404} and found[0] == found[1] else f"lie: answered {found}"
        yield Row(f"the address {address[:50]}", "names", f"{found[0]}", time.monotonic() - began, verdict)


def heads(stand: Stand) -> Iterator[Row]:
    """Sends HEAD requests for a run in progress, some of them for endless answers. The answer to each HEAD request must
    come at once.
    """
    run = stand.running()
    stand.reached(run, "running")
    for path in ("/logs/0?follow=true", "/logs/launcher?follow=true", "/stream", "/stream?after=1", "", "/history"):
        began = time.monotonic()
        status = _status(stand, "HEAD", f"/v1/runs/{run}{path}")
        took = time.monotonic() - began
        verdict = TRUE if status == 200 and took < 2.0 else f"late: {status} after {took:.1f} s"
        yield Row(f"HEAD of a run that goes on, {path or 'itself'}", "names", f"{status}", took, verdict)
    stand.go(run)


def _status(stand: Stand, method: str, path: str) -> int:
    assert stand.http is not None
    try:
        return int(stand.http.request(method, path).status_code)
    except httpx2.HTTPError:
        return 0
