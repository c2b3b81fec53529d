"""A snapshot of the fragments of a run as numpy arrays; docs/reference/snapshots.md lists the arrays."""

import gzip
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

from conoid.cases.figures import counted, exact
from conoid.cases.output import layout, snapshot

from .errors import ClientError

if TYPE_CHECKING:
    import numpy as np


class Snapshot:
    """Content of a snapshot. Where possible, the arrays are views of the snapshot's bytes."""

    def __init__(self, data: bytes) -> None:
        """Decodes a snapshot. Raises ClientError if ``data`` is not a snapshot."""
        self.data = data
        try:
            self.header = snapshot.header_of(data)
        except ValueError as error:
            raise ClientError(str(error)) from None

    def __repr__(self) -> str:
        """Text with the number, the time and the content of the snapshot."""
        head = self.header
        seen = counted(head.fragments_total, "fragment")
        return f"<snapshot {head.n}: step {head.step}, t {exact(head.t, 's')}, {seen}>"

    def array(self, name: str) -> "np.ndarray":
        """Returns an array of the snapshot. Raises ClientError if the name is unknown."""
        import numpy as np

        array = self.header.arrays.get(name)
        if array is None:
            raise ClientError(f"the snapshot has no array {name!r}; it has: {', '.join(self.header.arrays)}")
        kind = np.dtype(array.dtype).newbyteorder("<")
        items = snapshot.size_of(array) // kind.itemsize
        return np.frombuffer(self.data, kind, items, array.offset).reshape(array.shape)

    @property
    def points(self) -> "np.ndarray":
        """Positions of the vertices, (vertices, 3), m."""
        import numpy as np

        low, high = np.array(self.header.box)
        return np.asarray(low + self.array("positions") / 65535.0 * (high - low))

    def field(self, name: str) -> "np.ndarray":
        """Returns a field with one value for each triangle, (triangles,), in the unit ``header.fields[name].unit``.
        Raises ClientError."""
        import numpy as np

        levels, field = self.array(snapshot.FIELD + name), self.header.fields[name]
        return np.asarray(field.low + levels / 255.0 * (field.high - field.low))

    @property
    def fragments(self) -> "dict[str, np.ndarray]":
        """The columns of the table of fragments: id, mass, size, centre, velocity, tets, birth."""
        begin = "fragment_"
        return {name.removeprefix(begin): self.array(name) for name in self.header.arrays if name.startswith(begin)}


def read(path: Path | str) -> Snapshot:
    """Reads a snapshot from a file; the file may also be that of all tets of the snapshot (``.tets``). Raises
    OSError, ClientError.
    """
    data = Path(path).read_bytes()
    try:
        return Snapshot(gzip.decompress(data) if Path(path).suffix == layout.TETS_SUFFIX else data)
    except (EOFError, zlib.error) as error:
        raise ClientError(f"{path}: {error}") from None
