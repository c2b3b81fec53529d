"""A mesh as an .npz file: written beside its place and renamed, so that a reader never meets half of one."""

import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .model import Origin, TetMesh


def save(mesh: TetMesh, path: Path) -> None:
    """Writes ``path``. Raises OSError when that is not possible."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".writing-", suffix=".npz")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, points=mesh.points, tets=mesh.tets, **_of_file(mesh.origin))
            file.flush()
            os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def load(path: Path) -> TetMesh | None:
    """The mesh in ``path``; None when there is none, or when the file is damaged (every array has a checksum)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return TetMesh(arrays["points"], arrays["tets"], _origin(arrays))
    except (OSError, ValueError, KeyError, EOFError, MemoryError, zipfile.BadZipFile):
        return None


def _of_file(origin: Origin | None) -> dict[str, Any]:
    if origin is None:
        return {}
    return {"sha256": np.array(origin.file), "nodes": origin.nodes, "notes": np.array(origin.notes, np.str_)}


def _origin(arrays: Mapping[str, NDArray[Any]]) -> Origin | None:
    if "sha256" not in arrays:
        return None
    return Origin(str(arrays["sha256"]), arrays["nodes"], tuple(map(str, arrays["notes"])))
