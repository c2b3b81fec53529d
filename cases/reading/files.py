"""The files that a case names: their paths, their hashes, and the places where a run finds them.

Every table below ``parts[].mesh`` that has a ``path`` names a file; the key ``sha256`` of the table is the hash of its
content. The path is valid on the machine of the user who wrote the case. A run of a server, or of ``conoid batch``, has
copies of the files in its folder, which are named by their hashes; such a run does not use the path.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from ..output import layout

HASH = re.compile(r"[0-9a-f]{64}")
"""Pattern of a SHA-256 hash in file names and addresses."""
_ENDING = re.compile(r"\.[a-z0-9]{1,8}")
"""Pattern of the ending of a file name, which determines the format of the file."""


@dataclass(frozen=True)
class Named:
    """A file that a case names. ``location``: the place of the table that names it, such as ``("parts", 0,
    "mesh")``.
    """

    table: tuple[int | str, ...]
    path: str
    sha256: str | None

    @property
    def copy(self) -> str:
        """Name of the copy of the file in the folder of a run; empty if the case has no hash of the file."""
        return copy_of(self.path, self.sha256)


def files_of(case: Mapping[str, Any]) -> list[Named]:
    """Returns the files that a case names, in the order of the case. ``case``: plain data as TOML gives it."""
    parts = case.get("parts")
    meshes = ((n, part.get("mesh")) for n, part in enumerate(_listed(parts)) if isinstance(part, Mapping))
    return [file for n, mesh in meshes for file in _below(mesh, ("parts", n, "mesh"))]


def _below(value: Any, place: tuple[int | str, ...]) -> Iterator[Named]:
    if isinstance(value, Mapping):
        if isinstance(path := value.get("path"), str):
            sha256 = value.get("sha256")
            yield Named(place, path, sha256.strip().lower() if isinstance(sha256, str) else None)
        for key, inner in value.items():
            yield from _below(inner, (*place, str(key)))
    for n, inner in enumerate(_listed(value)):
        yield from _below(inner, (*place, n))


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list | tuple) else []


def copy_of(path: str, sha256: str | None) -> str:
    """Returns the name of the copy of a file: the hash of the file and the ending of its name. The name is empty for a
    file without a hash.
    """
    if sha256 is None or not HASH.fullmatch(sha256.lower()):
        return ""
    ending = PurePath(path).suffix.lower()
    return sha256.lower() + (ending if _ENDING.fullmatch(ending) else "")


def located(path: str, sha256: str | None, folder: Path) -> Path:
    """Returns the path of a file for a run whose case is in ``folder``.

    If ``folder`` is the folder of a run of a server, the result is the copy in this folder; so no case can read other
    files of the server. Otherwise the result is the copy if it exists, else ``path``, relative to the folder of the
    case.
    """
    copy = folder / layout.FILES / (copy_of(path, sha256) or "none")
    return copy if (folder / layout.SUBMISSION).exists() or copy.exists() else folder / path
