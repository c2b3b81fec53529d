"""The checkpoints in the folder of a run, and the check that a checkpoint is complete (docs/reference/checkpoints.md).

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
"""Version of the checkpoint files. Version 17 added the compression of brittle parts and the heat of deleted tets. A
checkpoint with another version cannot be read."""
MANIFEST, SEAL = "manifest.json", "manifest.sha256"
_FILE = re.compile(r"rank-[0-9]+\.h5")
_PIECE = 1 << 24
"""Number of bytes that are hashed at once."""


class DamagedError(ValueError):
    """Error: a checkpoint is damaged or incomplete. The text gives the reason in one line."""


class File(msgspec.Struct, frozen=True):
    """A file of a checkpoint."""

    name: str
    bytes: int
    sha256: str


class Manifest(msgspec.Struct, frozen=True):
    """The content of the file manifest.json of a checkpoint; ``t``: simulated time, s."""

    format: int
    step: int
    t: float
    case: dict[str, Any]
    files: list[File]
    known: dict[str, Any]
    """State that all ranks have in common; an array is written as ``{"dtype", "values"}``."""


def found(folder: Path) -> list[Path]:
    """Returns the folders of the checkpoints of the run in ``folder``, the latest first. The checkpoints are not
    read.
    """
    try:
        places = [p for p in (folder / layout.CHECKPOINTS).iterdir() if _numbered(p.name) and p.is_dir()]
    except (FileNotFoundError, NotADirectoryError):
        return []
    return sorted(places, key=lambda place: int(place.name), reverse=True)


def _numbered(name: str) -> bool:
    return name.isascii() and name.isdecimal()


def sealed(manifest: Manifest) -> tuple[bytes, bytes]:
    """Returns the contents of manifest.json and manifest.sha256."""
    text = json.dumps(msgspec.to_builtins(manifest)).encode()
    return text, f"{hashlib.sha256(text).hexdigest()}\n".encode()


def manifest_of(place: Path) -> Manifest:
    """Returns the manifest of the checkpoint in the folder ``place``, after checking that its files exist with the
    right size. Raises DamagedError if the checkpoint is damaged or incomplete.
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
    """Checks the SHA-256 hash of each file of a checkpoint. Raises DamagedError if a file is damaged."""
    for file in made.files:
        try:
            digest = sha256(place / file.name)
        except OSError as error:
            raise DamagedError(f"{file.name}: {error.strerror}") from None
        if digest != file.sha256:
            raise DamagedError(f"{file.name} differs from its sha256")


def sha256(path: Path) -> str:
    """Returns the SHA-256 hash of a regular file. Raises OSError if the file cannot be read."""
    h = hashlib.sha256()
    with whole.opened(path) as file:
        while piece := file.read(_PIECE):
            h.update(piece)
    return h.hexdigest()
