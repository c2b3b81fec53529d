"""The command ``python -m tests.drill.attacker KIND URL TOKEN RUN LONG MANY SWEEP SECONDS`` simulates a user who loads
a server as much as the server allows.

The attack is a separate process, lasts SECONDS, and has a limited number of connections. The process prints as JSON the
number of answers with each status; status 0 counts connections that were closed without an answer.
"""

import itertools
import json
import os
import random
import socket
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import BinaryIO
from urllib.parse import urlsplit

from ..server.hostile import quadratic
from ..server.running import case_text
from ..server.sweep_bodies import wish as sweep_wish

NICE = 10
"""Increase of the nice value: the attacker has lower priority than the server, since a real attacker uses another
machine."""
MOST = 400
"""Largest number of simultaneous connections."""


@dataclass
class Attack:
    """Requests of an attack on each connection, and the rate of these requests."""

    requests: Callable[["Target"], Iterator[bytes]]
    """Generator of the requests on one connection. The next request is sent after the answer to the previous
    request."""
    crowd: int
    """Number of simultaneous connections."""
    reads: bool = True
    """True if the attacker reads the answers."""
    drip: float = 0.0
    """Pause in s after each byte of a request; with 0 a request is sent as a whole."""
    pause: float = 0.1
    """Pause in s before the attacker connects again after its connection was closed."""


@dataclass
class Target:
    """Target of an attack: a server, the token of the attacker, and runs of the attacker. The runs are a run in
    progress, a run with a long journal, several runs with longer journals, and a sweep.
    """

    url: str
    token: str
    run: str
    long: str
    many: list[str]
    sweep: str
    until: float
    answers: Counter[int] = field(default_factory=Counter)

    def get(self, path: str, method: str = "GET", more: str = "", token: bool = True) -> bytes:
        """Returns a request without a body."""
        shown = f"Authorization: Bearer {self.token}\r\n" if token else ""
        return f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{shown}{more}\r\n".encode()

    def post(self, path: str, body: bytes, kind: str = "application/toml", length: int | None = None) -> bytes:
        """Returns a request with a body; ``length`` is the value of the header Content-Length."""
        size = len(body) if length is None else length
        return self.get(path, "POST", f"Content-Type: {kind}\r\nContent-Length: {size}\r\n") + body


def again(*paths: str, method: str = "GET", more: str = "", token: bool = True) -> Callable[[Target], Iterator[bytes]]:
    """Returns the given requests in an endless sequence. In a path, RUN and LONG are replaced by the two runs, MANY by
    one of the many runs, SWEEP by the sweep, and {n} by a number that changes.
    """

    def requests(target: Target) -> Iterator[bytes]:
        for n in itertools.count(random.randrange(1000)):
            path = paths[n % len(paths)].replace("RUN", target.run).replace("LONG", target.long)
            path = path.replace("MANY", target.many[n % len(target.many)]).replace("SWEEP", target.sweep)
            yield target.get(path.replace("{n}", str(n % 4000 + 1)), method, more, token)

    return requests


def once(*words: str, token: bool = True) -> Callable[[Target], Iterator[bytes]]:
    """Returns an attack of a single request."""
    return lambda target: itertools.islice(again(*words, token=token)(target), 1)


def nothing(target: Target) -> Iterator[bytes]:
    """Sends no byte to the server."""
    yield b""


def half_a_header(target: Target) -> Iterator[bytes]:
    yield target.get("/v1/me")[:-2] + b"X-Long: "


def no_http(target: Target) -> Iterator[bytes]:
    while True:
        yield b"\x16\x03\x01 no request\r\n\r\n"


def half_a_body(target: Target) -> Iterator[bytes]:
    """Sends a body of 1 MiB without its last byte."""
    yield target.post("/v1/cases:validate", b"#" * ((1 << 20) - 1), length=1 << 20)


def endless_chunks(target: Target) -> Iterator[bytes]:
    """Sends half a mebibyte of a chunked body, and never the end of the body."""
    head = target.get("/v1/cases:validate", "POST", "Content-Type: application/toml\r\nTransfer-Encoding: chunked\r\n")
    yield head + b"8000\r\n%s\r\n" % (b"#" * 0x8000) * 16


def hostile_bodies(target: Target) -> Iterator[bytes]:
    bodies = quadratic()
    for n in itertools.count(random.randrange(len(bodies))):
        _, kind, body = bodies[n % len(bodies)]
        yield target.post("/v1/cases:validate", body, kind)


def cases(target: Target) -> Iterator[bytes]:
    while True:
        yield target.post("/v1/cases:validate", case_text().encode())


def guesses(target: Target) -> Iterator[bytes]:
    for n in itertools.count():
        yield target.get("/v1/runs", more=f"Authorization: Bearer conoid_guess_{n}\r\n", token=False)


def many_at_once(target: Target) -> Iterator[bytes]:
    """Sends many requests on one connection before the first answer."""
    while True:
        yield target.get("/v1/cases") * 200


def adaptive(target: Target) -> Iterator[bytes]:
    """Sends reports of many adaptive sweeps, each of the largest allowed size."""
    points = [{"x": float(n), "changed": {"run.end_time": f"{n} us" * 8}, "run": target.run} for n in range(500)]
    report = {"name": "bar", "began": 1.0, "result": "time", "threshold": 0.0, "key": "run.end_time", "low": 0.0}
    body = json.dumps({**report, "high": 1.0, "tolerance": 0.1, "points": points}).encode()
    for n in itertools.count(random.randrange(1000)):
        more = f"Content-Length: {len(body)}\r\n"
        yield target.get(f"/v1/sweeps/adaptive/{n % 500:016x}", "PUT", more) + body


def swept_again(target: Target) -> Iterator[bytes]:
    """Starts again a sweep all of whose points have failed."""
    while True:
        yield target.post(f"/v1/sweeps/{target.sweep}:again", sweep_wish(), "application/json")


KINDS: dict[str, Attack] = {
    "event streams": Attack(once("/v1/runs/RUN/stream"), 300),
    "event streams without a reader": Attack(once("/v1/runs/RUN/stream"), 300, reads=False),
    "followed logs": Attack(once("/v1/runs/RUN/logs/0?follow=true"), 300),
    "waits for a change": Attack(once("/v1/runs/RUN?wait=60"), 300),
    "silent connections without a token": Attack(nothing, 300),
    "half headers without a token": Attack(half_a_header, 300),
    "idle connections of a user": Attack(once("/v1/me"), 300),
    "half bodies of a mebibyte": Attack(half_a_body, 400),
    "bodies in chunks without end": Attack(endless_chunks, 300),
    "bodies a byte at a time": Attack(cases, 200, drip=0.5),
    "headers a byte at a time": Attack(again("/v1/me"), 200, drip=0.5),
    "headers a byte at a time, at once": Attack(again("/v1/me", more=f"X-Long: {'x' * 20_000}\r\n"), 400, drip=1e-4),
    "10,000 events of 20 kB": Attack(again("/v1/runs/LONG/events?limit=10000"), 12),
    "10,000 events without a reader": Attack(again("/v1/runs/LONG/events?limit=10000"), 60, reads=False),
    "events from everywhere in a long journal": Attack(again("/v1/runs/LONG/events?after={n}&limit=10000"), 40),
    "histories of a long run": Attack(again("/v1/runs/LONG/history"), 60),
    "histories with ever other points": Attack(again("/v1/runs/LONG/history?points={n}"), 60),
    "snapshots of a long run": Attack(again("/v1/runs/LONG/snapshots"), 40),
    "label filters": Attack(again("/v1/runs?label=point%3D{n}", "/v1/runs?label=a%3Db&label=c%3Dd"), 40),
    "lists of 500 runs": Attack(again("/v1/runs?limit=500"), 40),
    "the gallery": Attack(again("/v1/cases"), 40),
    "HEADs of a large file": Attack(again("/v1/runs/RUN/files/large.bin", method="HEAD"), 40),
    "downloads without a reader": Attack(again("/v1/runs/RUN/files/large.bin"), 200, reads=False),
    "ranges of a byte": Attack(again("/v1/runs/RUN/files/large.bin", more="Range: bytes=7-7\r\n"), 60),
    "lists of many files": Attack(again("/v1/runs/RUN/files"), 40),
    "readiness without a token": Attack(again("/readyz", token=False), 60),
    "metrics": Attack(again("/metrics"), 40),
    "who asks": Attack(again("/v1/me"), 60),
    "hostile bodies": Attack(hostile_bodies, 50),
    "cases to be read": Attack(cases, 100),
    "OpenAPI without a reader, without a token": Attack(again("/openapi.json", token=False), 200, reads=False),
    "the schema of a case without a token": Attack(again("/v1/case.schema.json", token=False), 40),
    "guessed tokens": Attack(guesses, 60),
    "many requests on one connection": Attack(many_at_once, 20),
    "cancels of a run": Attack(again("/v1/runs/RUN:cancel?x", method="POST"), 40),
    "refusals without a token": Attack(again("/v1/runs", token=False), 60),
    "health without a token": Attack(again("/healthz", token=False), 60),
    "a connection for each request": Attack(again("/v1/me", more="Connection: close\r\n"), 60, pause=0.0),
    "lines that are no HTTP": Attack(no_http, 200, pause=0.0),
    "sweeps": Attack(again("/v1/sweeps?limit=500"), 40),
    "the table of 3,000 runs": Attack(again("/v1/table", "/v1/table?changed=1", "/v1/table?text=a&limit=500"), 60),
    "tables of words that no run has": Attack(again("/v1/table?text=x{n}%20y%20z%20u%20v", "/v1/table?case=*{n}*"), 60),
    "columns of a long history": Attack(again("/v1/runs/LONG/columns?name=*&points={n}"), 60),
    "histories of many journals of a million lines": Attack(again("/v1/runs/MANY/history"), 60),
    "fragments of a long run": Attack(again("/v1/runs/LONG/fragments/{n}"), 60),
    "reports of a run": Attack(again("/v1/runs/LONG:report", "/v1/runs/RUN:report", method="POST"), 60),
    "reports of adaptive sweeps": Attack(adaptive, 60),
    "a sweep run again and again": Attack(swept_again, 60),
    "addresses that are none": Attack(again("/v1/runs/{n}", "/%00{n}", "/v1/runs/%FF/files/x"), 60),
}


def attack(kind: str, target: Target) -> None:
    """Runs the attack until its time is over; after that all connections are closed."""
    chosen = KINDS[kind]
    crowd = [threading.Thread(target=one, args=(chosen, target), daemon=True) for _ in range(min(MOST, chosen.crowd))]
    for each in crowd:
        each.start()
    time.sleep(max(0.0, target.until - time.monotonic()))


def one(chosen: Attack, target: Target) -> None:
    """Opens a connection, and a new connection each time the server closes the connection."""
    while time.monotonic() < target.until:
        with suppress(OSError):
            place = urlsplit(target.url)
            with socket.create_connection((place.hostname or "", place.port or 0), timeout=60.0) as connection:
                talk(chosen, target, connection)
        time.sleep(chosen.pause)


def talk(chosen: Attack, target: Target, connection: socket.socket) -> None:
    answers = connection.makefile("rb")  # one reader for all answers: it may have read bytes of the next answer
    for request in chosen.requests(target):
        if time.monotonic() > target.until:
            return
        if chosen.drip:
            for n in range(len(request)):
                connection.sendall(request[n : n + 1])
                time.sleep(chosen.drip)
        connection.sendall(request)
        if chosen.reads and not answered(target, answers):
            return
        if not chosen.reads:
            target.answers[-1] += 1
    while time.monotonic() < target.until and chosen.reads and connection.recv(1 << 16):
        pass
    time.sleep(max(0.0, target.until - time.monotonic()))


def answered(target: Target, answers: BinaryIO) -> bool:
    """Reads the next answer of a connection. Returns False if the server has closed the connection."""
    words = answers.readline().split()
    target.answers[int(words[1]) if len(words) > 1 and words[1].isdigit() else 0] += 1
    length = 0
    while line := answers.readline().strip().lower():
        if line.startswith(b"content-length:"):
            length = int(line.partition(b":")[2])
    answers.read(length)
    return bool(words)


if __name__ == "__main__":
    os.nice(NICE)
    kind, url, token, run, long, many, sweep, seconds = sys.argv[1:]
    aimed = Target(url, token, run, long, many.split(","), sweep, time.monotonic() + float(seconds))
    attack(kind, aimed)
    print(json.dumps({str(status): count for status, count in sorted(aimed.answers.items())}))
