"""A child process that has loaded VTK and draws one picture after the other, as ``conoid.client.render`` draws one."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec

from conoid.client.errors import ViewError
from conoid.client.pictures import Drawn, Picture, _environment

_LOOP = """
import sys, msgspec
from conoid.client import render
from conoid.client.errors import ViewError
for line in sys.stdin.buffer:
    try:
        told = b"1" + msgspec.json.encode(render.draw(msgspec.json.decode(line, type=render.Picture)))
    except (ViewError, OSError, ValueError, RuntimeError) as error:
        told = b"0" + " ".join(str(error).split()).encode()
    print(told.decode(), flush=True)
"""


@contextmanager
def studio() -> Iterator[Callable[[Picture], Drawn]]:
    """What stands in for ``pictures.render``, without 3 s for the start of each."""
    child = subprocess.Popen(
        [sys.executable, "-c", _LOOP], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=_environment()
    )
    assert child.stdin is not None
    assert child.stdout is not None
    talk, listen = child.stdin, child.stdout

    def render(picture: Picture) -> Drawn:
        talk.write(msgspec.json.encode(picture) + b"\n")
        talk.flush()
        told = listen.readline()
        if told.startswith(b"1"):
            return msgspec.json.decode(told[1:], type=Drawn)
        raise ViewError(told[1:].decode().strip())

    with child:
        yield render
        talk.close()
