"""Lines round parts and fragments, and along sharp edges, found in the pixels that were drawn."""

from typing import Any

import numpy as np

from .offscreen import Exposure

_STRONG, _MIDDLE, _WEAK = 0.85, 0.6, 0.4
"""How dark a line is: round a part, where one thing is before another, round a fragment and along an edge. Chosen."""
_BEND = np.radians(38.0)
"""Angle between two faces from which on their edge has a line. Chosen: more than curved faces have."""
_EVEN = np.radians(12.0)
"""Angle within which a face has one slope. Chosen: a crack of a pixel's width has not."""
_WIDER = 1300
"""Pixels of a panel for each that a line is wide. Chosen."""
_JUMP = 5.0
"""Pixels by which the depth jumps where one thing is before another. Chosen."""


def lines(shown: Exposure, pixel: float, height: int) -> Any:
    """(height, width) how dark the line at each pixel is, 0 to 1; ``pixel``: its size, m; ``height`` of the panel."""
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
    """The values ``n`` pixels on, those at the border again and again."""
    places = np.clip(np.arange(values.shape[axis]) + n, 0, values.shape[axis] - 1)
    return np.take(values, places, axis=axis)


def _differs(number: Any, axis: int) -> Any:
    """Pixels beside one of another number."""
    return (number != _ahead(number, axis)) | (number != _ahead(number, axis, -1))


def _jumps(shown: Exposure, pixel: float, axis: int) -> Any:
    """Pixels of what is nearer, where the depth jumps more than the slopes on both sides explain."""
    steps = [_ahead(shown.depth, axis, n + 1) - _ahead(shown.depth, axis, n) for n in (-2, -1, 0, 1)]
    on = _is_jump(steps[2], steps[1], steps[3], _JUMP * pixel)
    back = _is_jump(-steps[1], -steps[2], -steps[0], _JUMP * pixel)
    return (shown.part > 0) & (on | back)


def _is_jump(step: Any, before: Any, after: Any, most: float) -> Any:
    """Where the depth grows by more than ``most`` and than the steps before and after, and stays so deep."""
    return (step > most) & (step + after > most) & (step - np.abs(before) > most) & (step - np.abs(after) > most)


def _bends(shown: Exposure, pixel: float, axis: int) -> Any:
    """Pixels of a part at which its face turns."""
    slopes = [_slope(shown, pixel, axis, n) for n in (-2, 1)]
    even = np.ones(shown.part.shape, bool)
    for n, slope in ((-3, slopes[0]), (2, slopes[1])):
        even &= np.abs(_slope(shown, pixel, axis, n) - slope) < _EVEN
    for n in (-2, -1, 1, 2):
        even &= _ahead(shown.fragment, axis, n) == shown.fragment
    return even & (np.abs(slopes[1] - slopes[0]) > _BEND) & ~_steep(slopes)


def _slope(shown: Exposure, pixel: float, axis: int, n: int) -> Any:
    """The angle of the face between the pixels ``n`` and ``n + 1`` on."""
    return np.arctan((_ahead(shown.depth, axis, n + 1) - _ahead(shown.depth, axis, n)) / pixel)


def _steep(slopes: Any) -> Any:
    """Faces that are seen nearly edge on have no slope that could be told from a jump."""
    return np.maximum(np.abs(slopes[0]), np.abs(slopes[1])) > np.radians(86.0)
