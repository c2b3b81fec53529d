"""Reads mesh files. Runs in the child process: a file is somebody else's bytes.

The readers are our own. gmsh takes a .msh file without a known header for a script, which can start programs; without a
message it puts ghost cells among the elements, and all tets of an entity of the format 2.2 into the groups of any of
them. meshio ends the process on an element type of .inp that it does not know, does not place instances and does not
say which line is wrong.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

from conoid.cases.model.bodies import MeshFile

from ..errors import MeshError
from .abaqus.reading import read_inp
from .faces import same_side
from .keyword.reading import read_keyword
from .model import Origin, TetMesh, check
from .msh.reading import read_msh
from .radioss.reading import read_radioss
from .scale import scaled
from .solid import Content, solid
from .vtu.reading import read_vtu


def read(file: MeshFile, path: Path, key: str = "mesh") -> TetMesh:
    """The tets of ``path``, of ``file.group`` when given, in m, checked. MeshError, naming ``key``, when it cannot be.

    Nodes that no tet uses and everything that is not a volume are left out; other volumes than tets are refused.
    """
    readers: dict[str, Callable[[Path, str | None, str], Content]] = {
        ".msh": read_msh, ".inp": read_inp, ".k": read_keyword, ".key": read_keyword, ".dyn": read_keyword,
        ".rad": read_radioss,
        ".vtu": read_vtu,
    }  # fmt: skip
    if path.suffix.lower() not in readers:
        raise MeshError(f"{key}.path = {file.path!r}: expected a file name that ends in {', '.join(readers)}")
    try:
        content = readers[path.suffix.lower()](path, file.group, key)
        if file.group is not None and not any(len(each.numbers) for each in content.cells):
            raise MeshError(f"{key}.group = {file.group!r}: no element with a volume is in it")
        found = solid(content, None if file.second_order == "auto" else file.second_order)
        digests = [_digest(each) for each in (path, *content.included)]
        whole = digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
        others = tuple(zip(map(str, content.included), digests[1:], strict=True))
        origin = Origin(whole, found.places, found.notes, others)
        points = scaled(found.mesh.points, file.unit)
        mesh = check(TetMesh(points, found.mesh.tets, origin, found.mesh.sets), found.names)
        if len(twins := same_side(mesh.tets)):
            one, other = found.names.tets[twins[0]]
            raise MeshError(
                f"elements {one} and {other} lie on the same side of a face that both have; is an element there twice?"
            )
        return mesh
    except MeshError as error:
        text = str(error)
        raise MeshError(text if text.startswith(key) else f"{key}.path = {file.path!r}: {text}") from error


def _digest(path: Path) -> str:
    with path.open("rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()
