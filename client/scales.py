"""The scale of a picture: the ends of the colour bar, at round numbers, and its colours; numpy only."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .errors import ViewError
from .pictures import Field, Look

NAMED = ("classes", "fragments")
"""Kinds of fields whose values are names."""
_PARTS = 6
"""Parts of a colour bar, at most. Chosen."""


def rgb(colour: str) -> tuple[int, int, int]:
    """``#4c78a8`` as three numbers to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def blend(colours: Sequence[str]) -> list[str]:
    """256 colours from the first to the last."""
    corners = np.array([rgb(colour) for colour in colours], float)
    places = np.linspace(0, len(colours) - 1, 256)
    channels = np.stack([np.interp(places, range(len(colours)), corners[:, i]) for i in range(3)], axis=1)
    return ["#" + "".join(f"{round(value):02x}" for value in channel) for channel in channels.tolist()]


def ends(values: Sequence[Any], field: Field, look: Look) -> tuple[float, float, int]:
    """The ends of the colour bar of all ``values`` together, and the number of labels."""
    if look.limits is not None:
        return (*look.limits, _PARTS)
    every = np.concatenate([np.asarray(each, float).reshape(-1) for each in values])
    known = every[np.isfinite(every)]
    if not len(known):
        raise ViewError(f"{field.label}: no value of these frames is a number")
    low, high = (float(end) for end in np.percentile(known, look.percentiles))
    if field.kind == "centred":
        low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
    elif 0 < low < 0.1 * high:
        low = 0.0
    return rounded(low, high)


def rounded(low: float, high: float) -> tuple[float, float, int]:
    """Round numbers around ``low`` and ``high``, and how many there are from one to the other."""
    span = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-30)
    power = 10.0 ** np.floor(np.log10(span / 4))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if span / (factor * power) <= _PARTS)
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    last = max(last, first + 1)
    return float(first * step), float(last * step), int(last - first) + 1
