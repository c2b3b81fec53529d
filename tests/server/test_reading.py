"""Cost of reading a case: each case is read once, in a fork of a process that has loaded all modules."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest

from conoid.server.errors import ServiceError
from conoid.server.intake import reader
from conoid.server.intake.reader import Reader
from conoid.server.intake.reading import Question
from conoid.server.intake.submission import Desk
from conoid.server.requests.limits import Limits

from .running import PATIENCE, Running, case_text
from .sweep_bodies import ENDS, handed_in, wish

QUESTION = Question(
    body=case_text().encode(), json=False,
    limits=Limits(slots=2, elements=None, steps=None, memory=None, core_seconds=None, wall_time=None),
)  # fmt: skip
FIRST = """
import functools, gc, os, sys, msgspec
from conoid.server.intake import reading

def made():
    caches = [each for each in gc.get_objects() if isinstance(each, functools._lru_cache_wrapper)]
    return sum(each.cache_info().misses for each in caches if each.__module__.startswith("conoid."))

def first(question):
    modules, before = set(sys.modules), made()
    reading.read(msgspec.msgpack.decode(question, type=reading.Question))
    return f"{len(set(sys.modules) - modules)} {made() - before}"

def child(connection):
    connection.sendall(first(reading._received(connection)).encode())
    os._exit(0)

reading._child = child
if len(sys.argv) > 1:
    sys.exit(reading.main())
print(first(sys.stdin.buffer.read()))
"""


def test_a_case_finds_everything_loaded() -> None:
    """A fork loads no module and fills no cache that all cases share. The first case that another program reads loads
    the modules and fills the caches.
    """
    question = msgspec.msgpack.encode(QUESTION)
    alone = subprocess.run([sys.executable, "-c", FIRST], input=question, capture_output=True, check=True)
    control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection, its = socket.socketpair()
    program = subprocess.Popen([sys.executable, "-c", FIRST, "forks"], stdin=theirs.fileno())
    with program, control, theirs, connection, its:
        assert control.recv(1) == b"r"
        socket.send_fds(control, [b"c"], [its.fileno()])
        its.close()
        connection.sendall(question)
        connection.shutdown(socket.SHUT_WR)
        modules, made = connection.recv(100).split()
        control.close()
        theirs.close()
        assert program.wait(PATIENCE) == 0
    assert (int(modules), int(made)) == (0, 0)
    assert int(alone.stdout.split()[1]) > 0


def test_each_point_of_a_sweep_is_read_once(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    real, read = Desk.read, []

    def counted(self: Desk, *arguments: Any, **options: Any) -> Any:
        read.append(arguments)
        return real(self, *arguments, **options)

    monkeypatch.setattr(Desk, "read", counted)
    sweep = handed_in(server.ann, wish())
    assert len(read) == len(ENDS)
    for point in sweep["points"]:
        server.ann.wait_for(point["run"]["id"])


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[Reader]:
    """A reader that waits 0.5 s for its program."""
    monkeypatch.setattr(reader, "_FORK", 0.5)
    one = Reader()
    assert one.read(QUESTION).name == "bar"
    yield one
    one.close()


def program_of(one: Reader) -> int:
    assert one._program is not None
    return one._program._child.pid


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_has_ended_or_hangs_is_replaced(made: Reader, number: signal.Signals) -> None:
    before = program_of(made)
    os.kill(before, number)
    assert made.read(QUESTION).name == "bar"
    assert program_of(made) != before


def test_a_program_that_cannot_be_started_is_reported_in_time(made: Reader, monkeypatch: pytest.MonkeyPatch) -> None:
    os.kill(program_of(made), signal.SIGKILL)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(ServiceError, match="no case can be read now") as raised:
        made.read(QUESTION)
    assert raised.value.status == 503


def test_a_case_whose_process_hangs_is_given_up_and_delays_no_other(
    made: Reader, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "WALL", 0.0)
    monkeypatch.setattr(reader, "_REST", 2.0)
    assert made._program is not None
    connection, pid = made._program.begun()
    os.kill(pid, signal.SIGSTOP)
    pids: list[int] = []

    def ask() -> None:
        with pytest.raises(ServiceError, match="the case cannot be read now") as error:
            reader._answer(connection, pid, b"")
        pids.append(error.value.status)

    hung = threading.Thread(target=ask)
    hung.start()
    assert made.read(QUESTION).name == "bar"
    hung.join(PATIENCE)
    assert pids == [503]
    deadline = time.monotonic() + PATIENCE
    while os.path.exists(f"/proc/{pid}"):
        assert time.monotonic() < deadline, "its process is left"
