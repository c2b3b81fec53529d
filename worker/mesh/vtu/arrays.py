"""Arrays of a .vtu file. An array is text, base64 or bytes, and may be compressed.

Layout: VTK user's guide, "XML file formats". The data of an array is in its XML element, or in ``AppendedData`` after
the character ``_``. The data begins with a count of bytes, or with a table of compressed blocks.
"""

import base64
import binascii
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ...errors import MeshError

Node = ElementTree.Element
_TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
    "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
_ZLIB = "vtkZLibDataCompressor"
_START, _END = b"<AppendedData", b"</AppendedData>"


class Grid:
    """Contents of a .vtu file, which must have one piece of an unstructured grid."""

    def __init__(self, path: Path) -> None:
        """Read the file. Raises MeshError if the file is no .vtu file, is damaged, or has several pieces."""
        text, self._appended, self._encoding = _divided(path.read_bytes())
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise MeshError("the file defines XML entities, which are not supported")
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            raise MeshError(f"the file is damaged or no .vtu file: {error}") from None
        if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
            raise MeshError("this is no .vtu file; it must begin with VTKFile of the type UnstructuredGrid")
        self._order = _ORDERS.get(root.get("byte_order", "LittleEndian"))
        self._head = {"UInt32": "u4", "UInt64": "u8"}.get(root.get("header_type", "UInt32"))
        compressor = root.get("compressor")
        if self._order is None or self._head is None or compressor not in (None, "", _ZLIB):
            raise MeshError(
                f"the compressor {compressor!r}, or the layout of numbers, is not supported; supported is {_ZLIB}"
            )
        self._compressed = compressor == _ZLIB
        pieces = root.findall("UnstructuredGrid/Piece")
        if len(pieces) != 1:
            raise MeshError(f"the file has {len(pieces)} pieces; write one piece in which each node occurs once")
        self._piece = pieces[0]
        self.points_count, self.cells_count = (self._count(f"NumberOf{what}") for what in ("Points", "Cells"))

    def _count(self, name: str) -> int:
        found = self._piece.get(name, "")
        if not found.isdecimal():
            raise MeshError(f"the file is damaged: its piece has no {name}")
        return int(found)

    def array(self, place: str, name: str | None, count: int | None, kind: str) -> "np.ndarray":
        """Return ``count`` values of an array in ``Points``, ``Cells`` or data; all values if ``count`` is None.

        ``kind``: ``i`` for integers, ``f`` for any numbers. Raises MeshError.
        """
        found = [node for node in self._arrays(place) if name is None or node.get("Name") == name]
        if len(found) != 1:
            raise MeshError(f"the file is damaged: {place} has {len(found)} arrays {name or 'of points'}; expected one")
        return self._checked(found[0], count, kind)

    def whole(self, place: str, count: int) -> Iterator[tuple[str, NDArray[np.int64]]]:
        """Yield names and values of the arrays of ``PointData`` or ``CellData`` with one integer for each point or
        cell.
        """
        for node in self._arrays(place):
            single = node.get("NumberOfComponents", "1") in ("", "1")
            if single and node.get("Name") and _TYPES.get(node.get("type", ""), "f")[0] != "f":
                yield str(node.get("Name")), self._checked(node, count, "i").astype(np.int64)

    def _arrays(self, place: str) -> list[Node]:
        return self._piece.findall(f"{place}/DataArray")

    def _checked(self, node: Node, count: int | None, kind: str) -> "np.ndarray":
        name = node.get("Name") or "Points"
        code = _TYPES.get(node.get("type", ""))
        if code is None or (kind == "i" and code[0] == "f"):
            raise MeshError(f"the array {name!r} has the type {node.get('type')!r}, which is not read here")
        try:
            values = self._values(node, np.dtype(f"{self._order}{code}"))
        except (ValueError, binascii.Error, zlib.error, IndexError, DeprecationWarning):
            raise MeshError(f"the file is damaged or cut off: the array {name!r} cannot be decoded") from None
        if count is not None and len(values) != count:
            raise MeshError(f"the file is damaged: the array {name!r} has {len(values)} numbers; expected {count}")
        return values

    def _values(self, node: Node, kind: "np.dtype") -> "np.ndarray":
        form, text = node.get("format", "ascii"), (node.text or "").strip()
        if form == "ascii":
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                return np.array(text.split(), np.float64 if kind.kind == "f" else np.int64)
        if form == "binary":
            return np.frombuffer(self._decoded(text.encode(), coded=True), kind)
        if form == "appended":
            start = int(node.get("offset", ""))
            if not 0 <= start < len(self._appended):
                raise ValueError
            return np.frombuffer(self._decoded(self._appended[start:], self._encoding == b"base64"), kind)
        raise MeshError(f"the array {node.get('Name')!r} has the format {form!r}, which is not read")

    def _decoded(self, data: bytes, coded: bool) -> bytes:
        """Return the bytes of an array, decoded and decompressed, without the count of bytes or the table of blocks."""
        size = int(str(self._head)[1])
        if not self._compressed:
            (many,) = self._sizes(_bytes(data, size, coded), 1)
            found = _bytes(data, size + many, coded)[size:]
            if len(found) < many:
                raise ValueError
            return found
        (blocks,) = self._sizes(_bytes(data, size, coded), 1)
        if not blocks:
            return b""
        head = (3 + blocks) * size
        if head > len(data):
            raise ValueError
        _, full, last, *lengths = self._sizes(_bytes(data, head, coded), 3 + blocks)
        rest = _bytes(data[_coded(head) if coded else head :], sum(lengths), coded)
        return b"".join(self._blocks(rest, lengths, full, last))

    def _sizes(self, data: bytes, many: int) -> list[int]:
        found = np.frombuffer(data[: many * int(str(self._head)[1])], f"{self._order}{self._head}")
        if len(found) != many:
            raise ValueError
        return [int(each) for each in found]

    @staticmethod
    def _blocks(data: bytes, lengths: list[int], full: int, last: int) -> Iterator[bytes]:
        at = 0
        for k, length in enumerate(lengths):
            wanted = last if k == len(lengths) - 1 and last else full
            unpacked = zlib.decompressobj().decompress(data[at : at + length], wanted + 1)
            if len(unpacked) != wanted:
                raise ValueError
            at += length
            yield unpacked


def _divided(data: bytes) -> tuple[bytes, bytes, bytes]:
    """Return the XML of a file without the appended bytes; also return the appended bytes after ``_`` and their
    encoding.
    """
    start = data.find(_START)
    if start < 0:
        return data, b"", b""
    head, end = data.find(b">", start), data.rfind(_END)
    mark = data.find(b"_", head)
    if head < 0 or end < head or not head < mark < end:
        raise MeshError("the file is damaged or cut off: AppendedData has no end")
    encoding = b"base64" if b"base64" in data[start:head] else b"raw"
    return data[:start] + data[end + len(_END) :], data[mark + 1 : end], encoding


def _coded(size: int) -> int:
    """Return the number of base64 characters that encode ``size`` bytes."""
    return -(-size // 3) * 4


def _bytes(data: bytes, size: int, coded: bool) -> bytes:
    """Return the first ``size`` bytes of data. If ``coded``, the data is decoded from base64."""
    return base64.b64decode(data[: _coded(size)], validate=True)[:size] if coded else data[:size]
