"""Scale of a picture: the colours of the colour bar, and round numbers at its ends. The module uses only numpy."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ViewError
from .fields import Field
from .view_options import Look

_PARTS = 6
"""Largest number of intervals between the values of a colour bar (chosen value)."""
_UNIFORM = "#9fb0c0"
"""Colour of a uniform field. No colour scale contains this colour, so that a uniform field cannot be mistaken for a low
or a high value (chosen value)."""
_ALIKE = 1e-9
"""Relative difference below which two values are equal except for rounding (chosen value)."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Returns a colour such as ``#4c78a8`` as three numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def blend(colours: Sequence[str], n: int = 256) -> list[str]:
    """Returns ``n`` colours from the first to the last colour, interpolated between ``colours``."""
    corners = np.array([rgb(colour) for colour in colours], float)
    places = np.linspace(0, len(colours) - 1, n)
    channels = np.stack([np.interp(places, range(len(colours)), corners[:, i]) for i in range(3)], axis=1)
    return ["#" + "".join(f"{round(value):02x}" for value in channel) for channel in channels.tolist()]


@dataclass(frozen=True)
class Scale:
    """The colour bar: its ends in the unit of the field, the values that are written beside it, and its colours from
    low to high. A uniform field has the value ``uniform``, one colour and no ends.
    """

    low: float
    high: float
    ticks: list[float]
    colours: list[str]
    uniform: float | None = None


def of(values: Sequence[Any], field: Field, look: Look) -> Scale:
    """Returns the scale for ``values``, the field in all panels."""
    every = np.concatenate([np.asarray(each, float).reshape(-1) for each in values])
    known = every[np.isfinite(every)]
    if not len(known):
        raise ViewError(f"{field.label}: no value of the drawn frames is a number")
    least, most = float(known.min()), float(known.max())
    if look.limits is None and most - least <= max(field.floor, _ALIKE * max(abs(least), abs(most))):
        return Scale(least, most, [], [_UNIFORM], 0.5 * (least + most))
    low, high = _ends(known, field, look)
    return Scale(low, high, ticks(low, high), blend(field.colours, look.bands or 256))


def _ends(known: Any, field: Field, look: Look) -> tuple[float, float]:
    if look.limits is not None:
        return look.limits
    low, high = (float(end) for end in np.percentile(known, look.percentiles))
    if field.kind == "centred":
        low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
    elif 0 < low < 0.1 * high:
        low = 0.0
    return rounded(low, high)


def rounded(low: float, high: float) -> tuple[float, float]:
    """Returns round numbers below ``low`` and above ``high``."""
    step = _step(low, high)
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    return float(first * step), float(max(last, first + 1) * step)


def ticks(low: float, high: float) -> list[float]:
    """Returns both ends and the round numbers between them. Round numbers that are close to an end are left out."""
    step = _step(low, high)
    first, last = np.ceil(low / step + 0.4), np.floor(high / step - 0.4)
    return [low, *(float(n * step) for n in np.arange(first, last + 1)), high]


def _step(low: float, high: float) -> float:
    """Returns a round interval with which at most ``_PARTS`` intervals lie between ``low`` and ``high``."""
    span = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-30)
    power = 10.0 ** np.floor(np.log10(span / 4))
    return float(next(f * power for f in (1, 2, 2.5, 5, 10) if span / (f * power) <= _PARTS + 1e-9))
