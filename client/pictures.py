"""Pictures of frames. This module asks for them; ``render`` draws them, in a process of its own.

VTK ends the process with a segmentation fault where it finds no way to draw off screen. In a child that becomes a
clear message.
"""

import os
import re
import subprocess
import sys
from ctypes.util import find_library
from dataclasses import dataclass
from pathlib import Path

import msgspec

from .errors import ClientError, ViewError

_SECONDS = 180.0
"""s that a picture may take. Chosen: without a graphics card a large frame takes long."""


@dataclass(frozen=True)
class Field:
    """How a field is shown: value times ``factor`` is in ``unit``; ``kind`` is linear, centred on 0, classes, or
    fragments: a colour each, the largest one grey.

    ``colours`` is a map of matplotlib's, or colours to blend.
    """

    label: str
    unit: str = ""
    factor: float = 1.0
    colours: str | tuple[str, ...] = "viridis"
    kind: str = "linear"


FIELDS = {
    "mises": Field("von Mises stress", "MPa", 1e-6, "viridis"),
    "pressure": Field("pressure", "MPa", 1e-6, "RdBu_r", "centred"),
    "plastic_strain": Field("plastic strain", "", 1.0, ("#d9dfe6", "#f7d889", "#f49a3d", "#d4432c", "#7c0f34")),
    "temperature": Field("temperature", "K", 1.0, "plasma"),
    "speed": Field("speed", "m/s", 1.0, "cividis"),
    "part": Field("part", kind="classes"),
    "rank": Field("rank", kind="classes"),
    "fragment": Field("fragment", kind="fragments"),
}
"""The fields that ``view`` knows."""


class Mirror(msgspec.Struct, frozen=True):
    """Reflection in the plane ``axis = at``; ``axis`` is 0, 1 or 2, ``at`` in m."""

    axis: int
    at: float = 0.0


class Wall(msgspec.Struct, frozen=True):
    """A rigid wall to draw: a point on it, m, and its normal."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]


class Picture(msgspec.Struct, kw_only=True, frozen=True):
    """Everything that ``render`` needs for one PNG. ``limits`` are the ends of the colour bar, in the field's unit."""

    frame: str
    out: str
    field: str
    mirrors: list[Mirror] = []
    cuts: list[Mirror] = []
    """Planes of symmetry that are not mirrored: the camera looks at the section."""
    walls: list[Wall] = []
    parts: list[str] = []
    title: str = ""
    size: tuple[int, int] = (1600, 1200)
    limits: tuple[float, float] | None = None
    raw: bool = False
    """Values of each tet instead of means at the nodes."""
    edges: bool = False


class Drawn(msgspec.Struct, kw_only=True, frozen=True):
    """What a picture shows: its file, the extremes of the field over the drawn surface, the number of faces."""

    out: str
    field: str
    unit: str
    low: float
    high: float
    faces: int


@dataclass(frozen=True)
class Scene:
    """What a picture takes from the case, when there is one: planes of symmetry, walls, names of the parts."""

    mirrors: tuple[Mirror, ...] = ()
    walls: tuple[Wall, ...] = ()
    parts: tuple[str, ...] = ()
    title: str = ""


def draw(
    frame: Path,
    scene: Scene,
    name: str,
    field: str,
    out: Path | str | None = None,
    *,
    mirror: str = "none",
    size: tuple[int, int] = (1600, 1200),
    limits: tuple[float, float] | None = None,
    raw: bool = False,
    edges: bool = False,
) -> Drawn:
    """Draws a frame file as a PNG. Raises ViewError.

    ``mirror`` is ``none``, ``auto`` (the planes of symmetry of the scene), or planes such as ``x`` or ``x,y=0.002``
    (m). ``out`` is by default named after ``name`` and the field, in the present folder.
    """
    require_field(field)
    planes = mirrors(mirror, scene)
    cuts = [plane for plane in scene.mirrors if plane not in planes]
    target = Path(out or f"{name}-{field}.png").resolve()
    picture = Picture(
        frame=str(frame), out=str(target), field=field, mirrors=list(planes), cuts=cuts, walls=list(scene.walls),
        parts=list(scene.parts), title=scene.title, size=size, limits=limits, raw=raw, edges=edges,
    )  # fmt: skip
    return render(picture)


def require_field(name: str) -> None:
    """Raises ViewError for a field that nobody knows."""
    if name not in FIELDS:
        raise ViewError(f"field = {name!r}: allowed: {', '.join(FIELDS)}")


_PLANE = re.compile(r"\s*([xyz])\s*(?:=\s*([+-]?[0-9.]+(?:[eE][+-]?\d+)?))?\s*")


def mirrors(text: str, scene: Scene) -> tuple[Mirror, ...]:
    """The planes of an option such as ``auto``, ``none`` or ``x,y=0.002``. Raises ViewError."""
    if text in {"none", ""}:
        return ()
    if text == "auto":
        return scene.mirrors
    planes = [_PLANE.fullmatch(plane) for plane in text.split(",")]
    if None in planes:
        raise ViewError(f"mirror = {text!r}: write auto, none, or planes such as x or x,y=0.002 (in m)")
    return tuple(Mirror("xyz".index(plane[1]), float(plane[2] or 0.0)) for plane in planes if plane is not None)


def render(picture: Picture) -> Drawn:
    """Draws in a child process. Raises ViewError that names what is missing."""
    command = [sys.executable, "-m", "conoid.client.render"]
    try:
        done = subprocess.run(
            command, input=msgspec.json.encode(picture), capture_output=True, timeout=_SECONDS, env=_environment()
        )
    except subprocess.TimeoutExpired:
        raise ViewError(f"the renderer did not finish within {_SECONDS:.0f} s") from None
    if done.returncode == 0:
        return msgspec.json.decode(done.stdout.splitlines()[-1], type=Drawn)
    raise explain(done.returncode, done.stderr.decode(errors="replace"))


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
    return ViewError(told)


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
