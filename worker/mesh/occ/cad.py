"""Solids of STEP and BREP files, read with gmsh's OpenCASCADE kernel.

The checked bytes of a file are copied into the empty folder of the child process and read there. Therefore a file name
inside of the file cannot refer to another file.
"""

import re
import signal
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from conoid.cases.figures import counted, si
from conoid.cases.model.operands import CadForm
from conoid.cases.model.solids import Cad, Solid
from conoid.cases.reading.similar import choices

from ...errors import MeshError
from ..sources import Sources
from .draw import Solids
from .frame import Frame
from .printed import captured
from .step import length_units, solids_in, surfaces_in

MOST_BYTES = 256 * 2**20
"""Largest size of a CAD file, bytes. Chosen value: the size of an assembly of thousands of parts. OpenCASCADE needs
about ten times as much memory."""
_MILLIMETRE = Fraction(1, 1000)
"""Unit into which OpenCASCADE converts STEP files."""
_STEP = b"ISO-10303-21;"
_SYNTAX = b"Incorrect Syntax"
"""Text of the OpenCASCADE error for incorrect syntax. OpenCASCADE continues after an error of syntax."""
_BREP, _BREP_END = b"CASCADE Topology V", re.compile(rb"\*\s*[+-]\d+ \d+\s*$")
"""Texts by which a BREP file is recognised: one within its first lines, and its end, which is the last shape and the
shape that contains all others."""
_READING = 120
"""Longest time for which OpenCASCADE may read a file, s. The reading of a damaged file may never end. Chosen value."""

_SAME = 0.02
"""Largest relative change of the volume of solids by a general transformation. In a lens of two spherical faces the
volume was 0.31 before and 0.80 after such a transformation. OpenCASCADE integrates over splines with an error, which is
at most 0.009 for 60 unions, differences and intersections of balls made at random. Chosen value: twice this error. The
file of a body whose volume changes more is read again, so that its surfaces stay exact."""


def imported(gmsh: Any, form: CadForm, path: Path, frame: Frame, head: str, *, exact: bool = False) -> Solids:
    """Return the chosen solids of a file in the frame of the model. Raises MeshError with a message that begins with
    ``head``.

    ``exact``: True if spheres, cylinders and cones keep their surfaces. If ``exact`` is False, gmsh scales the drawn
    body by a general transformation, which converts all surfaces into splines. If the transformation changes the volume
    of the solids, the solids are read again.
    """
    occ = gmsh.model.occ
    every, unit = _read(gmsh, form, path, head)
    chosen, factor = _chosen(gmsh, form, every, head), float(unit / Fraction(repr(frame.scale)))
    if exact:
        every, chosen = _scaled(gmsh, form, path, head, factor, every, chosen)
    others = [each for each in every if each not in chosen]
    if others:
        occ.remove(others, recursive=True)
    if form.heal:
        chosen = [each for each in occ.healShapes(chosen)[:] if each[0] == 3]
    volume = sum(occ.getMass(*each) for each in chosen)
    _place(occ, chosen, 1.0 if exact else factor, frame)
    if not exact and abs(sum(occ.getMass(*each) for each in chosen) / factor**3 - volume) > _SAME * abs(volume):
        occ.remove(chosen, recursive=True)
        return imported(gmsh, form, path, frame, head, exact=True)
    occ.synchronize()
    return chosen


def _scaled(
    gmsh: Any, form: CadForm, path: Path, head: str, factor: float, every: Solids, chosen: Solids
) -> tuple[Solids, Solids]:  # fmt: skip
    """Replace the solids ``every`` of a file by the same solids, read again and scaled by ``factor``. Return all
    solids, and the solids that replace ``chosen``. The solids are identified by their order in the file, because gmsh
    loses the names of solids that it scales.
    """
    numbers = [every.index(each) for each in chosen]
    gmsh.model.occ.remove(every, recursive=True)
    gmsh.option.setNumber("Geometry.OCCScaling", factor)
    try:
        again, _ = _read(gmsh, form, path, head)
    finally:
        gmsh.option.setNumber("Geometry.OCCScaling", 1.0)
    return again, [again[number] for number in numbers]


def size_of(gmsh: Any, form: CadForm, path: Path, head: str) -> float:
    """Return the largest extent of the chosen solids of a file, m. The solids keep the position that they have in the
    file.
    """
    gmsh.model.add("size")
    every, unit = _read(gmsh, form, path, head)
    chosen = _chosen(gmsh, form, every, head)
    boxes = [gmsh.model.occ.getBoundingBox(*each) for each in chosen]
    gmsh.model.remove()
    extents = (max(box[d + 3] for box in boxes) - min(box[d] for box in boxes) for d in range(3))
    return float(unit) * float(max(extents))


def left_out(form: Solid, sources: Sources, key: str) -> Iterator[str]:
    """Yield a note for each STEP file of the body at ``key`` that has surface bodies, because surface bodies are not in
    the mesh. If the case names the solids of a file, no note is given.
    """
    for named, path in sources.items():
        if named == key or named.startswith(f"{key}."):
            data = _bytes(path, named)
            count = surfaces_in(data) if data.lstrip().startswith(_STEP) else 0
            if count and not (isinstance(form, Cad) and form.solids):
                bodies = counted(count, "surface body", "surface bodies")
                yield f"{bodies} without volume in {path.name}: not in the mesh; only solids are read"


def _place(occ: Any, solids: Solids, factor: float, frame: Frame) -> None:
    """Move solids from the coordinates of the CAD file into the frame of the model."""
    if factor != 1.0:
        occ.dilate(solids, 0, 0, 0, factor, factor, factor)
    steps = -("xyz".index(frame.axis) + 1) % 3
    if steps:
        occ.rotate(solids, 0, 0, 0, 1, 1, 1, steps * 2.0943951023931953)
    away = frame.place((0.0, 0.0, 0.0))
    if any(away):
        occ.translate(solids, *away)


def _read(gmsh: Any, form: CadForm, path: Path, head: str) -> tuple[Solids, Fraction]:
    """Return all solids of a file, in the order of the file, and the length of one unit of the file, m."""
    data = _bytes(path, head)
    if data.lstrip().startswith(_STEP):
        kind, unit = "step", _step_unit(form, data, head)
    elif _BREP in data[:200]:
        kind, unit = "brep", _brep_unit(form, data, head)
    else:
        raise MeshError(f"{head}: neither a STEP file (it begins with ISO-10303-21;) nor a BREP file of OpenCASCADE")
    copy = Path(f"solids.{kind}")
    copy.write_bytes(data)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    try:
        signal.alarm(_READING)
        with captured() as text:
            found = gmsh.model.occ.importShapes(str(copy), highestDimOnly=True, format=kind)
    except Exception as error:
        raise MeshError(f"{head}: OpenCASCADE cannot read the {kind.upper()} file ({error})") from error
    finally:
        signal.alarm(0)
        copy.unlink()
    if _SYNTAX in text:
        raise MeshError(f"{head}: the STEP file is damaged: OpenCASCADE finds incorrect syntax in it")
    gmsh.model.occ.synchronize()
    solids = [each for each in found if each[0] == 3]
    if kind == "step" and 0 < len(solids) < (said_to_be := solids_in(data)):
        raise MeshError(f"{head}: {said_to_be - len(solids)} of {said_to_be} solids of the STEP file are not closed")
    if not solids:
        raise MeshError(f"{head}: the file has no solid; save a closed body instead of surfaces")
    return solids, unit


def _bytes(path: Path, head: str) -> bytes:
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise MeshError(f"{head}: {size / 2**20:.0f} MiB are too many; allowed: up to {MOST_BYTES // 2**20}")
        return path.read_bytes()
    except OSError as error:
        raise MeshError(f"{head}: {error.strerror}") from error


def _step_unit(form: CadForm, data: bytes, head: str) -> Fraction:
    """Return the unit of the coordinates, m. OpenCASCADE converts the coordinates of a STEP file into the unit that the
    reader requests.
    """
    declared = length_units(data, head)
    if form.unit is not None and any(abs(float(unit) - form.unit) > 1e-9 * form.unit for unit in declared):
        units = choices(sorted(si(float(unit), "m") for unit in declared))
        raise MeshError(f"{head}: unit = {si(form.unit, 'm')}, but the STEP file is in {units}; remove or mend the key")

    return _MILLIMETRE


def _brep_unit(form: CadForm, data: bytes, head: str) -> Fraction:
    if not _BREP_END.search(data[-200:]):
        raise MeshError(f"{head}: the BREP file is cut off, or binary: it does not end as a text does")
    if form.unit is None:
        raise MeshError(f"{head}: a BREP file does not contain its unit; give the key unit, as '1 mm'")
    return Fraction(repr(form.unit))


def _chosen(gmsh: Any, form: CadForm, solids: Solids, head: str) -> Solids:
    if not form.solids:
        return solids
    names = [_names(gmsh.model.getEntityName(*each)) for each in solids]
    chosen = Solids()
    for wanted in form.solids:
        if isinstance(wanted, int):
            found = solids[wanted - 1 : wanted]
        else:
            found = [each for each, known in zip(solids, names, strict=True) if wanted in known]
        if not found:
            raise MeshError(f"{head}: solids: {wanted!r} is not in the file, which has {_listed(solids, names)}")
        chosen += [each for each in found if each not in chosen]
    return chosen


def _names(label: str) -> list[str]:
    """Return the names of a solid, which are made from its label. For the label ``Shapes/Bullet/Core`` the names are
    the label, every end of the label, and every part of it.
    """
    steps = label.split("/")
    return [*("/".join(steps[n:]) for n in range(len(steps))), *steps[1:]]


def _listed(solids: Solids, names: list[list[str]]) -> str:
    listed = [f"{n} {known[-1]!r}" if known[-1] else str(n) for n, known in enumerate(names, 1)]
    more = ", ..." if len(listed) > 20 else ""
    return f"{len(solids)} solids: {', '.join(listed[:20])}{more}"
