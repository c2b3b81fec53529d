"""Pictures of frames. This module asks for them; ``render`` draws them, in a process of its own.

A ``Picture`` is one drawing of one frame, of several side by side, or of several one after the other (a GIF).

VTK ends the process with a segmentation fault where it finds no way to draw off screen. In a child that becomes a
clear message.
"""

import math
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from ctypes.util import find_library
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.figures import duration, number, vector
from conoid.cases.similar import allowed

from .errors import ClientError, LookError, ViewError
from .saving import whole

_SECONDS = 180.0
"""s that a frame may take to be drawn. Chosen: without a graphics card a large one takes long."""


SMALLEST = 64
"""Pixels of a picture, each way. Chosen: below it nothing is to be seen."""

_VIRIDIS = "#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"
_CIVIDIS = "#3b496c", "#575d6d", "#707173", "#8a8779", "#a59c74", "#c3b369", "#e1cc55", "#fee838"
_PLASMA = "#5302a3", "#8b0aa5", "#b83289", "#db5c68", "#f48849", "#febd2a", "#f0f921"
"""Perceptual scales (van der Walt and Smith 2015, CC0; cividis: Nunez, Anderton and Renslow 2018) without their darkest
part: where a value is low, the shape of the body is to be seen."""
_STRAINED = "#d9dfe6", "#f7d889", "#f49a3d", "#d4432c", "#7c0f34"


@dataclass(frozen=True)
class Field:
    """How a field is shown: value times ``factor`` is in ``unit``; ``kind`` is linear, centred on 0, classes, or
    fragments: a colour each, muted for what was there at the start.

    ``colours`` is a map of matplotlib's, or colours to blend.
    """

    label: str
    unit: str = ""
    factor: float = 1.0
    colours: str | tuple[str, ...] = _VIRIDIS
    kind: str = "linear"


FIELDS = {
    "mises": Field("von Mises stress", "MPa", 1e-6),
    "pressure": Field("pressure", "MPa", 1e-6, "RdBu_r", "centred"),
    "principal_stress": Field("largest principal stress", "MPa", 1e-6, "RdBu_r", "centred"),
    "damage": Field("damage", "", 1.0, _STRAINED),
    "plastic_strain": Field("plastic strain", "", 1.0, _STRAINED),
    "temperature": Field("temperature", "K", 1.0, _PLASMA),
    "density": Field("density", "kg/m^3", 1.0),
    "effective_strain": Field("effective strain"),
    "strain_rate": Field("effective strain rate", "1/s", 1.0, _PLASMA),
    "contact_pressure": Field("contact pressure", "MPa", 1e-6, _PLASMA),
    "speed": Field("speed", "m/s", 1.0, _CIVIDIS),
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


class Look(msgspec.Struct, kw_only=True, frozen=True):
    """What a caller of ``view`` may choose."""

    mirror: str = "none"
    """``none``, ``auto`` (the planes of symmetry of the case), or planes such as ``x`` or ``x,y=0.002`` (m)."""
    section: str = ""
    """Planes, written as in ``mirror``: what lies between a plane and the camera is cut away."""
    camera: str = ""
    """From where the body is seen: an axis such as ``-x``, or a direction such as ``1,-1.5,0.6``; empty: from
    the side where planes of symmetry can be seen, and so that a long body lies along the picture."""
    up: str = ""
    """What points upwards in the picture, written as in ``camera``; empty: z, or y where the camera looks along z; of a
    body that is long along z the side that is not shown."""
    zoom: float = 1.0
    """1: the body fills the picture."""
    size: tuple[int, int] = (1600, 1200)
    limits: tuple[float, float] | None = None
    """Ends of the colour bar, in the field's unit; if not given, they come from ``percentiles``."""
    percentiles: tuple[float, float] = (0.5, 99.5)
    """Which values of the drawn surface are at the ends of the colour bar: a few extreme tets do not set it."""
    raw: bool = False
    """Values of each tet instead of means at the nodes."""
    edges: bool = False
    scale: bool = True
    """A bar of a round length beside the body."""
    transparent: bool = False
    """The ground of the picture is left out."""
    rate: float = 8.0
    """Frames a second of a GIF."""


class Picture(msgspec.Struct, kw_only=True, frozen=True):
    """Everything that ``render`` needs for one file; all frames have the camera and the colours in common."""

    frames: list[str]
    out: str
    field: str
    look: Look
    camera: tuple[float, float, float] | None = None
    up: tuple[float, float, float] | None = None
    mirrors: list[Mirror] = []
    sections: list[Mirror] = []
    cuts: list[Mirror] = []
    """Planes of symmetry that are not mirrored: the camera looks at them."""
    walls: list[Wall] = []
    parts: list[str] = []
    title: str = ""


class Drawn(msgspec.Struct, kw_only=True, frozen=True):
    """What a picture shows: its file, the extremes of the field over the drawn surfaces, the number of faces, the ends
    of the colour bar (none where colours are names), the times of its frames in s.
    """

    out: str
    field: str
    unit: str
    low: float
    high: float
    faces: int
    limits: tuple[float, float] | None = None
    times: list[float | None] = []


@dataclass(frozen=True)
class Scene:
    """What a picture takes from the case, when there is one: planes of symmetry, walls, names of the parts."""

    mirrors: tuple[Mirror, ...] = ()
    walls: tuple[Wall, ...] = ()
    parts: tuple[str, ...] = ()
    title: str = ""


def draw(
    frames: Sequence[Path], scene: Scene, name: str, field: str, out: Path | str | None = None, **options: Any
) -> Drawn:
    """Draws frame files: as a PNG, side by side where there are several, or one after the other as a GIF.

    ``options`` are the fields of ``Look``. ``out`` is by default named after ``name`` and the field, in the present
    folder. Raises ViewError.
    """
    require_field(field)
    look = _look(options)
    target = Path(out or f"{name}-{field}.png").resolve()
    _check(look, target)
    planes, sections = mirrors(look.mirror, scene), mirrors(look.section, scene, "section")
    if {plane.axis for plane in planes} & {plane.axis for plane in sections}:
        raise LookError(f"section = {look.section!r}: across an axis that is mirrored; leave one of the two out")
    picture = Picture(
        frames=[str(frame) for frame in frames], out=str(target), field=field, look=look,
        camera=direction(look.camera, "camera"), up=direction(look.up, "up"),
        mirrors=list(planes), sections=list(sections), cuts=[plane for plane in scene.mirrors if plane not in planes],
        walls=list(scene.walls), parts=list(scene.parts), title=scene.title,
    )  # fmt: skip
    return render(picture)


def _look(options: Mapping[str, Any]) -> Look:
    """Raises LookError for an option that there is none of, or of another kind."""
    for name in options.keys() - set(Look.__struct_fields__):
        raise LookError(f"{name}: there is no such option; {allowed(name, Look.__struct_fields__)}")
    try:
        return msgspec.convert(dict(options), Look)
    except msgspec.ValidationError as error:
        name = str(error).partition("$.")[2].rstrip("`").partition("[")[0]
        told = str(error).partition(" - at ")[0]
        raise LookError(f"{name} = {options.get(name)!r}: {told[:1].lower()}{told[1:]}") from None


_RANGE = "limits (--range)"
"""What Python and the command line call the ends of the colour bar."""


def _check(look: Look, target: Path) -> None:
    low, high = look.percentiles
    if not 0.0 <= low < high <= 100.0:
        raise LookError(
            f"percentiles = {vector((low, high), digits=6)}: two numbers from 0 to 100, the smaller one first"
        )
    if look.limits is not None and not look.limits[0] < look.limits[1]:
        raise LookError(f"{_RANGE} = {vector(look.limits, digits=6)}: two numbers, the lower end first")
    for name, value in (("zoom", look.zoom), ("rate", look.rate)):
        if not value > 0.0:
            raise LookError(f"{name} = {number(value)}: above 0")
    if min(look.size) < SMALLEST:
        raise LookError(f"size = {look.size[0]}, {look.size[1]}: width and height, at least {SMALLEST} pixels")
    if target.suffix.lower() not in {".png", ".gif"}:
        raise LookError(f"{target.name}: the name of a picture ends in .png or .gif")


def require_field(name: str) -> None:
    """Raises ViewError for a field that nobody knows."""
    if name not in FIELDS:
        raise LookError(f"field = {name!r}: {allowed(name, FIELDS)}")


_FARTHEST = 1e6
"""m from the origin that a plane may lie. Chosen: VTK draws in single precision."""
_NUMBER = r"[+-]?[0-9]*\.?[0-9]+(?:[eE][+-]?\d+)?"
_PLANE = re.compile(rf"\s*([xyz])\s*(?:=\s*({_NUMBER}))?\s*")
_AXIS = re.compile(r"\s*([+-]?)([xyz])\s*")
_DIRECTION = re.compile(rf"\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*")


def mirrors(text: str, scene: Scene, option: str = "mirror") -> tuple[Mirror, ...]:
    """The planes of an option such as ``auto``, ``none`` or ``x,y=0.002``. Raises ViewError."""
    if text in {"none", ""}:
        return ()
    if text == "auto" and option == "mirror":
        return scene.mirrors
    planes = [_PLANE.fullmatch(plane) for plane in text.split(",")]
    if None in planes:
        auto = "auto, none, or " if option == "mirror" else ""
        raise LookError(f"{option} = {text!r}: write {auto}planes such as x or x,y=0.002 (in m)")
    found = tuple(Mirror("xyz".index(plane[1]), float(plane[2] or 0.0)) for plane in planes if plane is not None)
    if not all(abs(plane.at) < _FARTHEST for plane in found):
        raise LookError(f"{option} = {text!r}: a plane within {number(_FARTHEST)} m")
    if option == "mirror" and len({plane.axis for plane in found}) < len(found):
        raise LookError(f"{option} = {text!r}: one plane across each axis")
    return found


def direction(text: str, option: str) -> tuple[float, float, float] | None:
    """``-x`` or ``1,-1.5,0.6`` as a vector; None for an empty text. Raises ViewError."""
    if not text:
        return None
    if axis := _AXIS.fullmatch(text):
        sign = -1.0 if axis[1] == "-" else 1.0
        return sign * (axis[2] == "x"), sign * (axis[2] == "y"), sign * (axis[2] == "z")
    found = _DIRECTION.fullmatch(text)
    parts = [float(each) for each in found.groups()] if found is not None else []
    largest = max(map(abs, parts), default=0.0)
    if not 0.0 < largest < math.inf:
        raise LookError(f"{option} = {text!r}: write an axis such as -x, or a direction such as 1,-1.5,0.6")
    x, y, z = (each / largest for each in parts)
    return x, y, z


def render(picture: Picture) -> Drawn:
    """Draws in a child process; the file is there when all of it is. Raises ViewError that names what is missing."""
    with whole(Path(picture.out)) as part:
        code, told, errors = child(msgspec.structs.replace(picture, out=str(part)))
        if code:
            raise explain(code, errors.replace(str(part), picture.out))
    return msgspec.structs.replace(msgspec.json.decode(told, type=Drawn), out=picture.out)


def child(picture: Picture) -> tuple[int, bytes, str]:
    """Its exit code, its last line, and what it has complained of. Raises ViewError when it hangs."""
    command = [sys.executable, "-m", "conoid.client.render"]
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
