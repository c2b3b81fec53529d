"""Storage of a mesh as an .npz file. The file is written under a temporary name and then renamed, so a reader never
finds an incomplete file.
"""

import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .model import Ints, NodeSet, Origin, TetMesh


def save(mesh: TetMesh, path: Path) -> None:
    """Write the mesh to ``path``. Raises OSError."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".writing-", suffix=".npz")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, points=mesh.points, tets=mesh.tets, **_of_file(mesh.origin), **_of_sets(mesh.sets))
            file.flush()
            os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def load(path: Path) -> TetMesh | None:
    """Return the mesh in ``path``; None if the file is missing or damaged. Damage is detected by the checksum of each
    array in the file.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return TetMesh(arrays["points"], arrays["tets"], _origin(arrays), _sets(arrays))
    except (OSError, ValueError, KeyError, EOFError, MemoryError, zipfile.BadZipFile):
        return None


def _of_file(origin: Origin | None) -> dict[str, Any]:
    if origin is None:
        return {}
    arrays = {"sha256": np.array(origin.file), "nodes": origin.nodes, "notes": np.array(origin.notes, np.str_)}
    return arrays | {"included": np.array(origin.included, np.str_).reshape(-1, 2)}


def _origin(arrays: Mapping[str, NDArray[Any]]) -> Origin | None:
    if "sha256" not in arrays:
        return None
    included = tuple((str(path), str(digest)) for path, digest in arrays["included"])
    return Origin(str(arrays["sha256"]), arrays["nodes"], tuple(map(str, arrays["notes"])), included)


def _of_sets(sets: tuple[NodeSet, ...]) -> dict[str, Any]:
    """Return all sets as a few arrays. For a set of nodes the number of faces is -1."""
    if not sets:
        return {}
    faces = [_no_faces() if each.faces is None else each.faces for each in sets]
    counts = [
        (len(each.names), len(each.nodes), -1 if each.faces is None else len(each.faces), each.inner) for each in sets
    ]
    return {
        "set_names": np.array([name for each in sets for name in each.names], np.str_),
        "set_counts": np.array(counts, np.int64),
        "set_nodes": np.concatenate([each.nodes for each in sets]),
        "set_faces": np.concatenate(faces),
    }


def _sets(arrays: Mapping[str, NDArray[Any]]) -> tuple[NodeSet, ...]:
    if "set_counts" not in arrays:
        return ()
    names, nodes, faces = (arrays[f"set_{what}"] for what in ("names", "nodes", "faces"))
    found, first = list[NodeSet](), np.zeros(3, np.int64)
    for *counts, inner in arrays["set_counts"].tolist():
        last = first + np.maximum(counts, 0)
        (a, b, c), (d, e, f) = first, last
        some = faces[c:f].reshape(-1, 3) if counts[2] >= 0 else None
        found.append(NodeSet(tuple(map(str, names[a:d])), nodes[b:e], some, inner))
        first = last
    return tuple(found)


def _no_faces() -> Ints:
    return np.zeros((0, 3), np.int32)
