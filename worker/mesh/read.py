"""Reads mesh files. Runs in the child process: a file is somebody else's bytes.

gmsh reads ``.msh`` (4.1 and 2.2, text and binary): nobody knows that format better. But gmsh takes a file without a
known header for a script in its own language, which can start programs, so the header is checked here first and the
file is handed over under a private name. ``.inp`` has its own reader, ``abaqus``.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from conoid.cases.bodies import MeshFile

from ..errors import MeshError
from .abaqus.reading import read_inp
from .faces import same_side
from .gmsh_session import NamedMesh, first_error, session, tet_mesh
from .model import Origin, TetMesh, check
from .scale import scaled

_VERSIONS = ("4.1", "2.2")


def read(file: MeshFile, path: Path, key: str = "mesh") -> TetMesh:
    """The tets of ``path``, of ``file.group`` when given, in m, checked. MeshError, naming ``key``, when it cannot be.

    Nodes that no tet uses and everything that is not a volume are left out; other volumes than tets are refused.
    """
    readers: dict[str, Callable[[Path, str | None, str], NamedMesh]] = {".msh": _read_msh, ".inp": read_inp}
    if path.suffix.lower() not in readers:
        raise MeshError(f"{key}.path = {file.path!r}: expected a file name that ends in {' or '.join(readers)}")
    try:
        found = readers[path.suffix.lower()](path, file.group, key)
        if file.group is not None and not len(found.mesh.tets):
            raise MeshError(f"{key}.group = {file.group!r}: no tet is in it")
        with path.open("rb") as content:
            origin = Origin(hashlib.file_digest(content, "sha256").hexdigest(), found.places, found.notes)
        mesh = check(TetMesh(scaled(found.mesh.points, file.unit), found.mesh.tets, origin), found.names)
        if len(twins := same_side(mesh.tets)):
            one, other = found.names.tets[twins[0]]
            raise MeshError(
                f"tets {one} and {other} lie on the same side of a face that both have; is a tet there twice?"
            )
        return mesh
    except MeshError as error:
        text = str(error)
        raise MeshError(text if text.startswith(key) else f"{key}.path = {file.path!r}: {text}") from error


def _read_msh(path: Path, group: str | None, key: str) -> NamedMesh:
    version = _checked_header(path)
    with tempfile.TemporaryDirectory() as folder, session({"General.NumThreads": 1}) as gmsh:
        private = os.path.join(folder, "mesh.msh")
        os.symlink(path.resolve(), private)
        _open(gmsh, private)
        entities = None if group is None else _entities(gmsh, group, key)
        if version == "2.2":
            _refuse_mixed(gmsh, entities or [])
        _refuse_other_volumes(gmsh, entities)
        return tet_mesh(gmsh, entities)


def _open(gmsh: Any, path: str) -> None:
    try:
        gmsh.open(path)
    except Exception as error:
        raise MeshError(f"the file is damaged or cut off{_remark(gmsh, path)}") from error
    if _remark(gmsh, path):
        raise MeshError(f"the file is damaged or cut off{_remark(gmsh, path)}")


def _remark(gmsh: Any, path: str) -> str:
    """What gmsh says about it, in brackets, if it says more than that it could not load the file."""
    text = first_error(gmsh)
    return f" (gmsh: {text})" if text and path not in text else ""


def _checked_header(path: Path) -> str:
    """The version of the format, one of _VERSIONS."""
    with path.open("rb") as file:
        first, second = file.readline(80).strip(), file.readline(80).split()
    if first != b"$MeshFormat":
        raise MeshError("this is not a .msh file; its first line must be $MeshFormat")
    version = second[0].decode("ascii", "replace") if second else ""
    if version not in _VERSIONS:
        raise MeshError(f"the .msh format {version!r} is not read; save it as {' or '.join(_VERSIONS)}")
    return version


def _entities(gmsh: Any, group: str, key: str) -> list[int]:
    """The volumes of the physical group with this name, or with this number."""
    known = {}
    for dimension, tag in gmsh.model.getPhysicalGroups(3):
        known[str(tag)] = tag
        known[gmsh.model.getPhysicalName(dimension, tag) or str(tag)] = tag
    if group not in known:
        raise MeshError(f"{key}.group = {group!r}: no such group of volumes; known: {', '.join(known) or 'none'}")
    return [int(tag) for tag in gmsh.model.getEntitiesForPhysicalGroup(3, known[group])]


def _refuse_mixed(gmsh: Any, entities: list[int]) -> None:
    """The format 2.2 gives each tet its group; gmsh puts all tets of an entity into the groups of any of them."""
    for entity in entities:
        groups = [
            gmsh.model.getPhysicalName(3, tag) or str(tag) for tag in gmsh.model.getPhysicalGroupsForEntity(3, entity)
        ]
        if len(groups) > 1:
            raise MeshError(
                f"the tets of its elementary entity {entity} are in the groups {', '.join(groups)}, which cannot be "
                "told apart in the format 2.2; give each group entities of its own, or save it as 4.1"
            )


def _refuse_other_volumes(gmsh: Any, entities: list[int] | None) -> None:
    for entity in entities or [-1]:
        for kind in gmsh.model.mesh.getElementTypes(3, entity):
            if kind != 4:
                name = gmsh.model.mesh.getElementProperties(kind)[0]
                raise MeshError(f"it has elements of the type {name}; only 4-node tets can be used")
