"""Arguments and options of the command ``view``."""

from pathlib import Path
from typing import Annotated

import typer

from ..drawing.fields import FIELDS
from ..drawing.planes import VIEWS
from ..drawing.view_options import SMALLEST, VECTORS

Source = Annotated[str, typer.Argument(metavar="SOURCE", help="The id of a run, a run folder, or a frame file.")]
Field = Annotated[str, typer.Option("--field", help=f"Field of the picture: {', '.join(FIELDS)}.")]
Out = Annotated[
    Path | None,
    typer.Option("--out", help="Picture (PNG) or film (GIF, MP4) to write; default: named after run and field."),
]
Frame = Annotated[
    list[int] | None,
    typer.Option(
        "--frame", help="Number of a frame (-1: the last frame); if repeated, the frames are drawn side by side."
    ),
]
Time = Annotated[
    list[str] | None, typer.Option("--time", help="Draw the frame nearest to a time such as '60 us'; may be repeated.")
]
Mirror = Annotated[
    str, typer.Option("--mirror", help="Mirror a half or quarter model: auto, or planes such as x,y=0.002 (m).")
]
Section = Annotated[
    str, typer.Option("--section", help="Cut away the material in front of planes such as x=middle,y=0.002 (m).")
]
Whole = Annotated[
    list[str] | None,
    typer.Option("--whole", metavar="PART", help="A part that sections do not cut; may be repeated."),
]
Hide = Annotated[
    list[str] | None, typer.Option("--hide", metavar="PART", help="A part that is not drawn; may be repeated.")
]
On = Annotated[
    str, typer.Option("--on", metavar="SET", help="Draw only the tets with a node in this set of the mesh file.")
]
Opacity = Annotated[
    list[str] | None, typer.Option("--opacity", metavar="PART=SHARE", help="Opacity of a part: target=0.3.")
]
Focus = Annotated[
    list[str] | None,
    typer.Option("--focus", metavar="PART", help="A part that fills the picture; may be repeated."),
]
Camera = Annotated[
    str, typer.Option("--camera", help=f"{', '.join(VIEWS)}, an axis such as -x, or a direction as 1,-1.5,0.6.")
]
Up = Annotated[str, typer.Option("--up", help="Upward direction: an axis such as -y, or a vector.")]
Zoom = Annotated[float, typer.Option("--zoom", help="Magnification; with 1 the body fills the picture.")]
Limits = Annotated[
    tuple[float, float] | None, typer.Option("--range", help="Smallest and largest value of the colour bar.")
]
Percentiles = Annotated[
    tuple[float, float],
    typer.Option(
        "--percentiles", help="Percentiles of the values at the ends of the colour bar, used without --range."
    ),
]
Fixed = Annotated[bool, typer.Option("--fixed", help="Use the range of values of all frames of the run.")]
Bands = Annotated[int, typer.Option("--bands", help="Number of colour bands; 0 means a smooth colour scale.")]
Vectors = Annotated[str, typer.Option("--vectors", help=f"Arrows on the surface: {', '.join(VECTORS)}.")]
Size = Annotated[tuple[int, int], typer.Option("--size", min=SMALLEST, max=16384, help="Width and height.")]
Raw = Annotated[bool, typer.Option("--raw", help="Draw the value of each tet instead of means at the nodes.")]
Edges = Annotated[bool, typer.Option("--edges", help="Draw the edges of the mesh.")]
Outlines = Annotated[
    bool, typer.Option("--outlines/--no-outlines", help="Draw lines round parts and fragments, and sharp edges.")
]
Scale = Annotated[bool, typer.Option("--scale/--no-scale", help="Draw a scale bar of a round length.")]
Captions = Annotated[
    bool, typer.Option("--captions/--no-captions", help="Draw title, colour bar or legend beside the body.")
]
Dark = Annotated[bool, typer.Option("--dark", help="Draw on a dark background.")]
Transparent = Annotated[bool, typer.Option("--transparent", help="Make the background transparent.")]
Rate = Annotated[float, typer.Option("--rate", help="Frames a second of a film.")]
