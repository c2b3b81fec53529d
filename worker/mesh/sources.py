"""Files of a mesh: their paths and their hashes."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

from conoid.cases.checks.measured_checks import File, files_in
from conoid.cases.model.bodies import Mesh
from conoid.cases.model.operands import Place
from conoid.cases.reading import whole
from conoid.cases.reading.files import located
from conoid.cases.reading.problems import dotted

from ..errors import MeshError

Sources = Mapping[str, Path]
"""Dictionary of absolute paths of files. A key is the table in the case that names the file, such as
``parts[0].mesh.of[1]``."""


def sources(mesh: Mesh, folder: Path, key: str) -> dict[str, Path]:
    """Return the files of the mesh at ``key``. ``folder`` is the folder of the case. Raises MeshError if a file is
    missing.
    """
    return {named: _there(file, folder, named) for named, file in _named(mesh, key)}


def digests(mesh: Mesh, found: Sources, key: str) -> list[str]:
    """Return the suffix and the sha256 of each file. Raises MeshError if the sha256 differs from the value in the
    case.
    """
    return [f"{found[named].suffix.lower()} {_digest(found[named], file, named)}" for named, file in _named(mesh, key)]


def _named(mesh: Mesh, key: str) -> list[tuple[str, File]]:
    return [(below(key, place), file) for place, file in files_in(mesh)]


def below(key: str, place: Place) -> str:
    """Return the key of the table ``place`` inside of the table ``key``."""
    return f"{key}.{dotted(place)}" if place else key


def _there(file: File, folder: Path, key: str) -> Path:
    if "://" in file.path:
        raise MeshError(f"{key}.path = {file.path!r}: expected a file, not an address")
    path = located(file.path, file.sha256, folder)
    if not path.is_file():
        raise MeshError(f"{key}.path = {file.path!r}: no such file ({path.absolute()})")
    return path.absolute()


def _digest(source: Path, file: File, key: str) -> str:
    try:
        with whole.opened(source) as opened:
            found = hashlib.file_digest(opened, "sha256").hexdigest()
    except OSError as error:
        raise MeshError(f"{key}.path = {file.path!r}: {error.strerror}") from error
    if file.sha256 is not None and file.sha256 != found:
        raise MeshError(f"{key}.sha256 = {file.sha256!r}: {file.path!r} has {found}")
    return found
