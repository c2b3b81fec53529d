"""Copies, in a run's folder, of the files that the case names: hard links to files that never change."""

import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from conoid.cases.load import CaseError, Problem
from conoid.cases.output import layout
from conoid.cases.reading.files import copy_of
from conoid.cases.reading.problems import shown

from .. import durable
from ..errors import ServiceError
from ..runs.folder import APART
from .reading import FileName
from .uploads import Uploads, give

_LACKING = "you have uploaded no such file, or it has been removed; upload it first (PUT /v1/files/{sha256})"
_NAMING = re.compile(rb"""path["']?[ \t]*[=:]|\\[uUx]""")
Source = Callable[[FileName, Path], None]
"""Function that writes a file that a case names to a path. Raises FileNotFoundError if the file does not exist; raises
OSError."""


def of_owner(sent: Uploads, owner: str) -> Source:
    """Returns the source of files for a run that a user submits: the files that the user has uploaded."""
    return lambda file, target: sent.give(owner, file.sha256, target)


def of_run(folder: Path) -> Source:
    """Returns the source of files for a run that continues another run: the files of that run. The source raises
    ServiceError with status 409 if that run has lost a file.
    """

    def put(file: FileName, target: Path) -> None:
        copy = folder / layout.FILES / copy_of(file.path, file.sha256)
        try:
            if copy.is_symlink() or (copy.exists() and not copy.is_file()):
                raise FileNotFoundError
            give(copy, target)
        except FileNotFoundError:
            detail = f"run {folder.name}: its copy of {shown(file.path)} is gone"
            raise ServiceError(409, "no_file", detail) from None

    return put


def fill(files: Sequence[FileName], source: Source, folder: Path) -> None:
    """Adds a copy of each file to a folder, and flushes the copies to disk. Raises CaseError if files are missing;
    raises OSError.
    """
    place = folder / layout.FILES
    if files:
        place.mkdir(0o700)
    lacking = []
    for file in files:
        target = place / copy_of(file.path, file.sha256)
        try:
            if not target.exists():
                source(file, target)
        except FileNotFoundError:
            lacking.append(Problem(f"{file.key}.sha256", shown(file.sha256), _LACKING))
    if lacking:
        raise CaseError(lacking)
    if files:
        durable.sync_folder(place)


@contextmanager
def apart(runs: Path, files: Sequence[FileName], source: Source) -> Iterator[Path]:
    """Creates a temporary folder with copies of the files, arranged as in the folder of a run. If the server is killed,
    the next server removes this folder. Raises the errors of the function ``fill``.
    """
    place = runs / f"{APART}{secrets.token_hex(8)}"
    place.mkdir(0o700)
    try:
        (place / layout.SUBMISSION).touch()
        fill(files, source, place)
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)


def names_files(body: bytes) -> bool:
    """Whether the text of a case may name files: it contains a key ``path``, or escaped characters."""
    return _NAMING.search(body) is not None
