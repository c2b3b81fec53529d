"""``view``: a picture of a frame, by whatever names it."""

from pathlib import Path
from typing import Any

from .errors import ViewError
from .pictures import Drawn, Scene, draw, require_field
from .result import Result


def view(
    source: Result | Path | str, field: str = "mises", out: Path | str | None = None, *, frame: int = -1, **options: Any
) -> Drawn:
    """Draws one frame of a result, of a run's folder, or a frame file, as a PNG. Raises ViewError.

    ``options`` are those of ``conoid.client.pictures.draw``.
    """
    require_field(field)
    if isinstance(source, Result):
        return source.view(field, out, frame=frame, **options)
    path = Path(source)
    if path.is_dir():
        return Result.open(path).view(field, out, frame=frame, **options)
    if not path.is_file():
        raise ViewError(f"{path}: there is no such run, folder or frame")
    if path.suffix not in {".vtkhdf", ".vtu"}:
        raise ViewError(f"{path}: a frame file ends in .vtkhdf")
    return draw(path, Scene(), path.resolve().stem, field, out, **options)
