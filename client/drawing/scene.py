"""Data of a case for pictures, and the function ``draw``, which makes a picture from frame files."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.reading.similar import allowed

from ..errors import LookError
from . import renderer
from .fields import require_field
from .picture import Drawn, Picture
from .planes import Mirror, Wall, direction, mirrors, planes
from .view_options import chosen


@dataclass(frozen=True)
class Scene:
    """Data that a picture takes from the case of a run; all fields are empty if the case is not readable."""

    mirrors: tuple[Mirror, ...] = ()
    walls: tuple[Wall, ...] = ()
    parts: tuple[str, ...] = ()
    title: str = ""
    frames: tuple[Path, ...] = ()
    """Paths of all frames of the run."""


def draw(
    frames: Sequence[Path], scene: Scene, name: str, field: str, out: Path | str | None = None, **options: Any
) -> Drawn:
    """Draws frame files.

    One frame is drawn as a PNG. Several frames are drawn side by side in a PNG, or one after the other in a GIF or
    MP4. ``options`` are the fields of ``Look``. By default ``out`` is a file in the current folder, named after
    ``name`` and the field. Raises ViewError.
    """
    require_field(field)
    target = Path(out or f"{name}-{field}.png").resolve()
    look = chosen(options, target)
    mirrored = mirrors(look.mirror, scene.mirrors)
    opacity = {numbers([part], scene.parts, "opacity")[0]: value for part, value in look.opacity.items()}
    picture = Picture(
        frames=[str(frame) for frame in frames], out=str(target), field=field, look=look,
        camera=direction(look.camera, "camera"), up=direction(look.up, "up"),
        mirrors=list(mirrored), sections=list(planes(look.section, "section")),
        cuts=[plane for plane in scene.mirrors if plane not in mirrored],
        walls=list(scene.walls), parts=list(scene.parts), whole=numbers(look.whole, scene.parts, "whole"),
        hidden=numbers(look.hide, scene.parts, "hide"), focus=numbers(look.focus, scene.parts, "focus"),
        opacity=opacity, range_of=[str(frame) for frame in scene.frames] if look.fixed else [], title=scene.title,
    )  # fmt: skip
    return renderer.render(picture)


def numbers(names: Iterable[str], parts: Sequence[str], option: str) -> list[int]:
    """Returns the numbers of parts with the given names. If the case is not readable, the names must be the numbers
    of parts in the frame. Raises LookError.
    """
    found = []
    for name in names:
        if name in parts:
            found.append(parts.index(name))
        elif not parts and name.isdigit():
            found.append(int(name))
        else:
            hint = allowed(name, parts) if parts else "the frame has no names of parts; write the numbers of the parts"
            raise LookError(f"{option} = {name!r}: {hint}")
    return found
