"""Reads cases in separate processes with limits (``reading``); the users take turns."""

import atexit
import logging
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from functools import cache

import msgspec

from conoid.cases.estimates.cores import usable_cores

from ..errors import ServiceError
from ..requests.thread_pool import ThreadPool
from .reading import CPU, PID, WALL, Answer, Question, Reading, WrongCaseError

_log = logging.getLogger("conoid.server")
_LOAD = 30.0
"""Time in s in which the program must load its modules. The value was chosen because loading takes half a second."""
_FORK = 10.0
"""Time in s in which the program must begin with a case; a slower program is replaced. The value was chosen because
this step takes 10 ms."""
_REST = 5.0
"""Time in s beyond ``WALL`` after which the server kills the process of a case (chosen value)."""
_WAITING = 100
"""Largest number of waiting bodies of one owner. The value was chosen because each body may have 1 MiB."""
CASE, SWEEP, FILES = 120.0, 900.0, 300.0
"""Longest times in s, with the waiting time (chosen values): for a case, for all cases of a sweep, and for a case
with files."""


def pool(patience: float) -> ThreadPool:
    """Returns a pool of threads that reads as many cases at a time as there are cores. Therefore a single owner never
    uses all threads.
    """
    places = max(2, usable_cores())
    return ThreadPool(each=places - 1, waiting=_WAITING, patience=patience, most=places)


def surveyors() -> ThreadPool:
    """Returns a pool of threads that reads one case with files of an owner at a time, and as many cases of all
    owners as there are cores."""
    return ThreadPool(each=1, waiting=_WAITING, patience=FILES, most=max(2, usable_cores()))


class Reader:
    """A program that reads cases. The program is started at the first case, and again if it has ended or hangs.
    Methods may be called from any thread.
    """

    def __init__(self) -> None:
        """Creates the object; no program is started yet."""
        self._lock = threading.Lock()
        self._program: _Program | None = None

    def read(self, question: Question) -> Reading:
        """Reads a case. Raises CaseError with every problem, ServiceError 422 for a case that takes too much time or
        memory, 503; RuntimeError."""
        data = self._ask(msgspec.msgpack.encode(question))
        if not data:
            detail = f"the case takes too long to be read: more than {CPU} s, or too much memory"
            raise ServiceError(422, "too_costly", detail)
        answer = msgspec.msgpack.decode(data, type=Answer)
        if answer.crash:
            raise RuntimeError(answer.crash)
        if answer.reading is None:
            raise WrongCaseError(answer.problems, answer.files)
        return answer.reading

    def _ask(self, question: bytes) -> bytes:
        """Returns a connection to the program, or to a new one. Raises ServiceError 503."""
        error: OSError | None = None
        for _ in range(2):
            try:
                program = self._running()
                connection, pid = program.begun()
            except OSError as raised:
                _log.error("the program that reads cases is started again: %s", raised)
                error = raised
                self.close()
            else:
                return _answer(connection, pid, question)
        raise ServiceError(503, "unavailable", "no case can be read now", retryable=True) from error

    def _running(self) -> "_Program":
        with self._lock:
            if self._program is None:
                self._program = _Program()
            return self._program

    def close(self) -> None:
        """Ends the program. A case that is being read is completed."""
        with self._lock:
            if self._program is not None:
                self._program.close()
            self._program = None


class _Program:
    """A running program that reads cases. The program receives a connection for each case, and forks a process for each
    connection.
    """

    def __init__(self) -> None:
        """Starts the program. Raises OSError."""
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            command = [sys.executable, "-P", "-m", "conoid.server.intake.reading"]
            self._child = subprocess.Popen(command, stdin=theirs.fileno(), stdout=subprocess.DEVNULL)
        self._control.settimeout(_LOAD)
        try:
            if not self._control.recv(1):
                raise OSError("it ended at its start")
        except OSError:
            self.close()
            raise
        self._control.settimeout(_FORK)

    def begun(self) -> tuple[socket.socket, int]:
        """Returns a connection to a process that waits for a case, and its process number. Raises OSError."""
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                socket.send_fds(self._control, [b"c"], [theirs.fileno()])
            ours.settimeout(_FORK)
            number = ours.recv(PID, socket.MSG_WAITALL)
            if len(number) < PID:
                raise OSError("it has ended")
            return ours, int.from_bytes(number)
        except BaseException:
            ours.close()
            raise

    def close(self) -> None:
        """Ends the program."""
        self._control.close()
        self._child.kill()
        self._child.wait()


def _answer(connection: socket.socket, pid: int, question: bytes) -> bytes:
    """Returns the answer of a process; empty if the process reached its limits. Raises ServiceError 503."""
    with connection:
        connection.settimeout(WALL + _REST)
        chunks = []
        try:
            connection.sendall(question)
            connection.shutdown(socket.SHUT_WR)
            while chunk := connection.recv(1 << 16):
                chunks.append(chunk)
        except TimeoutError:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            raise ServiceError(503, "unavailable", "the case cannot be read now", retryable=True) from None
        except ConnectionError:
            return b""
        return b"".join(chunks)


@cache
def the_reader() -> Reader:
    """Connection of a client to one process, which is closed after one case."""
    made = Reader()
    atexit.register(made.close)
    return made
