"""Reading of cases in separate processes with limits (module ``reading``). Cases of different users are read in
turn.
"""

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
"""Time in s within which the reading program must have loaded its modules; it takes half a second (reason of the chosen
value)."""
_FORK = 10.0
"""Time in s within which the reading program must start to read a case; a program that is slower is replaced. The
reading program usually starts within 10 ms (reason of the chosen value)."""
_REST = 5.0
"""Time in s after the limit ``WALL`` at which the server kills the process that reads a case (chosen value)."""
_WAITING = 100
"""Largest number of request bodies of one owner that wait; each has at most 1 MiB (reason of the chosen value)."""
CASE, SWEEP, FILES = 120.0, 900.0, 300.0
"""Largest times in s for a request, including the time that it waits: for a case, for all cases of a sweep, and for a
case with files (chosen values)."""


def pool(patience: float) -> ThreadPool:
    """Returns a pool of threads that reads as many cases at once as the machine has cores. A single owner never uses
    all threads of the pool.
    """
    places = max(2, usable_cores())
    return ThreadPool(each=places - 1, waiting=_WAITING, patience=patience, most=places)


def surveyors() -> ThreadPool:
    """Returns a pool of threads for cases with files. The pool reads one case of each owner at once, and at most as
    many cases as the machine has cores.
    """
    return ThreadPool(each=1, waiting=_WAITING, patience=FILES, most=max(2, usable_cores()))


class Reader:
    """Client of the program that reads cases. The program is started for the first case, and again after it has ended
    or does not answer. All methods of this class may be called from any thread.
    """

    def __init__(self) -> None:
        """Creates the object without starting the reading program."""
        self._lock = threading.Lock()
        self._program: _Program | None = None

    def read(self, question: Question) -> Reading:
        """Reads a case. Raises CaseError with every problem of the case; raises ServiceError with status 422 if the
        case takes too much time or memory, with 503 if the server is busy; raises RuntimeError if the reading program
        fails.
        """
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
        """Returns the answer of the reading program to a question; starts the program if necessary. Raises ServiceError
        with status 503 if the program does not start.
        """
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
        """Ends the reading program. A process that is reading a case at this time finishes its case."""
        with self._lock:
            if self._program is not None:
                self._program.close()
            self._program = None


class _Program:
    """A running program that reads cases. The reading program receives a connection for each case, and forks a process
    for each connection.
    """

    def __init__(self) -> None:
        """Starts the reading program. Raises OSError if the program cannot be started."""
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
        """Returns a connection to a process that waits for a case, and the process number. Raises OSError if the
        connection fails.
        """
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
        """Ends the reading program."""
        self._control.close()
        self._child.kill()
        self._child.wait()


def _answer(connection: socket.socket, pid: int, question: bytes) -> bytes:
    """Returns the answer of the process that reads a case; empty if the process has reached its limits. Raises
    ServiceError with status 503 if no process could be forked.
    """
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
