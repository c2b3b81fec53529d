"""Planes and directions of a picture in the notation of users: ``x,y=0.002``, ``-x``, ``1,-1.5,0.6``, ``top``."""

import math
import re

import msgspec

from conoid.cases.figures import number

from ..errors import LookError

Vector = tuple[float, float, float]


class Mirror(msgspec.Struct, frozen=True):
    """The plane ``axis = at``; ``axis`` is 0, 1 or 2, ``at`` is in m. If the ``at`` of a section is None, the plane
    passes through the middle of the body.
    """

    axis: int
    at: float | None = 0.0

    @property
    def place(self) -> float:
        """Position ``at`` of a plane whose position is given, m."""
        assert self.at is not None
        return self.at


class Wall(msgspec.Struct, frozen=True):
    """A rigid wall to draw: ``plane``, ``cylinder`` or ``sphere``."""

    point: Vector
    """A point of the plane or of the cylinder axis at the start, or the centre of the sphere, m."""
    direction: Vector = (0.0, 0.0, 1.0)
    """Normal of a plane, or axis of a cylinder."""
    shape: str = "plane"
    radius: float = 0.0
    """Radius of a cylinder or a sphere, m."""
    moves: bool = False
    """True if the wall moves; the frames have the position of a moving wall."""


VIEWS: dict[str, Vector] = {
    "front": (0.0, -1.0, 0.0), "back": (0.0, 1.0, 0.0), "left": (-1.0, 0.0, 0.0), "right": (1.0, 0.0, 0.0),
    "top": (0.0, 0.0, 1.0), "bottom": (0.0, 0.0, -1.0), "iso": (1.0, -1.0, 1.0),
}  # fmt: skip
"""Standard views, each with the direction from the body to the camera."""
_FARTHEST = 1e6
"""Largest distance of a plane from the origin, m (chosen value: VTK draws in single precision)."""
_NUMBER = r"[+-]?[0-9]*\.?[0-9]+(?:[eE][+-]?\d+)?"
_PLANE = re.compile(rf"\s*([xyz])\s*(?:=\s*({_NUMBER}|middle))?\s*")
_AXIS = re.compile(r"\s*([+-]?)([xyz])\s*")
_DIRECTION = re.compile(rf"\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*")


def mirrors(text: str, symmetry: tuple[Mirror, ...]) -> tuple[Mirror, ...]:
    """Returns the mirror planes for a text: ``auto`` (the planes of ``symmetry``), ``none``, or ``x,y=0.002`` with
    at most one plane for each axis. Raises LookError.
    """
    if text == "auto":
        return symmetry
    found = planes(text, "mirror")
    if len({plane.axis for plane in found}) < len(found):
        raise LookError(f"mirror = {text!r}: allowed: one plane for each axis")
    return found


def planes(text: str, option: str) -> tuple[Mirror, ...]:
    """Returns the planes for a text such as ``x,y=0.002``; no planes for ``none`` and for an empty text. Raises
    LookError.
    """
    if text in {"none", ""}:
        return ()
    read = [_PLANE.fullmatch(plane) for plane in text.split(",")]
    middles = [plane[2] == "middle" for plane in read if plane is not None]
    if None in read or (option == "mirror" and any(middles)):
        auto, middle = ("auto, none, or ", "") if option == "mirror" else ("", ", y=middle")
        raise LookError(f"{option} = {text!r}: allowed: {auto}planes such as x or x,y=0.002{middle} (in m)")
    found = tuple(
        Mirror("xyz".index(plane[1]), None if middle else float(plane[2] or 0.0))
        for plane, middle in zip(read, middles, strict=True)
        if plane is not None
    )
    if not all(plane.at is None or abs(plane.at) < _FARTHEST for plane in found):
        raise LookError(f"{option} = {text!r}: allowed: a plane within {number(_FARTHEST)} m of the origin")
    return found


def direction(text: str, option: str) -> Vector | None:
    """Returns the vector for a text: an axis such as ``-x``, components such as ``1,-1.5,0.6``, or the name of a
    view. Returns None for an empty text. Raises LookError.
    """
    if not text:
        return None
    if option == "camera" and text.strip() in VIEWS:
        return VIEWS[text.strip()]
    if axis := _AXIS.fullmatch(text):
        sign = -1.0 if axis[1] == "-" else 1.0
        return sign * (axis[2] == "x"), sign * (axis[2] == "y"), sign * (axis[2] == "z")
    found = _DIRECTION.fullmatch(text)
    parts = [float(each) for each in found.groups()] if found is not None else []
    largest = max(map(abs, parts), default=0.0)
    if not 0.0 < largest < math.inf:
        named = f", or one of {', '.join(VIEWS)}" if option == "camera" else ""
        raise LookError(f"{option} = {text!r}: allowed: an axis such as -x, a direction such as 1,-1.5,0.6{named}")
    x, y, z = (each / largest for each in parts)
    return x, y, z
