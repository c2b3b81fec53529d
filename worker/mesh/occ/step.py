"""Checks of the text of a STEP file (ISO 10303-21): completeness, unit of length, references to other files."""

import re
from fractions import Fraction

from ...errors import MeshError

_TEXT = re.compile(rb"'(?:[^']|'')*'|/\*.*?\*/", re.DOTALL)
"""Pattern of the strings and comments of a STEP file, which may contain any text."""
_UNITS = re.compile(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)")
_NAME = re.compile(rb"#(\d+)")
_DEFINED = re.compile(rb"[;\s]#(\d+)\s*=")
_SOLID = re.compile(rb"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(")
_OPEN = re.compile(rb"=\s*OPEN_SHELL\s*\(")
_SI = re.compile(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.\s*\)")
_BASED = re.compile(rb"CONVERSION_BASED_UNIT\s*\([^,]*,\s*#(\d+)\s*\)")
_MEASURE = re.compile(rb"LENGTH_MEASURE\s*\(\s*([-+0-9.Ee]+)\s*\)\s*,\s*#(\d+)")
_ELSEWHERE = re.compile(rb"\b(DOCUMENT_FILE|EXTERNAL_SOURCE|EXTERNALLY_DEFINED_\w+)\s*\(|;\s*(REFERENCE)\s*;")
"""Patterns of references to geometry in other files: documents (AP 203, 214, 242), and the section of edition 3."""
_PREFIXES = {
    b"EXA": 18, b"PETA": 15, b"TERA": 12, b"GIGA": 9, b"MEGA": 6, b"KILO": 3, b"HECTO": 2, b"DECA": 1, b"": 0,
    b"DECI": -1, b"CENTI": -2, b"MILLI": -3, b"MICRO": -6, b"NANO": -9, b"PICO": -12,
}  # fmt: skip


def length_units(data: bytes, head: str) -> set[Fraction]:
    """Return the unit of length, m, of each context of the file.

    Raises MeshError with a message that begins with ``head`` if the file is cut off, is damaged or refers to other
    files.
    """
    if not data.rstrip().endswith(b"END-ISO-10303-21;"):
        raise MeshError(f"{head}: the STEP file is cut off: it does not end with END-ISO-10303-21;")
    text = _TEXT.sub(b"''", data)
    if found := _ELSEWHERE.search(text):
        what = (found[1] or found[2]).decode()
        raise MeshError(
            f"{head}: the STEP file refers to other files ({what}), which are not read; save all geometry in one file"
        )
    if lost := set(_NAME.findall(text)) - set(_DEFINED.findall(text)):
        raise MeshError(f"{head}: the STEP file is damaged: #{min(map(int, lost))} is used and not defined")
    names = {name for found in _UNITS.finditer(text) for name in _NAME.findall(found[1])}
    units = {unit for name in names if (unit := _length(text, name, 0)) is not None}
    if not units:
        raise MeshError(f"{head}: the STEP file does not give its unit of length")
    return units


def solids_in(data: bytes) -> int:
    """Return the number of solids that the file defines. An assembly may contain one solid several times."""
    return len(_SOLID.findall(_TEXT.sub(b"''", data)))


def surfaces_in(data: bytes) -> int:
    """Return the number of surface bodies that the file defines. A surface body has no volume."""
    return len(_OPEN.findall(_TEXT.sub(b"''", data)))


def _entity(text: bytes, name: bytes) -> bytes:
    found = re.search(rb"#" + name + rb"\s*=\s*([^;]*);", text)
    return found[1] if found else b""


def _length(text: bytes, name: bytes, depth: int) -> Fraction | None:
    """Return the unit of an entity, m; None if the unit is not a unit of length. An inch is defined by means of another
    unit, which is read first.
    """
    entity = _entity(text, name)
    if found := _SI.search(entity):
        power = _PREFIXES.get(found[1] or b"", 0)
        return Fraction(f"1e{power}")
    based = _BASED.search(entity)
    if based is None or b"LENGTH_UNIT" not in entity or depth > 8:
        return None
    measure = _MEASURE.search(_entity(text, based[1]))
    base = None if measure is None else _length(text, measure[2], depth + 1)
    if measure is None or base is None:
        return None
    return Fraction(measure[1].decode().rstrip(".") or "0") * base
