"""A new run that goes on where another one has left a checkpoint: what it takes over of that run's folder."""

import json
import os
import shutil
from pathlib import Path

from conoid.cases import fragments, layout
from conoid.cases.load import apply_overrides, read_data
from conoid.cases.run import State

from .errors import ServiceError
from .folder import outcome

_TRIES = 5
"""Times that the newest checkpoint is looked for. Chosen."""
LABEL = "restart"
"""Of the new run: the id of the other one."""


def latest(folder: Path) -> Path | None:
    """The newest checkpoint of a run."""
    found = (path for path in (folder / layout.CHECKPOINTS).glob("*") if path.name.isdigit())
    return max(found, key=lambda path: int(path.name), default=None)


def body(case: Path, ranks: int | None) -> dict[str, object]:
    """The case of a run, on so many ranks. Raises CaseError."""
    return apply_overrides(read_data(case), {} if ranks is None else {"run.ranks": ranks})


def fill(source: Path, folder: Path) -> None:
    """Gives the new run the newest checkpoint of ``source``, its frames and its history, which the worker cuts at the
    checkpoint. Raises ServiceError 409, 503, OSError.
    """
    if not any(_taken(source, folder / layout.CHECKPOINTS) for _ in range(_TRIES)):
        detail = f"the checkpoints of run {source.name} are replaced faster than they can be taken over"
        raise ServiceError(503, "unavailable", detail, retryable=True)
    for name, copy in ((layout.FRAMES, _link), (fragments.FOLDER, shutil.copy2)):
        if (source / name).is_dir():
            shutil.copytree(source / name, folder / name, copy_function=copy)
    if (source / layout.HISTORY).exists():
        shutil.copy2(source / layout.HISTORY, folder / layout.HISTORY)


def _taken(source: Path, target: Path) -> bool:
    """False when the checkpoint was removed meanwhile: a run that goes on keeps its newest ones."""
    checkpoint = latest(source)
    if checkpoint is None:
        raise ServiceError(409, "no_checkpoint", f"run {source.name} has no checkpoint: {_why(source)}")
    try:
        shutil.copytree(checkpoint, target / checkpoint.name, copy_function=_link)
    except OSError:  # shutil.Error is one
        if checkpoint.is_dir():
            raise
        shutil.rmtree(target / checkpoint.name, ignore_errors=True)
        return False
    return True


def _why(source: Path) -> str:
    """Why a run has none, and how one gets some."""
    ended = outcome(source)
    if ended is not None and ended.state == State.SUCCEEDED:
        return "one that has succeeded keeps none"
    said = "it began no step" if ended is not None and not ended.steps else "it has written none"
    every = f"run.checkpoint_every ({_every(source)} in its case)"
    return f"{said}; one is written every {every}, and when 'conoid checkpoint' asks for one"


def _every(source: Path) -> str:
    """As the case has it."""
    try:
        every = json.loads((source / layout.RESOLVED_CASE).read_bytes())["run"]["checkpoint_every"]
    except (OSError, ValueError, KeyError, TypeError):
        return "?"
    return "never" if every is None else f"{every:g} s"


def _link(source: str, target: str) -> None:
    """A second name of the same file, which is only ever replaced as a whole; a copy of the list of frames."""
    if source.endswith(layout.FRAME_SERIES):
        shutil.copy2(source, target)
    else:
        os.link(source, target)
