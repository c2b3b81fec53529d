"""Position of the camera, number of columns of panels, and lengths for the scale bar; the module uses only numpy.
The projection is parallel: a length across the view has the same size in pixels everywhere, so that the scale bar is
valid for the whole picture.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import msgspec
import numpy as np

from conoid.cases.figures import exact

from .picture import Picture

Array: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"

FROM = (1.0, -1.55, 0.62)
"""Default direction from the body to the camera: from the front, the right and above (chosen value)."""
_ASIDE = 1.55
"""Component of the direction to the camera along the normal of a plane of symmetry; the components along other sides
are 1 (chosen value)."""
_LONG = 2.2
"""Ratio of the largest extent to the second largest above which a body counts as long. A long body lies horizontally in
the picture (chosen value)."""
_ALONG = (0.45, 0.5)
"""Components of the direction to the camera along a long body and along the upward axis. The component along the third
axis is 1.55 (chosen values)."""
_FILL = 0.84
"""Fraction of a panel that the body fills (chosen value)."""
_SCALE = 0.28
"""Largest length of the scale bar, relative to the width of a panel (chosen value)."""


@dataclass(frozen=True)
class Camera:
    """A camera with parallel projection. ``towards``, ``right`` and ``above`` are unit vectors. ``half`` is half of
    the height that a panel shows, m. The whole body lies within the distance ``deep`` of the centre, m.
    """

    centre: Array
    towards: Array
    right: Array
    above: Array
    half: float
    deep: float


def settled(picture: Picture, bounds: Array) -> Picture:
    """Returns the picture with a camera and an upward direction. ``bounds`` (3, 2): lowest and highest coordinates of
    the body, m.

    A camera that the user has chosen stays. The default camera shows the planes of symmetry, else the front, the
    right side and the top. A long body lies horizontally unless the user has chosen an upward direction.
    """
    if picture.camera is not None:
        return picture
    centre, extent = bounds.mean(axis=1), np.ptp(bounds, axis=1)
    for mirror in picture.mirrors:
        extent[mirror.axis] = 2.0 * np.abs(bounds[mirror.axis] - mirror.place).max()
    sides = {cut.axis: 1.0 if cut.place > centre[cut.axis] else -1.0 for cut in picture.cuts}
    longest, second = np.argsort(extent)[:-3:-1].tolist()
    if picture.up is None and extent[longest] > _LONG * extent[second]:
        towards, up = _beside(longest, sides)
        return msgspec.structs.replace(picture, camera=towards, up=up)
    return msgspec.structs.replace(picture, camera=_before({axis: sides[axis] for axis in sides if axis < 2}))


def _before(sides: dict[int, float]) -> tuple[float, float, float]:
    """Returns the direction to a camera that shows the given sides (-1 or 1) across x and y."""
    if not sides:
        return FROM
    x, y = sides.get(0, 0.8), sides.get(1, -0.8)
    return x * (_ASIDE if list(sides) == [0] else 1.0), y * (_ASIDE if list(sides) == [1] else 1.0), FROM[2]


def _beside(along: int, sides: dict[int, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Returns the direction to a camera that shows a long body from its side, and the upward direction.

    The lower end of the body is at the left of the picture, and z points upwards. If the body lies along z, the side
    that is not visible points upwards; planes of symmetry are seen from the front and from above.
    """
    if along < 2:
        shown, upper, face, top = 1 - along, 2, sides.get(1 - along, 1.0 if along else -1.0), 1.0
    else:
        x, y = sides.get(0, sides.get(1, -1.0)), sides.get(1, -sides.get(0, -1.0))
        shown, upper, face, top = (0, 1, x, y) if x * y < 0.0 else (1, 0, y, x)
    towards, up = np.zeros(3), np.zeros(3)
    towards[[shown, upper, along]] = _ASIDE * face, _ALONG[1] * top, _ALONG[0] * sides.get(along, 1.0)
    up[upper] = top
    return tuple(towards.tolist()), tuple(up.tolist())


def axes(direction: Sequence[float], up: Sequence[float] | None) -> tuple[Array, Array, Array]:
    """Returns the unit vectors to the camera, to the right and upwards. Without ``up`` the upward axis is z, or y for
    a camera along z.
    """
    towards = np.array(direction, float) / np.linalg.norm(direction)
    for above in (np.array(up, float) if up is not None else np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]),
                  np.array([1.0, 0.0, 0.0])):  # fmt: skip
        right = np.cross(above, towards)
        if np.linalg.norm(right) > 1e-6 * np.linalg.norm(above):
            right /= np.linalg.norm(right)
            return towards, right, np.cross(towards, right)
    raise AssertionError("at least one of y and x is not parallel to the view")


def reach(points: Sequence[Array], right: Array, above: Array) -> tuple[float, float, Array]:
    """Returns width and height of the smallest rectangle around all points in the view, and the centre of the points
    in space.
    """
    seen = [np.stack([each @ right, each @ above]) for each in points if len(each)]
    low = np.min([each.min(axis=1) for each in seen], axis=0)
    high = np.max([each.max(axis=1) for each in seen], axis=0)
    middle = np.mean([each.mean(axis=0) for each in points if len(each)], axis=0)
    across, along = 0.5 * (low + high)
    centre = middle + (across - middle @ right) * right + (along - middle @ above) * above
    return float(high[0] - low[0]), float(high[1] - low[1]), centre


def panels(n: int, body: tuple[float, float], room: tuple[float, float]) -> int:
    """Returns the number of columns, for ``n`` panels, with which a body of the given width and height is drawn
    largest.
    """
    width, height = body

    def largest(columns: int) -> float:
        rows = math.ceil(n / columns)
        return min(room[0] / columns / max(width, 1e-30), room[1] / rows / max(height, 1e-30))

    return max(range(1, n + 1), key=lambda columns: (largest(columns), -columns))


def place(points: Sequence[Array], every: Sequence[Array], picture: Picture, aspect: float) -> Camera:
    """Returns a camera that shows all ``points`` in a panel and stands outside of the points ``every``. ``aspect``:
    width of the panel over its height.
    """
    towards, right, above = axes(picture.camera or FROM, picture.up)
    width, height, centre = reach(points, right, above)
    half = 0.5 * max(height, width / aspect, 1e-30) / _FILL / picture.look.zoom
    deep = max(float(np.linalg.norm(each - centre, axis=1).max()) for each in every if len(each))
    return Camera(centre, towards, right, above, half, max(deep, half))


def round_length(most: float) -> float:
    """Returns the largest number of the sequence 1, 2, 5, 10, ... that is not above ``most``."""
    power = 10.0 ** math.floor(math.log10(most))
    return next(factor * power for factor in (5.0, 2.0, 1.0) if factor * power <= most * (1.0 + 1e-9))


def scale_bar(camera: Camera, aspect: float, room: float = math.inf) -> tuple[float, str]:
    """Returns the length and the text of the scale bar below the body: a round length of at most ``room``, m."""
    length = round_length(min(_SCALE * 2.0 * camera.half * aspect, room))
    return length, exact(length, "m", 3)
