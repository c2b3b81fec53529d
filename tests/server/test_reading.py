"""What it costs to read a case: each once, in a fork that has everything loaded."""

import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

from conoid.server.limits import Limits
from conoid.server.reading import Question, address
from conoid.server.submission import Desk

from .running import Running, case_text
from .swept import ENDS, handed_in, wish

QUESTION = Question(
    body=case_text().encode(), json=False,
    limits=Limits(slots=2, elements=None, steps=None, memory=None, core_seconds=None, wall_time=None),
)  # fmt: skip
TIMED = """
import os, sys, time, msgspec
from conoid.server import reading

def timed(question):
    began = time.process_time()
    reading.read(msgspec.msgpack.decode(question, type=reading.Question))
    return time.process_time() - began

def child(connection):
    connection.sendall(str(timed(reading._received(connection))).encode())
    os._exit(0)

reading._child = child
if len(sys.argv) > 1:
    sys.exit(reading.main(sys.argv[1]))
print(timed(sys.stdin.buffer.read()))
"""


def test_a_case_finds_everything_loaded(tmp_path: Path) -> None:
    """CPU time of the first fork, against that of a first case in a program of its own."""
    told = msgspec.msgpack.encode(QUESTION)
    alone = subprocess.run([sys.executable, "-c", TIMED], input=told, capture_output=True, check=True)
    folder = tmp_path / ("long" * 30)
    folder.mkdir()
    place = str(folder / "socket")
    program = subprocess.Popen([sys.executable, "-c", TIMED, place], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with program, socket.socket(socket.AF_UNIX) as connection:
        assert program.stdout is not None
        assert program.stdout.readline() == b"ready\n"
        with address(folder / "socket") as there:
            connection.connect(there)
        connection.sendall(told)
        connection.shutdown(socket.SHUT_WR)
        seconds = float(connection.recv(100))
        program.communicate()
    assert seconds < float(alone.stdout) / 3.0


def test_each_point_of_a_sweep_is_read_once(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    real, read = Desk.read, []

    def counted(self: Desk, *arguments: Any) -> Any:
        read.append(arguments)
        return real(self, *arguments)

    monkeypatch.setattr(Desk, "read", counted)
    sweep = handed_in(server.ann, wish())
    assert len(read) == len(ENDS)
    for point in sweep["points"]:
        server.ann.wait_for(point["run"]["id"])
