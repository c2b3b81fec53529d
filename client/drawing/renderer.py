"""Control of the process that draws a picture. A process that hangs is ended, and a failure is reported in one line. If
VTK cannot draw off screen, it ends its process with a segmentation fault. Pictures are drawn in a child process, so
that the user gets an error message.
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
"""Time limit for drawing a frame, s (chosen value: a large frame takes long without a graphics card)."""


def render(picture: Picture) -> Drawn:
    """Draws a picture in a child process. The file appears only when it is complete. Raises ViewError with the
    reason if the picture cannot be drawn.
    """
    with whole(Path(picture.out)) as part:
        code, answer, errors = child(msgspec.structs.replace(picture, out=str(part)))
        if code:
            raise explain(code, errors.replace(str(part), picture.out))
    return msgspec.structs.replace(msgspec.json.decode(answer, type=Drawn), out=picture.out)


def child(picture: Picture) -> tuple[int, bytes, str]:
    """Returns the exit code, the last line of standard output, and the standard error of the child process. Raises
    ViewError if the process hangs.
    """
    command = [sys.executable, "-P", "-m", "conoid.client.drawing.render"]
    seconds = _SECONDS * max(1, len(picture.frames))
    try:
        done = subprocess.run(
            command, input=msgspec.json.encode(picture), capture_output=True, timeout=seconds, env=_environment()
        )
    except subprocess.TimeoutExpired:
        raise ViewError(f"the renderer did not finish within {duration(seconds)}") from None
    return done.returncode, b"".join(done.stdout.splitlines()[-1:]), done.stderr.decode(errors="replace")


def reason(error: Exception, out: str) -> str:
    """Returns the error message for a failed child process. ``out``: file that the process should have written."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or out}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__


def explain(code: int, errors: str) -> ClientError:
    """Returns the reason of a failure, found from the exit code and the text on standard error."""
    if code < 0 or code >= 128:
        return ViewError(
            f"the renderer crashed (signal {-code if code < 0 else code - 128}): VTK found no way to draw off screen; "
            "install the system package libegl1 (with libgl1-mesa-dri) or libosmesa6"
        )
    message = errors.strip().splitlines()[-1] if errors.strip() else f"the renderer ended with code {code}"
    if message.startswith("ModuleNotFoundError"):
        return ViewError(f"pictures need the extra 'view': pip install 'conoid[view]' ({message})")
    missing = re.search(r"(lib[\w+-]+)\.so[.\d]*: cannot open shared object", message)
    if missing:
        return ViewError(f"VTK needs the system library {missing[1]}; on Debian and Ubuntu: {_package(missing[1])}")
    return LookError(message) if code == LookError.exit_code else ViewError(message)


def _package(library: str) -> str:
    packages = {"libGL": "libgl1", "libEGL": "libegl1", "libXrender": "libxrender1", "libOSMesa": "libosmesa6"}
    return f"apt install {packages.get(library, library.lower())}"


def _environment() -> dict[str, str]:
    """Returns the environment of the child process, with the variable that selects the off-screen window of VTK if
    the right window is known.
    """
    environment = dict(os.environ)
    if sys.platform.startswith("linux") and "VTK_DEFAULT_OPENGL_WINDOW" not in environment:
        for library, window in (("EGL", "vtkEGLRenderWindow"), ("OSMesa", "vtkOSOpenGLRenderWindow")):
            if find_library(library):
                return {**environment, "VTK_DEFAULT_OPENGL_WINDOW": window}
    return environment
