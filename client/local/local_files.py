"""Files on this machine that a case names: the files are found, hashed and copied."""

import copy
import hashlib
import os
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from conoid.cases.load import CaseError, Problem
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.reading.files import Named, files_of, located
from conoid.cases.reading.problems import problem

from ..errors import ClientError
from . import one_deck
from .atomic import whole as whole_file

_CHUNK = 1 << 20
State = tuple[int, int, int, int]
"""State of a file: device, inode, size in bytes, and time of the last change in ns."""


@dataclass(frozen=True)
class LocalFile:
    """A file that a case names, with the state of the file when its hash was computed."""

    named: Named
    path: Path
    sha256: str
    state: State
    named_in: str = ""
    """Hash of a deck with includes, without the included files. The field ``named_in`` is set for a deck with includes,
    which is written as one file to ``path``."""

    @property
    def size(self) -> int:
        """Size of the file in bytes."""
        return self.state[2]

    def check(self, file: int) -> None:
        """Raises ClientError if the open file is not the file whose hash was computed."""
        if state_of(file) != self.state:
            raise self.changed()

    def changed(self) -> ClientError:
        """Returns the error for a file that has changed since its hash was computed."""
        return ClientError(f"{self.path}: the file changed while it was read; nothing was submitted: try again")


class Hashes:
    """Store of the hashes of files. A hash is computed once for each state of a file."""

    def __init__(self) -> None:
        """Makes an empty store of hashes."""
        self._known: dict[State, str] = {}
        self._decks: dict[tuple[Path, State], _Deck] = {}
        self._place: Path | None = None
        """Temporary folder for decks that are written as one file."""

    def of(self, case: Mapping[str, Any], folder: Path) -> list[LocalFile]:
        """Returns the files that a case (plain data) names; paths are relative to ``folder``. A missing file whose
        hash is in the case is left out, because the server may have the file. Raises CaseError with every unusable
        file.
        """
        found, problems = [], list[Problem]()
        for named in files_of(case):
            path = located(named.path, named.sha256, folder)
            try:
                found.append(self._hashed(named, path))
            except FileNotFoundError:
                if named.sha256 is None:
                    problems.append(_wrong(named, "path", named.path, f"no such file ({path.absolute()})"))
            except (OSError, ValueError) as error:  # The name contains a null byte.
                reason = error.strerror if isinstance(error, OSError) else str(error)
                problems.append(_wrong(named, "path", named.path, f"{reason} ({path.absolute()})"))
            else:
                if named.sha256 not in {None, found[-1].sha256, found[-1].named_in or None}:
                    found_hash = f"{named.path!r} has {found[-1].sha256}"
                    problems.append(_wrong(named, "sha256", named.sha256, found_hash))
        if problems:
            raise CaseError(problems)
        return found

    def _hashed(self, named: Named, path: Path) -> LocalFile:
        """Opens and hashes a file. Raises OSError; IsADirectoryError if the path or a link does not lead to a
        regular file; ValueError for a deck with unusable includes.
        """
        itself = self._read(named, path)
        if not one_deck.includes(path):
            return itself
        deck = self._decks.get((path, itself.state))
        if deck is None or any(state_at(each) != state for each, state in deck.files.items()):
            deck = self._decks[path, itself.state] = self._written(path)
        return replace(self._read(named, deck.path), named_in=itself.sha256)

    def _written(self, path: Path) -> "_Deck":
        """Writes a deck with all its includes as one file."""
        if self._place is None:
            self._place = Path(tempfile.mkdtemp(prefix="conoid-decks-"))
            weakref.finalize(self, shutil.rmtree, self._place, True)
        target = self._place / str(len(self._decks)) / path.name
        target.parent.mkdir(exist_ok=True)
        return _Deck(target, {each: state_at(each) for each in one_deck.write(path, target)})

    def _read(self, named: Named, path: Path) -> LocalFile:
        with whole.opened(path) as file:
            state = state_of(file.fileno())
            if state not in self._known:
                self._known[state] = hashlib.file_digest(file, "sha256").hexdigest()
            made = LocalFile(named, path, self._known[state], state)
            made.check(file.fileno())
        return made


@dataclass(frozen=True)
class _Deck:
    """A deck that was written as one file, and the states of its source files."""

    path: Path
    files: dict[Path, State]


def state_at(path: Path) -> State:
    """Returns the state of the file at a path. Raises OSError."""
    with whole.opened(path) as file:
        return state_of(file.fileno())


def _wrong(named: Named, key: str, value: object, reason: str) -> Problem:
    return problem((*named.table, key), value, reason)


def state_of(file: int) -> State:
    """Returns the state of an open file by its descriptor."""
    status = os.fstat(file)
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns


def with_hashes(case: Mapping[str, Any], files: Iterable[LocalFile]) -> dict[str, Any]:
    """Returns the case with the hash of each file in the table that names the file."""
    made: dict[str, Any] = copy.deepcopy(dict(case))
    for file in files:
        table: Any = made
        for item in file.named.table:
            table = table[item]
        table["sha256"] = file.sha256
    return made


def keep_copies(files: Iterable[LocalFile], folder: Path) -> None:
    """Copies files into the folder of a run; the copies are named by their hashes. Raises ClientError for a file
    that has changed since its hash was computed, OSError.
    """
    for file in files:
        target = folder / layout.FILES / Named(file.named.table, file.named.path, file.sha256).copy
        target.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(target) as part:
            with whole.opened(file.path) as source, part.open("wb") as made:
                shutil.copyfileobj(source, made, _CHUNK)
            with part.open("rb") as made:
                if hashlib.file_digest(made, "sha256").hexdigest() != file.sha256:
                    raise file.changed()
