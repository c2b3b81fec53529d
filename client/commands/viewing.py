"""The command ``conoid view``: it draws frames as a picture or a film."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from conoid.cases.figures import si

from ..drawing.picture import Drawn
from ..errors import LookError
from ..remote.run_info import ID
from ..remote.session import connect
from ..result import seconds
from ..view import view
from . import view_arguments as asked
from .console import echo, echo_json
from .options import Json, Token, Url, aloud, complain, find

_NEAR = 0.005
"""Largest relative difference between the requested time and the time of the drawn frame for which no note is printed
(chosen value: times are shown with three digits)."""


def view_frames(
    source: asked.Source,
    field: asked.Field = "mises",
    out: asked.Out = None,
    frame: asked.Frame = None,
    time: asked.Time = None,
    mirror: asked.Mirror = "none",
    section: asked.Section = "",
    whole: asked.Whole = None,
    hide: asked.Hide = None,
    on: asked.On = "",
    opacity: asked.Opacity = None,
    focus: asked.Focus = None,
    camera: asked.Camera = "",
    up: asked.Up = "",
    zoom: asked.Zoom = 1.0,
    limits: asked.Limits = None,
    percentiles: asked.Percentiles = (0.5, 99.5),
    fixed: asked.Fixed = False,
    bands: asked.Bands = 0,
    vectors: asked.Vectors = "",
    size: asked.Size = (1600, 1200),
    raw: asked.Raw = False,
    edges: asked.Edges = False,
    outlines: asked.Outlines = True,
    scale: asked.Scale = True,
    captions: asked.Captions = True,
    dark: asked.Dark = False,
    transparent: asked.Transparent = False,
    rate: asked.Rate = 8.0,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Draw frames off screen: a PNG, several frames side by side, or all frames as a film (--out x.gif or x.mp4)."""
    options: dict[str, Any] = {
        "out": out, "frame": frame, "time": [seconds(each) for each in time or ()], "mirror": mirror,
        "section": section, "whole": whole or [], "hide": hide or [], "on": on, "opacity": _shares(opacity or ()),
        "focus": focus or [], "camera": camera, "up": up, "zoom": zoom, "limits": limits, "percentiles": percentiles,
        "fixed": fixed, "bands": bands, "vectors": vectors, "size": size, "raw": raw, "edges": edges,
        "outlines": outlines, "scale": scale, "captions": captions, "dark": dark, "transparent": transparent,
        "rate": rate,
    }  # fmt: skip
    drawn = _drawn(source, field, options, url, token)
    _tell_of_times(options["time"], drawn.times)
    if as_json:
        echo_json(drawn)
    else:
        echo(drawn.out)


def _drawn(source: str, field: str, options: dict[str, Any], url: str | None, token: str | None) -> Drawn:
    """Draws a frame file or a run in a folder. Draws a run of a server if ``source`` is an id."""
    with aloud("drawing"):
        if not re.fullmatch(ID, source) or Path(source).exists() or Path(source).suffix:
            return view(source, field, **options)
        with connect(url, token) as session:
            return view(find(session, source).result(), field, **options)


def _shares(texts: Sequence[str]) -> dict[str, float]:
    """Returns the opacity of each part from texts of the form ``PART=SHARE``. Raises LookError."""
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
    """Prints, for each requested time, the time of the nearest frame if the difference is not negligible."""
    for wanted, found in zip(asked, drawn[len(drawn) - len(asked) :], strict=True):
        if found is not None and abs(found - wanted) > _NEAR * max(abs(wanted), abs(found)):
            complain(f"time = {si(wanted, 's')}: the nearest frame has the time {si(found, 's')}")
