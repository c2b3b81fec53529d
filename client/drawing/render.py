"""Program that draws frames into one file: ``python -m conoid.client.drawing.render`` reads a Picture as JSON and
prints a Drawn.

The module ``surfaces`` makes the surfaces of a frame (a ``shot``), ``camera`` sets the view, ``offscreen`` draws the
shot and ``outlines`` adds lines. The module ``composition`` puts the panels on a ``picture_layout`` and adds
``captions``.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..errors import LookError, ViewError
from . import camera, films, scales, sets, surfaces, vtk, walls
from .composition import Printer
from .fields import FIELDS, NAMED
from .picture import Drawn, Picture
from .planes import Mirror
from .renderer import reason
from .scales import Scale
from .shot import Shot


def draw(picture: Picture) -> Drawn:
    """Draws a picture and writes the file ``picture.out``. Raises ViewError if a frame cannot be drawn."""
    field = FIELDS[picture.field]
    picture, shots = _shots(picture)
    values = [shot.shown for shot in shots]
    of = _all_values(picture) if picture.range_of and field.kind not in NAMED else values
    scale = None if field.kind in NAMED else scales.of(of, field, picture.look)
    Path(picture.out).parent.mkdir(parents=True, exist_ok=True)
    beyond = _save(picture, shots, scale)
    return Drawn(
        out=picture.out, field=picture.field, unit=field.unit,
        faces=sum(int(piece.surface.n_cells) for shot in shots for piece in shot.pieces),
        low=float(min(each.min() for each in values)), high=float(max(each.max() for each in values)),
        limits=(scale.low, scale.high) if scale and scale.uniform is None else None,
        times=[shot.time for shot in shots], beyond=beyond,
    )  # fmt: skip


def _shots(picture: Picture) -> tuple[Picture, list[Shot]]:
    """Reads all frames, and returns the picture with the camera that fits the first frame."""
    shots, bounds = [], []
    for path in picture.frames:
        mesh, time = vtk.read(path)
        there = walls.placed(mesh, picture)
        mesh = sets.of_set(mesh, picture.look.on)
        grid = surfaces.prepared(mesh, picture)
        bulk = surfaces.bulk(grid, picture)
        picture = camera.settled(_in_the_middle(picture, bulk), bulk)
        bounds.append(surfaces.extent(grid, np.ones(grid.n_cells, bool)))
        surfaces.require_sections(picture, np.array([bounds[-1]]))
        shots.append(Shot(surfaces.pieces(grid, picture, picture.camera or camera.FROM), time, bounds[-1], there))
    return picture, shots


def _in_the_middle(picture: Picture, bulk: Any) -> Picture:
    """Returns the picture with a position for each section. A section without position passes through the middle of
    the body and its mirror images.
    """
    middle = dict(enumerate(bulk.mean(axis=1).tolist())) | {one.axis: one.place for one in picture.mirrors}
    sections = [Mirror(one.axis, middle[one.axis]) if one.at is None else one for one in picture.sections]
    return msgspec.structs.replace(picture, sections=sections)


def _all_values(picture: Picture) -> list[Any]:
    """Returns the values of the field, for all tets or nodes, in the frames that set the range of the colour bar."""
    return [surfaces.values(vtk.read(path)[0], picture.field)[0] for path in picture.range_of]


def _save(picture: Picture, shots: Sequence[Shot], scale: Scale | None) -> int:
    """Writes the picture file, and returns the number of pieces of debris outside of the picture."""
    with Printer(picture, shots, scale) as printer:
        if picture.film:
            films.save((printer.image([shot]) for shot in shots), len(shots), picture.look.rate, Path(picture.out))
        else:
            printer.image(shots).save(picture.out)
        return printer.beyond


def main() -> int:
    """Reads a Picture from standard input, draws it, and prints the result as one line of JSON. An error is one line
    on standard error.
    """
    code, line = answer(sys.stdin.buffer.read())
    print(line, file=sys.stderr if code else sys.stdout)
    return code


def answer(asked: bytes) -> tuple[int, str]:
    """Returns the exit code and the line to print; ``asked``: a Picture as JSON."""
    picture = msgspec.json.decode(asked, type=Picture)
    try:
        return 0, msgspec.json.encode(draw(picture)).decode()
    except (ViewError, OSError, ValueError, RuntimeError) as error:
        return LookError.exit_code if isinstance(error, LookError) else 1, reason(error, picture.out)


if __name__ == "__main__":
    sys.exit(main())
