"""The command ``view``: frames as a picture or a film."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from conoid.cases.figures import si

from ..drawing.fields import FIELDS
from ..drawing.planes import VIEWS
from ..drawing.view_options import SMALLEST, VECTORS
from ..errors import LookError
from ..remote.run_info import ID
from ..remote.session import connect
from ..result import seconds
from ..view import view
from .console import echo, echo_json
from .options import Json, Token, Url, aloud, complain, find

_NEAR = 0.005
"""Relative difference of times below which no note is printed. Chosen value: three digits of a time are shown."""


def view_frames(
    source: Annotated[str, typer.Argument(metavar="SOURCE", help="A run's id, its folder, or a frame file.")],
    field: Annotated[str, typer.Option("--field", help=f"Field of the picture: {', '.join(FIELDS)}.")] = "mises",
    out: Annotated[
        Path | None, typer.Option("--out", help="A PNG, or a film (GIF, MP4); named after run and field if not given.")
    ] = None,
    frame: Annotated[
        list[int] | None,
        typer.Option("--frame", help="Number of a frame, -1: the last one; if repeated, frames stand side by side."),
    ] = None,
    time: Annotated[
        list[str] | None, typer.Option("--time", help="The frame nearest to a time such as '60 us'; may be repeated.")
    ] = None,
    mirror: Annotated[
        str, typer.Option("--mirror", help="Complete a half or quarter model: auto, or planes such as x,y=0.002 (m).")
    ] = "none",
    section: Annotated[
        str, typer.Option("--section", help="Cut away the material in front of planes such as x=middle,y=0.002 (m).")
    ] = "",
    whole: Annotated[
        list[str] | None,
        typer.Option("--whole", metavar="PART", help="A part that sections do not cut; may be repeated."),
    ] = None,
    hide: Annotated[
        list[str] | None, typer.Option("--hide", metavar="PART", help="A part that is not drawn; may be repeated.")
    ] = None,
    opacity: Annotated[
        list[str] | None, typer.Option("--opacity", metavar="PART=SHARE", help="Opacity of a part: target=0.3.")
    ] = None,
    focus: Annotated[
        list[str] | None,
        typer.Option("--focus", metavar="PART", help="A part that fills the picture; may be repeated."),
    ] = None,
    camera: Annotated[
        str, typer.Option("--camera", help=f"{', '.join(VIEWS)}, an axis such as -x, or a direction as 1,-1.5,0.6.")
    ] = "",
    up: Annotated[str, typer.Option("--up", help="Upward direction: an axis such as -y, or a vector.")] = "",
    zoom: Annotated[float, typer.Option("--zoom", help="1: the body fills the picture.")] = 1.0,
    limits: Annotated[tuple[float, float] | None, typer.Option("--range", help="Ends of the colour bar.")] = None,
    percentiles: Annotated[
        tuple[float, float],
        typer.Option("--percentiles", help="Values at the ends of the colour bar where --range is not given."),
    ] = (0.5, 99.5),
    fixed: Annotated[bool, typer.Option("--fixed", help="Use the range of all frames of the run.")] = (False),
    bands: Annotated[int, typer.Option("--bands", help="Number of colour bands; 0: a smooth scale.")] = 0,
    vectors: Annotated[str, typer.Option("--vectors", help=f"Arrows on the surface: {', '.join(VECTORS)}.")] = "",
    size: Annotated[tuple[int, int], typer.Option("--size", min=SMALLEST, max=16384, help="Width and height.")] = (
        1600,
        1200,
    ),
    raw: Annotated[bool, typer.Option("--raw", help="Values of every tet instead of means at the nodes.")] = False,
    edges: Annotated[bool, typer.Option("--edges", help="Draw the edges of the mesh.")] = False,
    outlines: Annotated[
        bool, typer.Option("--outlines/--no-outlines", help="Draw lines round parts and fragments, and sharp edges.")
    ] = True,
    scale: Annotated[bool, typer.Option("--scale/--no-scale", help="Draw a bar of a round length.")] = True,
    captions: Annotated[
        bool, typer.Option("--captions/--no-captions", help="Write title, colour bar or legend beside the body.")
    ] = True,
    dark: Annotated[bool, typer.Option("--dark", help="Draw on a dark background.")] = False,
    transparent: Annotated[bool, typer.Option("--transparent", help="Make the background transparent.")] = False,
    rate: Annotated[float, typer.Option("--rate", help="Frames a second of a film.")] = 8.0,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Draw frames off screen: as a PNG, several frames side by side, or as a film (--out x.gif or x.mp4, all
    frames).
    """
    options: dict[str, Any] = {
        "out": out, "frame": frame, "time": [seconds(each) for each in time or ()], "mirror": mirror,
        "section": section, "whole": whole or [], "hide": hide or [], "opacity": _shares(opacity or ()),
        "focus": focus or [], "camera": camera, "up": up, "zoom": zoom, "limits": limits, "percentiles": percentiles,
        "fixed": fixed, "bands": bands, "vectors": vectors, "size": size, "raw": raw, "edges": edges,
        "outlines": outlines, "scale": scale, "captions": captions, "dark": dark, "transparent": transparent,
        "rate": rate,
    }  # fmt: skip
    with aloud("drawing"):
        if not re.fullmatch(ID, source) or Path(source).exists() or Path(source).suffix:
            drawn = view(source, field, **options)
        else:
            with connect(url, token) as session:
                drawn = view(find(session, source).result(), field, **options)
    _tell_of_times(options["time"], drawn.times)
    if as_json:
        echo_json(drawn)
    else:
        echo(drawn.out)


def _shares(texts: Sequence[str]) -> dict[str, float]:
    """Returns the opacity of each part of ``PART=SHARE``. Raises LookError."""
    found = {}
    for text in texts:
        part, _, share = text.rpartition("=")
        try:
            found[part] = float(share)
        except ValueError:
            part = ""
        if not part:
            raise LookError(f"opacity = {text!r}: write PART=SHARE such as target=0.3")
    return found


def _tell_of_times(asked: list[float], drawn: list[float | None]) -> None:
    """Prints for each time the distance of the nearest frame if this distance is not negligible."""
    for wanted, found in zip(asked, drawn[len(drawn) - len(asked) :], strict=True):
        if found is not None and abs(found - wanted) > _NEAR * max(abs(wanted), abs(found)):
            complain(f"time = {si(wanted, 's')}: the nearest frame is of {si(found, 's')}")
