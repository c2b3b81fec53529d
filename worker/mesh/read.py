"""Reader of mesh files, for the child process. The files are untrusted input.

Conoid has its own readers, because gmsh and meshio fail on some files. gmsh treats a .msh file without a known header
as a script, which can start programs. gmsh adds ghost cells to the elements without a message. In the format 2.2 gmsh
adds all tets of an entity to the group of any of these tets. meshio ends the process if an .inp file has an unknown
element type. meshio also ignores the positions of instances, and does not report the line of an error.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

from conoid.cases.figures import si
from conoid.cases.model.bodies import MeshFile
from conoid.cases.units import parse_unit

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
    """Return the checked mesh of the file ``path``, in m, or of its group ``file.group`` if that is given. Raises
    MeshError; its message contains ``key``.

    Unused nodes and elements without volume are omitted. A volume element that cannot be cut into tets is an error.
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
            raise MeshError(f"{key}.group = {file.group!r}: the group has no element with a volume")
        _refuse_unit(file, content.length, key)
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


def _refuse_unit(file: MeshFile, stated: str, key: str) -> None:
    """Raise MeshError if the file gives another unit of length than the case. A unit that is a number or an unknown
    word is not compared.
    """
    try:
        factor, dimension = parse_unit(stated)
    except ValueError:
        return
    if dimension == parse_unit("m")[1] and abs(float(factor) - file.unit) > 1e-9 * file.unit:
        raise MeshError(f"{key}.unit = {si(file.unit, 'm')}, but the file is in {stated}; mend the key or the file")


def _digest(path: Path) -> str:
    with path.open("rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()
