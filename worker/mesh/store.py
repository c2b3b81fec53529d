"""A mesh as an .npz file: written beside its place and renamed, so that a reader never meets half of one."""

import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from .model import TetMesh


def save(mesh: TetMesh, path: Path) -> None:
    """Writes ``path``. Raises OSError when that is not possible."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".writing-", suffix=".npz")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, points=mesh.points, tets=mesh.tets)
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
            return TetMesh(arrays["points"], arrays["tets"])
    except (OSError, ValueError, KeyError, EOFError, MemoryError, zipfile.BadZipFile):
        return None
