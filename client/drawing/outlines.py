"""Lines around parts and fragments and along sharp edges. The lines are computed from the pixels of a drawn panel."""

from typing import Any

import numpy as np

from .offscreen import Exposure

_STRONG, _MIDDLE, _WEAK = 0.85, 0.6, 0.4
"""Darkness of lines: around a part and at a jump of the depth, around a fragment, along an edge (chosen values)."""
_BEND = np.radians(38.0)
"""Angle between two faces above which a line is drawn along their common edge (chosen value: neighbouring faces of a
curved surface differ by a smaller angle)."""
_EVEN = np.radians(12.0)
"""Difference of slopes, as an angle, below which neighbouring pixels count as one face (chosen value: a crack with a
width of one pixel has a larger difference)."""
_WIDER = 1300
"""Height of a panel, pixels, for each pixel of line width (chosen value)."""
_JUMP = 5.0
"""Smallest jump of the depth between two bodies, as a multiple of the size of a pixel (chosen value)."""


def lines(shown: Exposure, pixel: float, height: int) -> Any:
    """Returns the darkness of the lines, (height, width), 0 to 1. ``pixel``: size of a pixel on the body, m;
    ``height``: height of the panel, pixels.
    """
    dark = np.zeros(shown.part.shape)
    for axis in (0, 1):
        for value, where in (
            (_WEAK, _bends(shown, pixel, axis)), (_WEAK, _differs(shown.fragment, axis)),
            (_MIDDLE, _jumps(shown, pixel, axis)), (_STRONG, _differs(shown.part, axis)),
            (_STRONG, _differs(shown.glass, axis)),
        ):  # fmt: skip
            np.maximum(dark, value * where, out=dark)
    for _ in range(round(height / _WIDER) - 1):
        dark = np.max([dark, *(_ahead(dark, axis) for axis in (0, 1))], axis=0)
    return dark * (shown.glass > 0)


def _ahead(values: Any, axis: int, n: int = 1) -> Any:
    """Returns the array shifted by ``n`` pixels along an axis; values at the border are repeated."""
    places = np.clip(np.arange(values.shape[axis]) + n, 0, values.shape[axis] - 1)
    return np.take(values, places, axis=axis)


def _differs(number: Any, axis: int) -> Any:
    """Returns True for pixels that have a neighbour with another number along an axis."""
    return (number != _ahead(number, axis)) | (number != _ahead(number, axis, -1))


def _jumps(shown: Exposure, pixel: float, axis: int) -> Any:
    """Returns True for pixels on the nearer side of a jump of the depth. A jump is larger than the slopes on both of
    its sides explain.
    """
    steps = [_ahead(shown.depth, axis, n + 1) - _ahead(shown.depth, axis, n) for n in (-2, -1, 0, 1)]
    on = _is_jump(steps[2], steps[1], steps[3], _JUMP * pixel)
    back = _is_jump(-steps[1], -steps[2], -steps[0], _JUMP * pixel)
    return (shown.part > 0) & (on | back)


def _is_jump(step: Any, before: Any, after: Any, most: float) -> Any:
    """Returns True where the depth increases by more than ``most`` and by more than in the neighbouring pixels, and
    does not decrease again.
    """
    return (step > most) & (step + after > most) & (step - np.abs(before) > most) & (step - np.abs(after) > most)


def _bends(shown: Exposure, pixel: float, axis: int) -> Any:
    """Returns True for pixels at which two faces of one part form an edge."""
    slopes = [_slope(shown, pixel, axis, n) for n in (-2, 1)]
    even = np.ones(shown.part.shape, bool)
    for n, slope in ((-3, slopes[0]), (2, slopes[1])):
        even &= np.abs(_slope(shown, pixel, axis, n) - slope) < _EVEN
    for n in (-2, -1, 1, 2):
        even &= _ahead(shown.fragment, axis, n) == shown.fragment
    return even & (np.abs(slopes[1] - slopes[0]) > _BEND) & ~_steep(slopes)


def _slope(shown: Exposure, pixel: float, axis: int, n: int) -> Any:
    """Returns the angle, rad, of the face between the pixels at the distances ``n`` and ``n + 1``."""
    return np.arctan((_ahead(shown.depth, axis, n + 1) - _ahead(shown.depth, axis, n)) / pixel)


def _steep(slopes: Any) -> Any:
    """Returns True for pixels of faces that are nearly parallel to the view. On such faces a slope cannot be
    distinguished from a jump.
    """
    return np.maximum(np.abs(slopes[0]), np.abs(slopes[1])) > np.radians(86.0)
