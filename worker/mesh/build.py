"""Entry point of meshing. A mesh is made once; later calls read its tets from a cache that is indexed by the hash of
its content.
"""

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from conoid.cases.model.bodies import Mesh, MeshFile
from conoid.cases.reading import whole
from conoid.cases.reading.files import files_of
from conoid.cases.shapes import geometry, profile, ring

from ..errors import MeshError
from ..materials import turning
from ..model import hashing
from .child import Limits, beside, run_child
from .model import TetMesh, check
from .order import morton_ordered
from .sources import Sources, digests, sources
from .store import load, save
from .structured import structured

_CACHE_BYTES = 4 * 2**30
"""Largest size of the cache, bytes. If the cache is larger, the least recently used meshes are removed."""


def build(
    mesh: Mesh, folder: Path, key: str = "mesh", limits: Limits | None = None, made: Callable[[], None] = lambda: None
) -> TetMesh:
    """Return the checked tets of ``mesh``, in Morton order, bit-identical in every call. Raises MeshError.

    ``folder``: folder to which the path of a mesh file is relative; ``key``: key of the mesh in its case, for messages;
    ``made``: function that is called before a mesh is made; ``limits``: limits of the child process that runs gmsh and
    reads files.
    """
    source = sources(mesh, folder, key)
    if not isinstance(mesh, MeshFile) and mesh.generator == "gmsh":
        _need_gmsh(key)
    name = _content(mesh, source, key) + ".npz"
    cached = cache_folder()
    found = load(cached / name)
    if found is None or _changed(found):
        made()
        return _make_and_keep(mesh, source, cached / name, key, limits or Limits())
    with contextlib.suppress(OSError):
        os.utime(cached / name)
    return found


def build_together(
    meshes: Mapping[str, Mesh], folder: Path, limits: Limits | None = None, made: Callable[[], None] = lambda: None
) -> list[TetMesh]:
    """Return the tets of ``meshes``, with common nodes at their interfaces (mesh/together.py), as a dictionary with the
    keys of ``meshes``. Raises MeshError.
    """
    key = next(iter(meshes))
    _need_gmsh(key)
    found_files = {named: sources(mesh, folder, named) for named, mesh in meshes.items()}
    asked = [_content(mesh, found_files[named], named) for named, mesh in meshes.items()]
    target = cache_folder() / f"{hashlib.sha256(' '.join(asked).encode()).hexdigest()}.npz"
    found = _loaded(target, len(meshes))
    if found is None:
        made()
        every = {named: path for files in found_files.values() for named, path in files.items()}
        with _writable(target) as place:
            run_child(meshes, every, place, key, limits or Limits())
            found = _loaded(place, len(meshes))
    if found is None:
        raise MeshError(f"{key}: the mesh process left no meshes in {target.parent}")
    return found


def _loaded(target: Path, count: int) -> list[TetMesh] | None:
    found = [load(beside(target, k)) for k in range(count)]
    some = [mesh for mesh in found if mesh is not None]
    return some if len(some) == count else None


@contextlib.contextmanager
def _writable(target: Path) -> Iterator[Path]:
    """Yield ``target`` if the file can be written, else a path of the same name in a temporary folder. A run without a
    writable cache continues, but the next run makes the mesh again.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=target.parent).close()
    except OSError:
        with tempfile.TemporaryDirectory(prefix="conoid-mesh-") as apart:
            yield Path(apart) / target.name
        return
    yield target
    with contextlib.suppress(OSError):
        _trim(target.parent)


def _changed(mesh: TetMesh) -> bool:
    """Return True if a file that the mesh file includes has changed or was removed."""
    for path, digest in mesh.origin.included if mesh.origin is not None else ():
        try:
            with whole.opened(path) as file:
                if hashlib.file_digest(file, "sha256").hexdigest() != digest:
                    return True
        except OSError:
            return True
    return False


def cache_folder() -> Path:
    """Return the folder of cached meshes, which is below ``CONOID_CACHE_DIR`` if that variable is set, else
    ``~/.cache/conoid``.
    """
    root = os.environ.get("CONOID_CACHE_DIR")
    return (Path(root) if root else Path.home() / ".cache" / "conoid") / "meshes"


def _make_and_keep(mesh: Mesh, source: Sources, target: Path, key: str, limits: Limits) -> TetMesh:
    with _writable(target) as place:
        return _make(mesh, source, place, key, limits)


def _make(mesh: Mesh, source: Sources, target: Path, key: str, limits: Limits) -> TetMesh:
    if not isinstance(mesh, MeshFile) and mesh.generator == "structured":
        made = morton_ordered(check(structured(mesh, key)))
        save(made, target)
        return made
    run_child(mesh, source, target, key, limits)
    found = load(target)
    if found is None:
        raise MeshError(f"{key}: the mesh process left no mesh in {target}")
    return found


def _need_gmsh(key: str) -> None:
    if importlib.util.find_spec("gmsh") is None:
        cure = "pip install 'conoid[mesh]', or use generator = 'structured'"
        raise MeshError(f"{key}: gmsh is not installed here; {cure}")


def _content(mesh: Mesh, found: Sources, key: str) -> str:
    """Return the sha256 of everything that determines the mesh: the request, the bytes of the files, the source of this
    package, and the versions of the libraries.
    """
    asked = mesh.model_dump(mode="json")
    for file in files_of({"parts": [{"mesh": asked}]}):
        _forget(asked, file.table[3:])
    lines = [_maker(), json.dumps(asked), *digests(mesh, found, key)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _forget(asked: Any, place: tuple[int | str, ...]) -> None:
    """Remove the path and the expected hash of a file from a request, because only the bytes of the file determine the
    mesh.
    """
    for step in place:
        asked = asked[step]
    asked.update(path="", sha256=None)


@cache
def _maker() -> str:
    """Return the sources of this package, the sources of the modules that it imports, and the versions of the libraries
    that it calls.
    """
    text, here = hashlib.sha256(), Path(__file__).parent
    used = [Path(str(module.__file__)) for module in (geometry, profile, ring, hashing, turning)]
    for path in [*sorted(here.rglob("*.py")), *used]:
        text.update(path.name.encode() + path.read_bytes())
    return " ".join([text.hexdigest(), *_versions("gmsh", "numpy")])


def _versions(*packages: str) -> Iterator[str]:
    for package in packages:
        try:
            yield f"{package} {importlib.metadata.version(package)}"
        except importlib.metadata.PackageNotFoundError:
            yield f"{package} unknown"


def _trim(folder: Path) -> None:
    """Remove the least recently used meshes until the size of the cache is allowed."""
    kept = sorted((file.stat().st_mtime, file.stat().st_size, file) for file in folder.glob("*.npz"))
    total = sum(size for _, size, _ in kept)
    for _, size, file in kept[:-1]:
        if total <= _CACHE_BYTES:
            break
        file.unlink(missing_ok=True)
        total -= size
