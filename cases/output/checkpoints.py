"""Checkpoints in a run's folder, and the check that they are complete (docs/reference/checkpoints.md).

::

    checkpoints/000001200/ rank-0.h5 ...     state of each rank
                           manifest.json     step, time, case, state common to all ranks, bytes and sha256 of each file
                           manifest.sha256   of manifest.json
"""

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import msgspec

from ..reading import whole
from . import layout

FORMAT = 18
"""Version of the checkpoint files; 17 added the compression of brittle parts and the heat of deleted tets. Checkpoints
with another version number cannot be read."""
MANIFEST, SEAL = "manifest.json", "manifest.sha256"
_FILE = re.compile(r"rank-[0-9]+\.h5")
_PIECE = 1 << 24
"""Number of bytes that are hashed at a time."""


class DamagedError(ValueError):
    """Error: a damaged or incomplete checkpoint; the text gives the reason in one line."""


class File(msgspec.Struct, frozen=True):
    """A file of a checkpoint."""

    name: str
    bytes: int
    sha256: str


class Manifest(msgspec.Struct, frozen=True):
    """The content of a checkpoint; the simulated time ``t`` in s."""

    format: int
    step: int
    t: float
    case: dict[str, Any]
    files: list[File]
    known: dict[str, Any]
    """State that all ranks have in common; arrays as ``{"dtype", "values"}``."""


def found(folder: Path) -> list[Path]:
    """Returns the checkpoints of the run in ``folder``, the latest first, without reading the checkpoints."""
    try:
        places = [p for p in (folder / layout.CHECKPOINTS).iterdir() if _numbered(p.name) and p.is_dir()]
    except (FileNotFoundError, NotADirectoryError):
        return []
    return sorted(places, key=lambda place: int(place.name), reverse=True)


def _numbered(name: str) -> bool:
    return name.isascii() and name.isdecimal()


def sealed(manifest: Manifest) -> tuple[bytes, bytes]:
    """Returns the contents of the two files that describe a checkpoint."""
    text = json.dumps(msgspec.to_builtins(manifest)).encode()
    return text, f"{hashlib.sha256(text).hexdigest()}\n".encode()


def manifest_of(place: Path) -> Manifest:
    """Returns the manifest of a checkpoint whose files exist with the right size. Raises DamagedError if the checkpoint
    is damaged or incomplete.
    """
    try:
        text = whole.read(place / MANIFEST)
        seal = whole.read(place / SEAL, 80)
        if seal.strip() != hashlib.sha256(text).hexdigest().encode():
            raise DamagedError(f"{MANIFEST} differs from its sha256")
        made = msgspec.convert(json.loads(text), Manifest)
        _check(place, made)
    except OSError as error:
        raise DamagedError(f"{Path(str(error.filename)).name}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise error if isinstance(error, DamagedError) else DamagedError(f"{MANIFEST} is none: {error}") from None
    return made


def _check(place: Path, made: Manifest) -> None:
    if made.format != FORMAT:
        raise DamagedError(f"the checkpoint has format {made.format}; this version reads {FORMAT}")
    if not made.files or made.step != int(place.name):
        raise DamagedError(f"{MANIFEST} belongs to another checkpoint")
    for file in made.files:
        if not _FILE.fullmatch(file.name):
            raise DamagedError(f"{MANIFEST} names a file {file.name[:40]!r}")
        with whole.opened(place / file.name) as opened:
            size = opened.seek(0, 2)
        if size != file.bytes:
            raise DamagedError(f"{file.name} has {size} bytes instead of {file.bytes}")


def check_bytes(place: Path, made: Manifest) -> None:
    """Checks the sha256 of each file of a checkpoint. Raises DamagedError if a file is damaged."""
    for file in made.files:
        try:
            digest = sha256(place / file.name)
        except OSError as error:
            raise DamagedError(f"{file.name}: {error.strerror}") from None
        if digest != file.sha256:
            raise DamagedError(f"{file.name} differs from its sha256")


def sha256(path: Path) -> str:
    """Returns the sha256 of a regular file. Raises OSError if the file cannot be read."""
    h = hashlib.sha256()
    with whole.opened(path) as file:
        while piece := file.read(_PIECE):
            h.update(piece)
    return h.hexdigest()
