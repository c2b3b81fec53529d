"""The program that draws: started for one picture, ended where it hangs, its failures as one clear line.

VTK ends the process with a segmentation fault where it finds no way to draw off screen. In a child that becomes a
clear message.
"""

import os
import re
import subprocess
import sys
from ctypes.util import find_library
from pathlib import Path

import msgspec

from conoid.cases.figures import duration

from ..errors import ClientError, LookError, ViewError
from ..local.atomic import whole
from .picture import Drawn, Picture

_SECONDS = 180.0
"""s that a frame may take to be drawn. Chosen: without a graphics card a large one takes long."""


def render(picture: Picture) -> Drawn:
    """Draws in a child process; the file is there when all of it is. Raises ViewError that names what is missing."""
    with whole(Path(picture.out)) as part:
        code, told, errors = child(msgspec.structs.replace(picture, out=str(part)))
        if code:
            raise explain(code, errors.replace(str(part), picture.out))
    return msgspec.structs.replace(msgspec.json.decode(told, type=Drawn), out=picture.out)


def child(picture: Picture) -> tuple[int, bytes, str]:
    """Its exit code, its last line, and what it has complained of. Raises ViewError when it hangs."""
    command = [sys.executable, "-m", "conoid.client.drawing.render"]
    seconds = _SECONDS * max(1, len(picture.frames))
    try:
        done = subprocess.run(
            command, input=msgspec.json.encode(picture), capture_output=True, timeout=seconds, env=_environment()
        )
    except subprocess.TimeoutExpired:
        raise ViewError(f"the renderer did not finish within {duration(seconds)}") from None
    return done.returncode, b"".join(done.stdout.splitlines()[-1:]), done.stderr.decode(errors="replace")


def reason(error: Exception, out: str) -> str:
    """The line that the child tells of a failure; ``out`` is what it was to write."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or out}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__


def explain(code: int, errors: str) -> ClientError:
    """Why the child ended with ``code`` and this text on its standard error."""
    if code < 0 or code >= 128:
        return ViewError(
            f"the renderer crashed (signal {-code if code < 0 else code - 128}): VTK found no way to draw off screen; "
            "install the system package libegl1 (with libgl1-mesa-dri) or libosmesa6"
        )
    told = errors.strip().splitlines()[-1] if errors.strip() else f"the renderer ended with code {code}"
    if told.startswith("ModuleNotFoundError"):
        return ViewError(f"pictures need the extra 'view': pip install 'conoid[view]' ({told})")
    missing = re.search(r"(lib[\w+-]+)\.so[.\d]*: cannot open shared object", told)
    if missing:
        return ViewError(f"VTK needs the system library {missing[1]}; on Debian and Ubuntu: {_package(missing[1])}")
    return LookError(told) if code == LookError.exit_code else ViewError(told)


def _package(library: str) -> str:
    packages = {"libGL": "libgl1", "libEGL": "libegl1", "libXrender": "libxrender1", "libOSMesa": "libosmesa6"}
    return f"apt install {packages.get(library, library.lower())}"


def _environment() -> dict[str, str]:
    """Says which off-screen window VTK shall use, where that is known."""
    environment = dict(os.environ)
    if sys.platform.startswith("linux") and "VTK_DEFAULT_OPENGL_WINDOW" not in environment:
        for library, window in (("EGL", "vtkEGLRenderWindow"), ("OSMesa", "vtkOSOpenGLRenderWindow")):
            if find_library(library):
                return {**environment, "VTK_DEFAULT_OPENGL_WINDOW": window}
    return environment
