"""Where the camera of a picture stands, how the panels are laid out, and what is a round length; numpy only.

The projection is parallel, so that lengths across the view are the same everywhere and a bar of a length is true.
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
"""Direction from the body to the camera where nothing else decides: from the front, the right and above. Chosen."""
_ASIDE = 1.55
"""How much more the camera looks at a plane of symmetry than at the other sides. Chosen."""
_LONG = 2.2
"""Times its second extent, from which on a body is long, and lies along the picture. Chosen."""
_ALONG = (0.45, 0.5)
"""Components of the direction to the camera along a long body and from the third side, where the one from the side that
it shows is 1.55. Chosen."""
_FILL = 0.84
"""Share of a panel that the body takes up. Chosen."""
_SCALE = 0.28
"""Largest share of a panel's width that the bar of a length takes up. Chosen."""


@dataclass(frozen=True)
class Camera:
    """A parallel view: unit vectors to the camera, to the right and upwards; ``half`` is half the height that a panel
    shows, m, and within ``deep`` of the centre, m, lies all of the body.
    """

    centre: Array
    towards: Array
    right: Array
    above: Array
    half: float
    deep: float


def settled(picture: Picture, bounds: Array) -> Picture:
    """The picture with a camera; ``bounds`` (3, 2): lowest and highest coordinates of the body, m.

    As it was asked for; else from the side where planes of symmetry can be seen, or from the front right and above. A
    long body lies along the picture, unless it was said what is up.
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
    """To a camera that sees the sides, -1 or 1, across x and y."""
    if not sides:
        return FROM
    x, y = sides.get(0, 0.8), sides.get(1, -0.8)
    return x * (_ASIDE if list(sides) == [0] else 1.0), y * (_ASIDE if list(sides) == [1] else 1.0), FROM[2]


def _beside(along: int, sides: dict[int, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """To a camera that sees a body along one axis from its side, the low end at the left, and what is up there: z; of a
    body along z the side that is not shown, so that planes of symmetry are seen from the front and from above.
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
    """Unit vectors to the camera, to the right and upwards; ``up`` is z, or y where the camera looks along z."""
    towards = np.array(direction, float) / np.linalg.norm(direction)
    for above in (np.array(up, float) if up is not None else np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]),
                  np.array([1.0, 0.0, 0.0])):  # fmt: skip
        right = np.cross(above, towards)
        if np.linalg.norm(right) > 1e-6 * np.linalg.norm(above):
            right /= np.linalg.norm(right)
            return towards, right, np.cross(towards, right)
    raise AssertionError("of y and x one is not along the view")


def reach(points: Sequence[Array], right: Array, above: Array) -> tuple[float, float, Array]:
    """Width and height of the smallest box round all points as they are seen, and its centre in space."""
    seen = [np.stack([each @ right, each @ above]) for each in points if len(each)]
    low = np.min([each.min(axis=1) for each in seen], axis=0)
    high = np.max([each.max(axis=1) for each in seen], axis=0)
    middle = np.mean([each.mean(axis=0) for each in points if len(each)], axis=0)
    across, along = 0.5 * (low + high)
    centre = middle + (across - middle @ right) * right + (along - middle @ above) * above
    return float(high[0] - low[0]), float(high[1] - low[1]), centre


def panels(n: int, body: tuple[float, float], room: tuple[float, float]) -> int:
    """Into how many columns ``n`` panels are laid so that a body of this width and height is drawn largest."""
    width, height = body

    def largest(columns: int) -> float:
        rows = math.ceil(n / columns)
        return min(room[0] / columns / max(width, 1e-30), room[1] / rows / max(height, 1e-30))

    return max(range(1, n + 1), key=lambda columns: (largest(columns), -columns))


def place(points: Sequence[Array], every: Sequence[Array], picture: Picture, aspect: float) -> Camera:
    """A camera that sees all ``points`` in a panel whose width over height is ``aspect``, and is before ``every``."""
    towards, right, above = axes(picture.camera or FROM, picture.up)
    width, height, centre = reach(points, right, above)
    half = 0.5 * max(height, width / aspect, 1e-30) / _FILL / picture.look.zoom
    deep = max(float(np.linalg.norm(each - centre, axis=1).max()) for each in every if len(each))
    return Camera(centre, towards, right, above, half, max(deep, half))


def round_length(most: float) -> float:
    """The largest of 1, 2, 5, 10 ... that is at most ``most``."""
    power = 10.0 ** math.floor(math.log10(most))
    return next(factor * power for factor in (5.0, 2.0, 1.0) if factor * power <= most * (1.0 + 1e-9))


def scale_bar(camera: Camera, aspect: float, room: float = math.inf) -> tuple[float, str]:
    """A round length in m that fits below the body and in ``room``, m, and how it is written."""
    length = round_length(min(_SCALE * 2.0 * camera.half * aspect, room))
    return length, exact(length, "m", 3)
