"""What a picture takes from the case of a run, and a picture of its frames."""

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
    """Nothing of it where there is no case to read."""

    mirrors: tuple[Mirror, ...] = ()
    walls: tuple[Wall, ...] = ()
    parts: tuple[str, ...] = ()
    title: str = ""
    frames: tuple[Path, ...] = ()
    """All frames of the run."""


def draw(
    frames: Sequence[Path], scene: Scene, name: str, field: str, out: Path | str | None = None, **options: Any
) -> Drawn:
    """Draws frame files: as a PNG, side by side where there are several, or one after the other as a GIF or MP4.

    ``options`` are the fields of ``Look``. ``out`` is by default named after ``name`` and the field, in the present
    folder. Raises ViewError.
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
    """The numbers of parts by name; where no case is there to name them, as they are in the frame. Raises LookError."""
    found = []
    for name in names:
        if name in parts:
            found.append(parts.index(name))
        elif not parts and name.isdigit():
            found.append(int(name))
        else:
            told = allowed(name, parts) if parts else "this frame has no names of parts, write their numbers"
            raise LookError(f"{option} = {name!r}: {told}")
    return found
