"""Table of a sweep from files, without a server: from the file of a sweep in the folder of a server, or from the
file of an adaptive sweep.
"""

from pathlib import Path
from typing import Any

import msgspec

from conoid.cases import outcome
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout, points
from conoid.cases.output.points import Column, Point
from conoid.cases.reading import whole

from ..errors import UsageError
from . import adaptive_result


class _Plan(msgspec.Struct):
    """Content of the file of a sweep, which server/intake/sweeps.py writes."""

    points: list[dict[str, Any]]
    runs: list[str]


def file_named(text: str) -> Path | None:
    """Returns the path of a file; None if the text is the id of a sweep."""
    path = Path(text)
    return path if path.suffix == ".json" and path.is_file() else None


def columns_of(path: Path) -> list[Column]:
    """Returns the columns of the table of a sweep. Raises UsageError if the file is of another kind."""
    try:
        plan = msgspec.json.decode(whole.read(path), type=_Plan)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    except msgspec.MsgspecError:
        return adaptive_result.table(adaptive_result.read(path))
    pairs = zip(plan.points, plan.runs, strict=False)
    return points.table([_point(path.parent.parent / run, values) for values, run in pairs])


def _point(folder: Path, values: dict[str, Any]) -> Point:
    ended = _outcome(folder / layout.OUTCOME)
    if ended is None:
        return Point(values=values, run=folder.name)
    return Point(
        values=values, run=folder.name, state=ended.state, cause=ended.cause or "", results=points.results(ended)
    )


def _outcome(path: Path) -> Outcome | None:
    """Returns the outcome of a run; None for a run that has not ended, was removed, or has a damaged outcome."""
    try:
        return outcome.from_json(whole.read(path))
    except (OSError, ValueError):
        return None
