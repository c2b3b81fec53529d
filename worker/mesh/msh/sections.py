"""Sections of a .msh file, and readers of their numbers. Layout: gmsh reference manual, "MSH file format".

A section is between ``$Name`` and ``$EndName``. In a binary file the numbers are stored as in memory; names are text.
"""

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import MeshError
from ..model import Floats, Ids

VERSIONS = ("4.1", "2.2")
_MARK = b"\xef\xbb\xbf"
_SINGLE = ("MeshFormat", "PhysicalNames", "Entities", "PartitionedEntities", "Nodes", "ParametricNodes", "Elements")
"""Sections that may occur only once in a file."""
_LARGEST = 2**53
"""Bound of integers that are exact as float64."""


@dataclass(frozen=True)
class Sections:
    """Contents of a file: its version, its sections by name, and the byte order of a binary file (empty for a text
    file).
    """

    version: str
    parts: dict[str, bytes]
    order: str

    def numbers(self, name: str) -> "Numbers":
        """Return a reader of the numbers of a section. Raises MeshError if the section is missing."""
        if name not in self.parts:
            raise MeshError(f"the file has no section ${name}")
        content = self.parts[name]
        return Stored(name, content, self.order) if self.order else Written(name, content)


def read_sections(path: Path) -> Sections:
    """Divide a file into sections. Raises MeshError if the file is no .msh file, is damaged, or has an unsupported
    version.
    """
    data = path.read_bytes().removeprefix(_MARK)
    parts: dict[str, bytes] = {}
    at = 0
    while (line := data[at : at + 1].strip()) or at < len(data):
        if not line:
            at += 1
            continue
        end = data.find(b"\n", at)
        word = data[at : end if end >= 0 else len(data)].strip()
        name = word[1:].decode("ascii", "replace")
        if not word.startswith(b"$") or not name.isalnum():
            raise MeshError(_stray(parts, word))
        stop = data.find(b"$End" + word[1:], at + len(word))
        if end < 0 or stop < 0:
            raise MeshError(f"the file is damaged or cut off: the section ${name} has no end")
        if name in parts and name in (
            "MeshFormat",
            "PhysicalNames",
            "Entities",
            "PartitionedEntities",
            "Nodes",
            "Elements",
        ):
            raise MeshError(f"the file is damaged: it has two sections ${name}")
        parts[name] = data[end + 1 : stop]
        at = stop + len(word) + 3
    return _formatted(parts)


def _stray(parts: dict[str, bytes], word: bytes) -> str:
    if not parts:
        return "this is not a .msh file; its first line must be $MeshFormat"
    shown = word[:40].decode("latin-1")
    return f"the file is damaged: {shown!r} stands in no section"


def _formatted(parts: dict[str, bytes]) -> Sections:
    if next((name for name in parts if name != "Comments"), "") != "MeshFormat":
        raise MeshError("this is not a .msh file; its first line must be $MeshFormat")
    line, _, rest = parts["MeshFormat"].partition(b"\n")
    words = line.decode("ascii", "replace").split()
    version, kind, size = (*words, "", "", "")[:3]
    if version not in VERSIONS:
        raise MeshError(f"the .msh format {version!r} is not read; save it as {' or '.join(VERSIONS)}")
    if kind not in ("0", "1") or size != "8":
        raise MeshError(f"the file is damaged: its format is {line.decode('ascii', 'replace').strip()!r}")
    order = ""
    if kind == "1":
        order = next((sign for sign in "<>" if rest[:4] == np.array(1, f"{sign}i4").tobytes()), "")
        if not order:
            raise MeshError("the file is damaged: its mark of the byte order has a wrong value")
    return Sections(version, parts, order)


class Numbers(ABC):
    """Sequential reader of the numbers of a section. Raises MeshError if the contents of the section do not agree with
    its counts.
    """

    def __init__(self, name: str, content: bytes, order: str) -> None:
        """Create a reader of the section ``name``. ``content``: bytes of the section; ``order``: byte order."""
        self.name, self.content, self.order, self.at = name, content, order, 0

    def count(self) -> int:
        """Read a count."""
        return int(self.sizes(1)[0])

    @abstractmethod
    def ints(self, n: int) -> Ids:
        """Read (n,) integers of 4 bytes."""

    @abstractmethod
    def sizes(self, n: int) -> Ids:
        """Read (n,) numbers of 8 bytes each, such as counts or numbers of nodes and elements."""

    @abstractmethod
    def floats(self, n: int) -> Floats:
        """Read (n,) floating point numbers."""

    @abstractmethod
    def close(self) -> None:
        """Raise MeshError if the section has more numbers than its header gives."""

    def damaged(self, why: str) -> MeshError:
        """Return the error of a section whose contents do not agree with its counts."""
        return MeshError(f"the file is damaged or cut off: the section ${self.name} {why}")


class Written(Numbers):
    """Reader of a section whose numbers are text."""

    def __init__(self, name: str, content: bytes) -> None:
        """Read all numbers of the section."""
        super().__init__(name, content, "")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                self.values: Floats = np.fromstring(content.decode("latin-1"), sep=" ")
            except (DeprecationWarning, ValueError):
                raise self.damaged("has a word that is no number") from None

    def ints(self, n: int) -> Ids:
        found = self.floats(n)
        whole: NDArray[np.bool_] = (np.abs(found) < _LARGEST) & (found == np.floor(found))
        if not whole.all():
            raise self.damaged(f"has {found[~whole][0]:g} where a whole number is expected")
        return found.astype(np.int64)

    sizes = ints

    def floats(self, n: int) -> Floats:
        if n < 0 or self.at + n > len(self.values):
            raise self.damaged("has fewer numbers than its counts")
        found = self.values[self.at : self.at + n]
        self.at += n
        return found

    def close(self) -> None:
        if self.at < len(self.values):
            raise self.damaged("has more numbers than its counts")


class Stored(Numbers):
    """Reader of a section whose numbers are binary. In the format 2.2 the counts of a section are text (``line``)."""

    def line(self) -> int:
        """Read a count that is text on a separate line."""
        text, _, _ = self.content[self.at :].partition(b"\n")
        self.at += len(text) + 1
        if not text.strip().isdigit():
            raise self.damaged("has no count")
        return int(text)

    def rows(self, n: int, layout: Any) -> NDArray[Any]:
        """Read (n,) records with the given numpy layout."""
        kind = np.dtype(layout).newbyteorder(self.order)
        if n < 0 or self.at + n * kind.itemsize > len(self.content):
            raise self.damaged("has fewer numbers than its counts")
        found = np.frombuffer(self.content, kind, n, self.at)
        self.at += n * kind.itemsize
        return found

    def ints(self, n: int) -> Ids:
        return self.rows(n, "i4").astype(np.int64)

    def sizes(self, n: int) -> Ids:
        found = self.rows(n, "u8")
        if len(found) and found.max() >= _LARGEST:
            raise self.damaged(f"has the number {found.max()}")
        return found.astype(np.int64)

    def floats(self, n: int) -> Floats:
        return self.rows(n, "f8").astype(np.float64)

    def close(self) -> None:
        if self.content[self.at :].strip():
            raise self.damaged("has more numbers than its counts")
