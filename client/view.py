"""The function ``view``, which draws frames of a result, a folder or a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .drawing.fields import require_field
from .drawing.picture import Drawn
from .drawing.scene import Scene, draw
from .errors import LookError, ViewError
from .result import Result


def view(
    source: Result | Path | str,
    field: str = "mises",
    out: Path | str | None = None,
    *,
    frame: int | Sequence[int] | None = None,
    time: float | str | Sequence[float | str] | None = None,
    **options: Any,
) -> Drawn:
    """Draws frames of a result, of a run folder, or of a frame file, as a PNG, a GIF or an MP4. Frames are selected
    as in ``Result.view``; ``options`` are the fields of ``conoid.client.drawing.view_options.Look``. Raises
    ViewError.
    """
    require_field(field)
    if isinstance(source, Result):
        return source.view(field, out, frame=frame, time=time, **options)
    path = Path(source)
    if path.is_dir():
        return Result.open(path).view(field, out, frame=frame, time=time, **options)
    if not path.is_file():
        raise ViewError(f"{path}: this run, folder or frame does not exist")
    if path.suffix not in {".vtkhdf", ".vtu"}:
        raise LookError(f"{path}: a frame file ends in .vtkhdf")
    if frame not in (None, []) or time not in (None, []):
        raise LookError(f"{path}: this is one frame; the options frame and time need a run")
    return draw([path], Scene(), path.resolve().stem, field, out, **options)
