"""Checked names of files and parts of addresses from a server or a user."""

import os
from pathlib import Path, PurePosixPath, PureWindowsPath
from urllib.parse import quote

from conoid.cases.reading.problems import shown

from ..errors import ClientError

_LONGEST_NAME = 255
"""Largest length of the name of a file, bytes: NAME_MAX of Linux."""


def quoted(text: str, safe: str = "") -> str:
    """Returns ``text`` encoded as a part of an address."""
    return quote(text, safe=safe)


def inside(root: Path, name: str) -> Path:
    """Returns the path of ``name`` below ``root``; the name is from a server or a user. Raises ClientError for an
    impossible name, and for a name that leaves ``root`` on any system, also through a link inside ``root``.
    """
    path, other = PurePosixPath(name), PureWindowsPath(name)
    if path.is_absolute() or other.anchor or ".." in (*path.parts, *other.parts) or not path.parts:
        raise ClientError(f"{shown(name)} lies outside the run's folder")
    if "\0" in name or not _writable(name):
        raise ClientError(f"{shown(name)}: no file can have this name")
    target = root.joinpath(*path.parts)
    if not target.parent.resolve().is_relative_to(root.resolve()):
        raise ClientError(f"{shown(name)}: a link in {root} leads out of it")
    return target


def _writable(name: str) -> bool:
    """Returns True if each part of the name fits a file system."""
    try:
        return all(len(os.fsencode(part)) <= _LONGEST_NAME for part in name.split("/"))
    except UnicodeEncodeError:
        return False
