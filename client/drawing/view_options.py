"""Options of ``conoid view``, and the check of their values."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.figures import number, vector
from conoid.cases.reading.similar import allowed

from ..errors import LookError

SMALLEST = 64
"""Smallest width and smallest height of a picture, pixels (chosen values: in a smaller picture the body is not
recognizable)."""
ENDINGS = (".png", ".gif", ".mp4")
FILMS = (".gif", ".mp4")
_MOST_BANDS = 64
_RANGE = "limits (--range)"
"""Name of the option for the ends of the colour bar, in Python and on the command line."""
VECTORS = ("velocity", "displacement")


class Look(msgspec.Struct, kw_only=True, frozen=True):
    """Options of ``conoid view``."""

    mirror: str = "none"
    """Mirror planes: ``none``, ``auto`` (the planes of symmetry of the case), or planes such as ``x`` or
    ``x,y=0.002`` (m)."""
    section: str = ""
    """Section planes, written as in ``mirror``, or ``y=middle``. The side of a plane that faces the camera is cut
    away, and the cut surface shows the field."""
    whole: list[str] = []
    """Parts that sections do not cut."""
    hide: list[str] = []
    """Parts that are not drawn."""
    on: str = ""
    """Name of a set of the mesh file (``run.sets``, or a set of a boundary or a probe). Only tets with a node in
    this set are drawn."""
    opacity: dict[str, float] = {}
    """Opacity of parts: 0.3 is glassy, 1 is opaque. A part without a value is opaque."""
    focus: list[str] = []
    """Parts that fill the picture, for any position of the other parts; if empty, all parts fill the picture."""
    camera: str = ""
    """Direction from the body to the camera: ``front``, ``back``, ``left``, ``right``, ``top``, ``bottom``, ``iso``,
    an axis such as ``-x``, or a vector such as ``1,-1.5,0.6``. The default camera shows the planes of symmetry; a
    long body lies horizontally."""
    up: str = ""
    """Direction that points upwards in the picture: an axis or a vector. The default is z, or y for a camera along
    z. For a long body along z, the side that is not shown points upwards by default."""
    zoom: float = 1.0
    """Magnification; with 1 the body fills the picture."""
    size: tuple[int, int] = (1600, 1200)
    limits: tuple[float, float] | None = None
    """Smallest and largest value of the colour bar, in the unit of the field. The default is computed from
    ``percentiles``."""
    percentiles: tuple[float, float] = (0.5, 99.5)
    """Percentiles of the drawn values that are the ends of the colour bar, so that a few extreme tets do not set the
    range."""
    fixed: bool = False
    """True: the colour bar has the range of all frames of the run."""
    bands: int = 0
    """Number of colour bands; 0 means a continuous scale."""
    vectors: str = ""
    """Vector field that is drawn as arrows: ``velocity`` or ``displacement``."""
    raw: bool = False
    """True: draw the value of each tet. False: draw means at the nodes."""
    edges: bool = False
    """True: draw the edges of the mesh."""
    outlines: bool = True
    """True: draw lines round parts and fragments, and along sharp edges."""
    scale: bool = True
    """True: draw a scale bar beside the body."""
    captions: bool = True
    """True: draw title, colour bar or legend. False: draw only the body, its axes and the scale bar."""
    dark: bool = False
    """True: draw on a dark background."""
    transparent: bool = False
    """True: leave the background transparent."""
    rate: float = 8.0
    """Number of frames of a film for each second."""


def chosen(options: Mapping[str, Any], target: Path) -> Look:
    """Returns the options as a Look. Raises LookError for an unknown option, a value of the wrong type, or a value
    out of bounds.
    """
    for name in options.keys() - set(Look.__struct_fields__):
        raise LookError(f"{name}: unknown option; {allowed(name, Look.__struct_fields__)}")
    try:
        look = msgspec.convert(dict(options), Look)
    except msgspec.ValidationError as error:
        name = str(error).partition("$.")[2].rstrip("`").partition("[")[0]
        message = str(error).partition(" - at ")[0]
        raise LookError(f"{name} = {options.get(name)!r}: {message[:1].lower()}{message[1:]}") from None
    _require_scale(look)
    for name, value in (("zoom", look.zoom), ("rate", look.rate)):
        if not 0.0 < value < float("inf"):
            raise LookError(f"{name} = {number(value)}: must be above 0")
    if min(look.size) < SMALLEST:
        raise LookError(f"size = {look.size[0]}, {look.size[1]}: width and height must be at least {SMALLEST} pixels")
    if target.suffix.lower() not in ENDINGS:
        raise LookError(f"{target.name}: the name of a picture must end in .png, .gif or .mp4")
    return look


def _require_scale(look: Look) -> None:
    low, high = look.percentiles
    if not 0.0 <= low < high <= 100.0:
        raise LookError(
            f"percentiles = {vector((low, high), digits=6)}: allowed: two numbers from 0 to 100, the smaller number "
            "first"
        )
    if look.limits is not None and not look.limits[0] < look.limits[1]:
        raise LookError(f"{_RANGE} = {vector(look.limits, digits=6)}: allowed: two numbers, the smaller number first")
    if not 0 <= look.bands <= _MOST_BANDS or look.bands == 1:
        raise LookError(f"bands = {look.bands}: allowed: 2 to {_MOST_BANDS}, or 0 for a smooth scale")
    for part, value in look.opacity.items():
        if not 0.0 < value <= 1.0:
            raise LookError(
                f"opacity = {part}={number(value)}: must be above 0 and at most 1; --hide leaves a part out"
            )
    if look.vectors and look.vectors not in VECTORS:
        raise LookError(f"vectors = {look.vectors!r}: {allowed(look.vectors, VECTORS)}")
