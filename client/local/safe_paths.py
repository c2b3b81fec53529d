"""Checks of file names that come from a server or a user, and encoding of parts of addresses."""

import os
from pathlib import Path, PurePosixPath, PureWindowsPath
from urllib.parse import quote

from conoid.cases.reading.problems import shown

from ..errors import ClientError

_LONGEST_NAME = 255
"""Largest length of the name of a file, bytes: NAME_MAX of Linux."""


def quoted(text: str, safe: str = "") -> str:
    """Returns ``text`` with percent-encoding, as a part of an address."""
    return quote(text, safe=safe)


def inside(root: Path, name: str) -> Path:
    """Returns the path of ``name`` below ``root``; ``name`` comes from a server or a user. Raises ClientError for an
    impossible name. Also raises ClientError for a name that leads out of ``root`` on any operating system or through
    a link.
    """
    path, other = PurePosixPath(name), PureWindowsPath(name)
    if path.is_absolute() or other.anchor or ".." in (*path.parts, *other.parts) or not path.parts:
        raise ClientError(f"{shown(name)} lies outside the run's folder")
    if "\0" in name or not _writable(name):
        raise ClientError(f"{shown(name)}: no file can have this name")
    target = root.joinpath(*path.parts)
    if not target.parent.resolve().is_relative_to(root.resolve()):
        raise ClientError(f"{shown(name)}: a link in {root} leads out of this folder")
    return target


def _writable(name: str) -> bool:
    """Returns True if a file system accepts each part of the name."""
    try:
        return all(len(os.fsencode(part)) <= _LONGEST_NAME for part in name.split("/"))
    except UnicodeEncodeError:
        return False
