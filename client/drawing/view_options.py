"""What a caller of ``view`` may choose, and what is refused."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.figures import number, vector
from conoid.cases.reading.similar import allowed

from ..errors import LookError

SMALLEST = 64
"""Pixels of a picture, each way. Chosen: below it nothing is to be seen."""
ENDINGS = (".png", ".gif", ".mp4")
FILMS = (".gif", ".mp4")
_MOST_BANDS = 64
_RANGE = "limits (--range)"
"""What Python and the command line call the ends of the colour bar."""
VECTORS = ("velocity", "displacement")


class Look(msgspec.Struct, kw_only=True, frozen=True):
    """What a caller of ``view`` may choose."""

    mirror: str = "none"
    """``none``, ``auto`` (the planes of symmetry of the case), or planes such as ``x`` or ``x,y=0.002`` (m)."""
    section: str = ""
    """Planes, written as in ``mirror``: or ``y=middle``: what lies between one and the camera is cut away; the cut
    has the field."""
    whole: list[str] = []
    """Parts that sections leave whole."""
    hide: list[str] = []
    """Parts that are not drawn."""
    opacity: dict[str, float] = {}
    """Of parts: 0.3 is glassy; those that are not named are opaque."""
    focus: list[str] = []
    """Parts that fill the picture, whatever becomes of the others; empty: all."""
    camera: str = ""
    """From where the body is seen: ``front``, ``back``, ``left``, ``right``, ``top``, ``bottom``, ``iso``, an axis such
    as ``-x``, or a direction such as ``1,-1.5,0.6``; empty: from the side where planes of symmetry can be seen, and so
    that a long body lies along the picture."""
    up: str = ""
    """What points upwards in the picture: an axis or a direction; empty: z, or y where the camera looks along z; of a
    body that is long along z the side that is not shown."""
    zoom: float = 1.0
    """1: the body fills the picture."""
    size: tuple[int, int] = (1600, 1200)
    limits: tuple[float, float] | None = None
    """Ends of the colour bar, in the field's unit; if not given, they come from ``percentiles``."""
    percentiles: tuple[float, float] = (0.5, 99.5)
    """Which values of the drawn surface are at the ends of the colour bar: a few extreme tets do not set it."""
    fixed: bool = False
    """The colour bar is that of all frames of the run, whichever are drawn."""
    bands: int = 0
    """Number of colour bands; 0: a smooth scale."""
    vectors: str = ""
    """``velocity`` or ``displacement`` as arrows on the surface."""
    raw: bool = False
    """Values of each tet instead of means at the nodes."""
    edges: bool = False
    """The edges of the mesh."""
    outlines: bool = True
    """Lines round parts and fragments, and along sharp edges."""
    scale: bool = True
    """A bar of a round length beside the body."""
    captions: bool = True
    """Title, colour bar or legend; without them the body, its axes and the bar of a length are left."""
    dark: bool = False
    """A dark ground."""
    transparent: bool = False
    """The ground of the picture is left out."""
    rate: float = 8.0
    """Frames a second of a film."""


def chosen(options: Mapping[str, Any], target: Path) -> Look:
    """The options as a Look. Raises LookError for one that there is none of, of another kind or out of bounds."""
    for name in options.keys() - set(Look.__struct_fields__):
        raise LookError(f"{name}: there is no such option; {allowed(name, Look.__struct_fields__)}")
    try:
        look = msgspec.convert(dict(options), Look)
    except msgspec.ValidationError as error:
        name = str(error).partition("$.")[2].rstrip("`").partition("[")[0]
        told = str(error).partition(" - at ")[0]
        raise LookError(f"{name} = {options.get(name)!r}: {told[:1].lower()}{told[1:]}") from None
    _require_scale(look)
    for name, value in (("zoom", look.zoom), ("rate", look.rate)):
        if not 0.0 < value < float("inf"):
            raise LookError(f"{name} = {number(value)}: above 0")
    if min(look.size) < SMALLEST:
        raise LookError(f"size = {look.size[0]}, {look.size[1]}: width and height, at least {SMALLEST} pixels")
    if target.suffix.lower() not in ENDINGS:
        raise LookError(f"{target.name}: the name of a picture ends in .png, .gif or .mp4")
    return look


def _require_scale(look: Look) -> None:
    low, high = look.percentiles
    if not 0.0 <= low < high <= 100.0:
        raise LookError(
            f"percentiles = {vector((low, high), digits=6)}: two numbers from 0 to 100, the smaller one first"
        )
    if look.limits is not None and not look.limits[0] < look.limits[1]:
        raise LookError(f"{_RANGE} = {vector(look.limits, digits=6)}: two numbers, the lower end first")
    if not 0 <= look.bands <= _MOST_BANDS or look.bands == 1:
        raise LookError(f"bands = {look.bands}: 2 to {_MOST_BANDS}, or 0 for a smooth scale")
    for part, value in look.opacity.items():
        if not 0.0 < value <= 1.0:
            raise LookError(f"opacity = {part}={number(value)}: above 0, at most 1; --hide leaves a part out")
    if look.vectors and look.vectors not in VECTORS:
        raise LookError(f"vectors = {look.vectors!r}: {allowed(look.vectors, VECTORS)}")
