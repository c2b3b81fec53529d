"""Restart: a new run continues from a checkpoint of another run. The new run has hard links to the files of the other
run.
"""

import json
import os
import shutil
from contextlib import suppress
from pathlib import Path

from conoid.cases.load import apply_overrides, read_data
from conoid.cases.output import checkpoints, fragments, layout
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State

from ..errors import ServiceError
from .folder import outcome

_TRIES = 5
"""Number of attempts to link the newest checkpoint: a run that is running may remove it meanwhile (chosen value)."""
LABEL = "restart"
"""Name of the label of the new run whose value is the id of the run that it continues."""


def body(case: Path, ranks: int | None, threads: int | None = None, max_steps: int | None = None) -> dict[str, object]:
    """Returns the case of a run with other ranks, threads and ``run.max_steps``; None changes nothing. Raises CaseError
    or OSError.
    """
    whole.check(case)
    wanted = {"run.ranks": ranks, "run.threads": threads, "run.max_steps": max_steps}
    return apply_overrides(read_data(case), {key: value for key, value in wanted.items() if value is not None})


def check(source: Path, max_steps: int | None) -> None:
    """Raises ServiceError with status 409 if a run that continues ``source`` would have no step left. ``max_steps``:
    None stands for the value in the case of ``source``.
    """
    ended = outcome(source)
    spent = ended is not None and ended.cause == Cause.STEPS
    newest = next((int(place.name) for place in checkpoints.found(source)), 0)
    reached = (ended.steps or newest) if ended is not None and spent else newest
    if spent if max_steps is None else max_steps <= reached:
        given = "" if max_steps is None else f"max_steps = {max_steps}: "
        detail = f"{given}run {source.name} has gone {reached} steps; give max_steps a number above {reached}"
        raise ServiceError(409, "no_steps_left", detail, pointer="max_steps")


def fill(source: Path, folder: Path) -> None:
    """Makes links to the checkpoints, frames and history of ``source`` in the folder of the new run.

    The worker then takes the newest checkpoint whose files have the right hashes, and removes later frames and history
    lines. Raises ServiceError with status 409 or 503; raises OSError.
    """
    if not any(_taken(source, folder / layout.CHECKPOINTS) for _ in range(_TRIES)):
        detail = f"the checkpoints of run {source.name} are replaced faster than they can be linked"
        raise ServiceError(503, "unavailable", detail, retryable=True)
    for name, copy in ((layout.FRAMES, _link), (fragments.FOLDER, _copy)):
        if (source / name).is_dir():
            shutil.copytree(source / name, folder / name, copy_function=copy)
    _copy(str(source / layout.HISTORY), str(folder / layout.HISTORY))


def _taken(source: Path, target: Path) -> bool:
    """Makes links to every checkpoint that has a complete manifest. Returns False if checkpoints were removed
    meanwhile: a run that is running keeps only its newest checkpoints. Raises ServiceError with status 409 if there is
    none.
    """
    damaged: list[str] = []
    taken = 0
    places = checkpoints.found(source)
    for place in places:
        try:
            checkpoints.manifest_of(place)
            shutil.copytree(place, target / place.name, copy_function=_link)
            taken += 1
        except checkpoints.DamagedError as error:
            if place.is_dir():
                damaged.append(f"{place.name}: {error}")
                _describe(place, target / place.name)
        except OSError:  # shutil.Error is an OSError, too
            shutil.rmtree(target / place.name, ignore_errors=True)
            if place.is_dir():
                raise
    if not places or len(damaged) == len(places):
        why = f"all are damaged; {'; '.join(damaged)}" if damaged else _why(source)
        raise ServiceError(409, "no_checkpoint", f"run {source.name} has no checkpoint: {why}")
    return taken > 0


def _describe(place: Path, target: Path) -> None:
    """Copies the two files that describe a damaged checkpoint, so that the worker can warn about the damage."""
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for name in (checkpoints.MANIFEST, checkpoints.SEAL):
        _copy(str(place / name), str(target / name))


def _why(source: Path) -> str:
    """Returns why the run has no checkpoint, and how the user can get one."""
    ended = outcome(source)
    if ended is not None and ended.state == State.SUCCEEDED:
        return "a run that has succeeded keeps no checkpoint"
    reason = "it began no step" if ended is not None and not ended.steps else "it has written none"
    every = f"run.checkpoint_every ({_every(source)} in its case)"
    return f"{reason}; one is written every {every}, and when 'conoid checkpoint' asks for one"


def _every(source: Path) -> str:
    """Returns the text of ``run.checkpoint_every`` of the case."""
    try:
        every = json.loads(whole.read(source / layout.RESOLVED_CASE))["run"]["checkpoint_every"]
    except (OSError, ValueError, KeyError, TypeError):
        return "?"
    return "never" if every is None else f"{every:g} s"


def _link(source: str, target: str) -> None:
    """Makes a link to a file that is never changed in place; copies the list of frames, which is."""
    if source.endswith(layout.FRAME_SERIES):
        _copy(source, target)
    else:
        os.link(source, target)


def _copy(source: str, target: str) -> None:
    """Makes a link to a regular file; skips a missing file, a folder or a symbolic link."""
    with suppress(FileNotFoundError, IsADirectoryError), whole.opened(source) as file, open(target, "xb") as copy:
        shutil.copyfileobj(file, copy)
