"""A run in a folder of this machine: its status, and requests to its worker."""

import re
import shutil
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State
from conoid.cases.site import slurm

from ..errors import ClientError, UnfinishedError
from ..live import Live
from ..remote.run_info import FileInfo, RunInfo
from ..result import Result
from .atomic import whole as whole_file
from .folders import LocalFolder
from .safe_paths import inside

_ID = re.compile(r"[0-9a-z]{22}")
"""Pattern of the id of a run on a server. ``conoid get`` copies a run into a folder with the id as name."""
_AT_WORK = {State.STARTING, State.RUNNING, State.STOPPING}
"""States of a run in which a worker writes into the folder."""


def status(folder: Path) -> RunInfo:
    """Returns the status of the run in a folder. Raises UnfinishedError if the folder is not that of a run."""
    result = Result.open(folder)
    messages = result.messages
    known = Live(result.folder.name)
    for message in messages:
        known.take(message)
    try:
        ended = result.outcome
        known.state, known.cause, known.message = State(ended.state), ended.cause, ended.message
        text = result.folder.path(layout.OUTCOME).read_bytes()
    except UnfinishedError:
        text = b"null"
        if known.state in _AT_WORK and not slurm.held(folder):
            known.state, known.cause = State.LOST, Cause.NODE
            known.message = "no worker writes into the folder of the run, and no worker has written an outcome"
    case = result.case if (folder / layout.RESOLVED_CASE).is_file() else {}
    first, last = (messages[0].wall, messages[-1].wall) if messages else (0.0, 0.0)
    return RunInfo(
        id=result.folder.name, owner="", name=str(case.get("name") or ""), title=str(case.get("title") or ""),
        state=known.state, cause=known.cause, message=known.message, submitted=first,
        ranks=_cores(case, known, "ranks"), threads=_cores(case, known, "threads"),
        started=known.began, finished=last if known.state.final else None,
        progress=None if known.state.final else known.progress, outcome_json=msgspec.Raw(text),
    )  # fmt: skip


def _cores(case: dict[str, Any], known: Live, what: str) -> int:
    """Returns ``ranks`` or ``threads`` of the worker; before the worker starts, those of the case."""
    if known.started is not None:
        return int(getattr(known.started, what))
    asked = case.get("run", {}).get(what, 1) if isinstance(case.get("run"), dict) else 1
    return asked if isinstance(asked, int) else 1


def ask(folder: Path, request: str, wish: str) -> str:
    """Writes a request file that the worker reads; returns one text line about the request. Raises OSError, and
    UnfinishedError if no worker runs.
    """
    LocalFolder(folder).path(layout.JOURNAL)
    if not slurm.held(folder):
        raise UnfinishedError(
            f"{folder}: no worker writes into this folder; only a run with a worker can get a request"
        )
    whole.touch(folder / request)
    return f"{folder} {wish} requested"


def at_hand(folder: Path) -> bool:
    """Returns True if a worker runs in this folder. A copy of a run of a server, made by ``conoid get``, has no
    worker.
    """
    copied = _ID.fullmatch(str(folder)) is not None
    return not copied or (folder / layout.JOB).exists() or slurm.held(folder)


class FolderFiles:
    """The files of a run in a folder, with the same interface as a run on a server."""

    def __init__(self, folder: Path) -> None:
        """Stores the folder; reads nothing yet."""
        self._folder = LocalFolder(folder)
        self.id = self._folder.name

    def files(self) -> list[FileInfo]:
        """Lists the files of the folder."""
        return [FileInfo(path=name, size=(self._folder.root / name).stat().st_size) for name in self._folder.names()]

    def over(self) -> bool:
        """Always False, because copies from a folder are complete in any state of the run."""
        return False

    def fetch(self, folder: Path, file: FileInfo, final: bool) -> Path:
        """Copies a file of the run and returns the path of the copy. Raises UnfinishedError, ClientError, OSError."""
        name = file.path
        inside(self._folder.root, name)
        source, target = self._folder.path(name), inside(folder, name)
        if target.exists() and source.samefile(target):
            raise ClientError(f"{target}: source and target are the same file; choose another folder with --out")
        target.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(target) as part:
            shutil.copyfile(source, part)
        return target
