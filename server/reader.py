"""Has cases read by ``reading``, in processes with limits; decides who may have one read, and when."""

import asyncio
import atexit
import logging
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from pathlib import Path

import msgspec

from conoid.cases.load import CaseError

from .errors import ServiceError
from .reading import CPU, WALL, Answer, Question, Reading, address
from .settings import usable_cores

_log = logging.getLogger("conoid.server")
_PATIENCE = 30.0
"""s in which the program must have loaded what it needs. Chosen: it takes half a second."""
_WAITING = 100
"""Bodies of one owner that wait to be read. Chosen: each may have 1 MiB."""


class Reader:
    """A program that reads cases, started when it is first needed. May be used from any thread."""

    def __init__(self) -> None:
        """Starts nothing yet."""
        self._lock = threading.Lock()
        self._program: subprocess.Popen[bytes] | None = None
        self._folder = ""

    def read(self, question: Question) -> Reading:
        """Raises CaseError with every problem, ServiceError 422 for a case that costs too much, 503; RuntimeError."""
        try:
            told = self._ask(msgspec.msgpack.encode(question))
        except OSError as error:
            _log.error("a case cannot be read: %s", error)
            raise ServiceError(503, "unavailable", "no case can be read now", retryable=True) from error
        if not told:
            detail = f"the case takes too long to be read: more than {CPU} s, or too much memory"
            raise ServiceError(422, "too_costly", detail)
        answer = msgspec.msgpack.decode(told, type=Answer)
        if answer.crash:
            raise RuntimeError(answer.crash)
        if answer.reading is None:
            raise CaseError(answer.problems)
        return answer.reading

    def _ask(self, question: bytes) -> bytes:
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(WALL + _PATIENCE)
            with address(self._socket()) as there:
                connection.connect(there)
            connection.sendall(question)
            connection.shutdown(socket.SHUT_WR)
            chunks = []
            while chunk := connection.recv(1 << 16):
                chunks.append(chunk)
            return b"".join(chunks)

    def _socket(self) -> Path:
        with self._lock:
            if self._program is None or self._program.poll() is not None:
                self.close()
                self._start()
            return Path(self._folder) / "socket"

    def _start(self) -> None:
        self._folder = tempfile.mkdtemp(prefix="conoid-reader-")
        command = [sys.executable, "-m", "conoid.server.reading", str(Path(self._folder) / "socket")]
        self._program = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._program.stdout is not None
        if self._program.stdout.readline() != b"ready\n":
            raise OSError("the program that reads cases ended at its start")

    def close(self) -> None:
        """Ends the program."""
        if self._program is not None:
            self._program.kill()
            self._program.communicate()
            self._program = None
            shutil.rmtree(self._folder, ignore_errors=True)


@cache
def the_reader() -> Reader:
    """One a process: it keeps nothing between two cases."""
    made = Reader()
    atexit.register(made.close)
    return made


class Turns:
    """As many cases are read at a time as there are cores; one owner alone never takes the last of the places."""

    def __init__(self) -> None:
        """Belongs to the event loop."""
        self._places = max(2, usable_cores())
        self._all = asyncio.Semaphore(self._places)
        self._own: dict[str, asyncio.Semaphore] = {}
        self._waiting: dict[str, int] = {}

    @asynccontextmanager
    async def turn(self, owner: str) -> AsyncIterator[None]:
        """Waits for a place. Raises ServiceError 429 when too many of the owner wait already."""
        if self._waiting.get(owner, 0) >= _WAITING:
            detail = f"{_WAITING} of your cases wait to be read"
            raise ServiceError(429, "busy", detail, retryable=True, headers={"Retry-After": "5"})
        self._waiting[owner] = self._waiting.get(owner, 0) + 1
        try:
            async with self._own.setdefault(owner, asyncio.Semaphore(self._places - 1)), self._all:
                yield
        finally:
            self._waiting[owner] -= 1
            if not self._waiting[owner]:
                del self._waiting[owner], self._own[owner]
