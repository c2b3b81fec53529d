"""The colours of a picture: the ends of the colour bar, at round numbers, and colours for names; numpy only."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .errors import ViewError
from .pictures import Field, Look

PALETTE = (
    "#4c78a8", "#f58518", "#54a24b", "#e45756", "#72b7b2", "#b279a2", "#eeca3b", "#9d755d", "#ff9da6", "#bab0ac",
)  # fmt: skip
NAMED = ("classes", "fragments")
"""Kinds of fields whose values are names."""
BODIES = "#c9d3dc", "#d9cbb3", "#b7c9bd", "#c9bddb", "#dcc0c0", "#bcd2d8"
"""Of what was there at the start: muted, so that what has broken off stands out."""
_GOLDEN, _KNUTH = np.uint64(0x9E3779B97F4A7C15), np.uint64(2654435761)
"""2^64 and 2^32 over the golden ratio: multiples of them are far from each other (Knuth, volume 3, 6.4)."""
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


def class_colours(values: Any) -> Any:
    """One colour (n, 3) for each number of a part or rank."""
    return np.array([rgb(PALETTE[i % len(PALETTE)]) for i in np.asarray(values).astype(int)], np.uint8).reshape(-1, 3)


def fragment_colours(values: Any, bodies: int) -> Any:
    """One colour (n, 3) a fragment, by its number alone, so that it keeps it: web/colours.js has the same. The first
    ``bodies`` numbers are of what was there at the start.
    """
    numbers, which = np.unique(np.asarray(values).astype(np.int64), return_inverse=True)
    some = numbers.astype(np.uint64)
    turn = ((some + np.uint64(1)) * _GOLDEN >> np.uint64(40)).astype(float) / 2.0**24
    light = 0.55 + 0.14 * ((some * _KNUTH & np.uint64(255)).astype(float) / 255.0 - 0.5)
    k = (np.array([0.0, 8.0, 4.0]) + 12.0 * turn[:, None]) % 12.0
    share = light[:, None] - 0.2 * np.maximum(-1.0, np.minimum(np.minimum(k - 3.0, 9.0 - k), 1.0))
    colours = np.floor(255.0 * share + 0.5).astype(np.uint8)
    whole = numbers < bodies
    colours[whole] = np.array([rgb(BODIES[i % len(BODIES)]) for i in numbers[whole]], np.uint8).reshape(-1, 3)
    return colours[which.reshape(-1)]
