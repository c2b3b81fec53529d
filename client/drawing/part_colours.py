"""Colours of parts and fragments: each part has a hue, and its fragments have variations of this hue. The module
uses only numpy. The function of web/colours.js is the same, so that page, report and pictures show a fragment in the
same colour.
"""

from typing import Any, TypeAlias

import numpy as np

Array: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"
Bytes: TypeAlias = "np.ndarray[Any, np.dtype[np.uint8]]"

HUES = np.array([252.0, 70.0, 165.0, 15.0, 305.0, 120.0, 205.0, 345.0])
"""Hues of the first parts in OKLCH, degrees (chosen values: colour-blind users can distinguish the first two hues)."""
_STEPS = tuple(np.uint64(step) for step in (0xD1B54A32D192ED03, 0xABC98388FB8FAC03, 0x8CB92BA72F3D8DD7))
"""Factors 2^64 / g^k with g = 1.2207, the root of g^4 = g + 1. The multiples of these factors fill a cube evenly
(Roberts 2018, R3)."""
_STRONG, _MUTED = (0.66, 0.12), (0.84, 0.045)
"""Lightness and chroma of the colour of a part, and of the colour of its intact body. The colour of the intact body
is muted, because fragments have stronger colours."""
_DARKER = 0.13
"""Difference of lightness between two parts with the same hue. After the last hue the hues repeat."""
REST = (140, 146, 152)
"""Colour of fragments that have no row in the table of fragments (number -1)."""


def of_names(numbers: Any) -> Bytes:
    """Returns (n, 3) colours for the numbers of parts or ranks, from 0."""
    found = np.asarray(numbers).astype(int).reshape(-1)
    light = _STRONG[0] - _DARKER * (found // len(HUES) % 3)
    return rgb(light, np.full(len(found), _STRONG[1]), HUES[found % len(HUES)])


def of_fragments(numbers: Any, parts: Any, bodies: int) -> Bytes:
    """Returns (n, 3) colours for fragments with the numbers ``numbers`` (n,) in the parts ``parts`` (n,). The first
    ``bodies`` numbers stand for the bodies at the start.
    """
    pairs = np.stack([np.asarray(numbers).astype(np.int64).reshape(-1), np.asarray(parts).astype(np.int64).reshape(-1)])
    (number, part), which = np.unique(pairs, axis=1, return_inverse=True)
    first, second, third = ((number.astype(np.uint64) + np.uint64(1)) * step >> np.uint64(40) for step in _STEPS)
    whole = number < bodies
    light = np.where(whole, _MUTED[0], 0.50 + 0.28 * _share(first))
    chroma = np.where(whole, _MUTED[1], 0.06 + 0.085 * _share(second))
    colours = rgb(light, chroma, HUES[part % len(HUES)] + np.where(whole, 0.0, 44.0 * (_share(third) - 0.5)))
    colours[number < 0] = REST
    return colours[which.reshape(-1)]


def _share(bits: Any) -> Array:
    """Returns 24 bits of a hash value as a number from 0 to 1."""
    return np.asarray(bits.astype(np.float64) / 2.0**24)


def rgb(light: Any, chroma: Any, hue: Any) -> Bytes:
    """Returns (n, 3) sRGB colours for OKLCH colours (Ottosson 2020) with light, chroma and hue (n,); the hue is in
    degrees.
    """
    angle = np.asarray(hue) * (np.pi / 180.0)
    a, b = chroma * np.cos(angle), chroma * np.sin(angle)
    long = (light + 0.3963377774 * a + 0.2158037573 * b) ** 3
    medium = (light - 0.1055613458 * a - 0.0638541728 * b) ** 3
    short = (light - 0.0894841775 * a - 1.2914855480 * b) ** 3
    linear = np.stack([
        4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short,
        -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short,
        -0.0041960863 * long - 0.7034186147 * medium + 1.7076147010 * short,
    ], axis=-1).clip(0.0, 1.0)  # fmt: skip
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.floor(255.0 * curved + 0.5).astype(np.uint8)


def css(colour: Any) -> str:
    """Returns a colour of three bytes as text, such as ``#4c78a8``."""
    return "#" + "".join(f"{int(byte):02x}" for byte in colour)
