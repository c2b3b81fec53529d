"""A snapshot of the fragments of a run, as numpy sees it; docs/reference/snapshots.md has its arrays."""

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
    """The bytes of a snapshot, and what is in them; arrays are views of the bytes where they can be."""

    def __init__(self, data: bytes) -> None:
        """Raises ClientError for what is no snapshot."""
        self.data = data
        try:
            self.header = snapshot.header_of(data)
        except ValueError as error:
            raise ClientError(str(error)) from None

    def __repr__(self) -> str:
        """The number, the time and what is seen."""
        head = self.header
        seen = counted(head.fragments_total, "fragment")
        return f"<snapshot {head.n}: step {head.step}, t {exact(head.t, 's')}, {seen}>"

    def array(self, name: str) -> "np.ndarray":
        """An array as it stands in the snapshot. Raises ClientError for a name that it has not."""
        import numpy as np

        array = self.header.arrays.get(name)
        if array is None:
            raise ClientError(f"the snapshot has no array {name!r}; it has: {', '.join(self.header.arrays)}")
        kind = np.dtype(array.dtype).newbyteorder("<")
        items = snapshot.size_of(array) // kind.itemsize
        return np.frombuffer(self.data, kind, items, array.offset).reshape(array.shape)

    @property
    def points(self) -> "np.ndarray":
        """(vertices, 3) m."""
        import numpy as np

        low, high = np.array(self.header.box)
        return np.asarray(low + self.array("positions") / 65535.0 * (high - low))

    def field(self, name: str) -> "np.ndarray":
        """(triangles,) a field in the unit of ``header.fields[name].unit``. Raises ClientError."""
        import numpy as np

        levels, field = self.array(snapshot.FIELD + name), self.header.fields[name]
        return np.asarray(field.low + levels / 255.0 * (field.high - field.low))

    @property
    def fragments(self) -> "dict[str, np.ndarray]":
        """The table of fragments by column: id, mass, size, centre, velocity, tets, birth."""
        begin = "fragment_"
        return {name.removeprefix(begin): self.array(name) for name in self.header.arrays if name.startswith(begin)}


def read(path: Path | str) -> Snapshot:
    """The snapshot in a file, or all tets of one (``.tets``). Raises OSError, ClientError."""
    data = Path(path).read_bytes()
    try:
        return Snapshot(gzip.decompress(data) if Path(path).suffix == layout.TETS_SUFFIX else data)
    except (EOFError, zlib.error) as error:
        raise ClientError(f"{path}: {error}") from None
