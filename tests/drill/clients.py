"""Faults of servers and disks that a client sees: every command must end in time, with one line, the right exit code,
and no incomplete file."""

import gzip
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from itertools import repeat
from pathlib import Path

from ..client.hostile import Answer, answering, head, hostile, run_info
from .judge import TRUE, Row
from .stand import Stand
from .strikes import emptied, filled

RUN = "0123456789abcdefghjkmn"
PATIENCE = 60.0
"""Time in s from its first request within which a command must give up. The client allows 40 s for the head of an
answer; the rest is a margin for a busy machine."""
Deed = Callable[[Stand], Iterator[Row]]


def groups() -> dict[str, tuple[str, Deed]]:
    """Returns the groups of faults by name."""
    found: dict[str, tuple[str, Deed]] = {
        f"clients, {name}": ("plain", partial(answered, name, answer)) for name, answer in ANSWERS.items()
    }
    found["clients, files that are not as they are listed"] = ("plain", files)
    found["clients, a full disk"] = ("disk", full)
    return found


def hangs() -> Iterator[bytes]:
    """Sends no byte for longer than any client waits."""
    time.sleep(2 * PATIENCE)
    yield b""


@cache
def bomb() -> bytes:
    """Returns 512 MiB of blanks, compressed."""
    return gzip.compress(b" " * (1 << 29), 1)


def endless(first: bytes, piece: bytes) -> Iterator[bytes]:
    """Sends the first piece of an answer, and another piece again and again."""
    yield first
    yield from repeat(piece)


def drips() -> Iterator[bytes]:
    """Sends the head of an answer at one character per second."""
    for letter in head(200, 10).decode():
        yield letter.encode()
        time.sleep(1.0)


def slow() -> Iterator[bytes]:
    """Sends the body of an answer at one byte per second."""
    yield head(200, 1 << 20)
    for _ in range(round(2 * PATIENCE)):
        yield b" "
        time.sleep(1.0)


ANSWERS: dict[str, Answer] = {
    "garbage": lambda: [os.urandom(4096)],
    "an answer that is no JSON": answering(b"<html>It works!</html>", kind="text/html"),
    "JSON of something else": answering({"version": 7, "items": []}),
    "JSON that is nested too deeply": answering(b"[" * 100_000),
    "half of an answer": lambda: [head(200, 5000), b'{"runs": ['],
    "more bytes than the header gives": lambda: [head(200, 2), b'{"runs": []' * 1000],
    "no answer at all": lambda: [],
    "an answer without end": partial(endless, head(200, None), b" " * 65536),
    "a head without end": partial(endless, b"HTTP/1.1 200 X\r\n", b"X-A: b\r\n" * 999),
    "a body that is packed a thousandfold": lambda: [head(200, None, more="Content-Encoding: gzip\r\n"), bomb()],
    "a redirect to elsewhere": lambda: [head(307, 0, more="Location: http://127.0.0.1:9/v1/runs\r\n")],
    "a status that is none": lambda: [head(999, 0)],
    "a server that hangs": hangs,
    "a head that comes by letters": drips,
    "a body that comes by letters": slow,
}  # fmt: skip


def answered(name: str, answer: Answer, stand: Stand) -> Iterator[Row]:
    """Gives one answer to every request."""
    asked = list[float]()

    def noted() -> Iterable[bytes]:
        asked.append(time.monotonic())
        return answer()

    with hostile() as server:
        for path in ("/v1/me", "/v1/runs", f"/v1/runs/{RUN}", f"/v1/runs/{RUN}/files", f"/v1/runs/{RUN}/events"):
            server.answers[path] = noted
        for words in (["ls"], ["show", RUN], ["get", RUN, "--out", str(stand.root / "copy")]):
            asked.clear()
            yield _row(f"{name}: {words[0]}", server.url, words, stand.root / "copy", asked=asked)


def files(stand: Stand) -> Iterator[Row]:
    """Tries lists of files with a wrong size, an incomplete body, a wrong checksum, and a name outside of the
    folder."""
    sizes = {"longer than it is": 9, "shorter than it is": 1}
    wrong: dict[str, tuple[dict[str, object], Answer]] = {
        name: ({"path": "a.csv", "size": size}, answering(b"12345")) for name, size in sizes.items()
    }
    wrong["cut off"] = ({"path": "a.csv", "size": 5}, lambda: [head(200, 5), b"12"])
    digest = "Repr-Digest: sha-256=:AAAA:\r\n"
    wrong["of another sum"] = ({"path": "a.csv", "size": 5}, lambda: [head(200, 5, more=digest), b"12345"])
    wrong["named out of the folder"] = ({"path": "../a.csv", "size": 5}, answering(b"12345"))
    for name, (line, body) in wrong.items():
        with hostile() as server:
            server.answers[f"/v1/runs/{RUN}"] = answering(run_info(id=RUN, state="succeeded"))
            server.answers[f"/v1/runs/{RUN}/files"] = answering({"files": [line]})
            server.answers[f"/v1/runs/{RUN}/files/a.csv"] = body
            yield _row(
                f"a file {name}: get", server.url, ["get", RUN, "--out", str(stand.root / "copy")], stand.root / "copy"
            )


def full(stand: Stand) -> Iterator[Row]:
    """Runs every command that writes, on a full disk. An existing file must not change."""
    run = stand.submit()
    stand.reached(run)
    assert stand.http is not None
    url, token = str(stand.http.base_url).rstrip("/"), stand.http.headers["Authorization"].partition(" ")[2]
    out, kept = stand.runs / "out", stand.runs / "out.toml"
    kept.write_text("as it was\n")
    filled(stand)
    try:
        commands = (
            ["get", run, "--out", str(out)], ["schema", "--out", str(kept)], ["schema", "--page", "--out", str(kept)],
            ["cases", "copy", "demo"], ["batch", "demo", "--out", str(out)],
            ["run", "demo", "--out", str(out)], ["materials", "--json"],
        )  # fmt: skip
        for words in commands:
            stdout = Path("/dev/full") if words[0] == "materials" else None
            yield _row(f"a full disk: {' '.join(words[:2])}", url, words, out, token, stdout, stand.runs)
        verdict = TRUE if kept.read_text() == "as it was\n" else "lie: a file that was there is another one"
        yield Row("a full disk: a file that was there", "client", "kept", 0.0, verdict)
    finally:
        emptied(stand)


def _row(
    name: str, url: str, words: list[str], copy: Path, token: str = "", stdout: Path | None = None,
    place: Path | None = None, asked: Sequence[float] = (),
) -> Row:  # fmt: skip
    """Runs one command in the folder ``place``; ``asked`` has the times of the requests to the server; the time of the
    command counts from the first request."""
    began = time.monotonic()
    environment = {**os.environ, "CONOID_URL": url, "CONOID_TOKEN": token, "NO_COLOR": "1"}
    out = stdout.open("w") if stdout else subprocess.PIPE
    try:
        done = subprocess.run(
            [sys.executable, "-m", "conoid.client.cli", *words], stdin=subprocess.DEVNULL, stdout=out,
            stderr=subprocess.PIPE, text=True, timeout=2 * PATIENCE, env=environment, check=False, cwd=place,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return Row(name, "client", "hangs", 2 * PATIENCE, "stranded: it has not ended")
    took = time.monotonic() - (asked[0] if asked else began)
    lines = [line for line in done.stderr.splitlines() if " so far" not in line]
    left = [path for path in copy.rglob("*") if path.is_file()] if copy.exists() else []
    return Row(name, "client", f"code {done.returncode}", took, _verdict(done.returncode, lines, left, took))


def _verdict(code: int, lines: list[str], left: list[Path], took: float) -> str:
    if code not in {1, 2}:
        return f"lie: it ends with {code}"
    if len(lines) != 1 or not lines[0].startswith("conoid: "):
        return f"not one line: {lines[-1] if lines else 'nothing'} ({len(lines)} lines)"
    if [path for path in left if path.suffix == ".part" or ".part" in path.name]:
        return f"a half is left: {left[0].name}"
    return TRUE if took <= PATIENCE else f"late: after {took:.0f} s"
