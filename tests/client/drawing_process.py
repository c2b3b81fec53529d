"""A child process that has loaded VTK and draws pictures one after the other with ``render``."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec

from conoid.client.drawing.picture import Picture
from conoid.client.drawing.renderer import _environment

Ended = tuple[int, bytes, str]
"""Result of a drawing: exit code, last line of the output, and standard error."""

_LOOP = """
import sys
from conoid.client.drawing import render
for line in sys.stdin.buffer:
    code, answer = render.answer(line)
    print(f"{code}{answer}", flush=True)
"""


@contextmanager
def studio() -> Iterator[Callable[[Picture], Ended]]:
    """Replacement of ``renderer.child`` that avoids the 3 s for the start of each child process."""
    child = subprocess.Popen(
        [sys.executable, "-c", _LOOP], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=_environment()
    )
    assert child.stdin is not None
    assert child.stdout is not None
    talk, listen = child.stdin, child.stdout

    def draw(picture: Picture) -> Ended:
        talk.write(msgspec.json.encode(picture) + b"\n")
        talk.flush()
        line = listen.readline()
        code, text = int(line[:1]), line[1:]
        return code, text, text.decode() if code else ""

    with child:
        yield draw
        talk.close()
