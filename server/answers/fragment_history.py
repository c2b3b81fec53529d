"""History of one fragment over the snapshots of a run."""

import os
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path

from conoid.cases.messages import Snapshot
from conoid.cases.output import snapshot

from ..errors import ServiceError
from . import download
from .schemas.history import FragmentCourse

MOST = 200
"""Largest number of snapshots that are read for the history of a fragment; the snapshots are evenly spaced. Reading
them takes 0.2 s if no table is cached (reason of the chosen value)."""
_KNOWN = 512
"""Largest number of cached tables of fragments of all runs: at most 50 MB of memory."""
_HEADER = 16
"""Number of bytes at the start of a snapshot file; they contain the length of its header."""
_LONGEST = 1 << 24
"""Largest size in bytes of the header of a snapshot: a hundred times the longest header of a shipped case (chosen
value)."""
_DAMAGE = ValueError, IndexError, TypeError, OverflowError, RecursionError
"""Errors that reading a damaged snapshot can raise: wrong numbers in the header, or a truncated file."""
_COLUMNS = "fragment_id", "fragment_mass", "fragment_velocity", "fragment_size", "fragment_tets"


def course(folder: Path, snapshots: Sequence[Snapshot], label: int) -> FragmentCourse:
    """Returns the history of the fragment ``label`` of the run in ``folder``. A snapshot that is damaged, or that does
    not contain the fragment, is left out.
    """
    most = min(MOST, len(snapshots))
    chosen = sorted({round(k * (len(snapshots) - 1) / max(most - 1, 1)) for k in range(most)})
    rows = [row for k in chosen for row in _found(folder, snapshots[k], label)]
    columns = [list(column) for column in zip(*rows, strict=True)] or [[] for _ in range(6)]
    return FragmentCourse(**dict(zip(("n", "t", "mass", "speed", "size", "tets"), columns, strict=True)))


def _found(folder: Path, message: Snapshot, label: int) -> Iterator[tuple[float, ...]]:
    try:
        identity, mass, velocity, size, tets = _table(folder, message.path, message.sha256)
        row = identity.tolist().index(label)
        speed = sum(part * part for part in velocity[3 * row : 3 * row + 3]) ** 0.5
        yield message.n, message.t, mass[row], speed, size[row], tets[row]
    except (ServiceError, OSError, *_DAMAGE):
        return


@lru_cache(maxsize=_KNOWN)
def _table(folder: Path, path: str, _sha256: str) -> tuple[memoryview, ...]:
    """Returns the needed columns of the table of fragments of a snapshot; the other columns are not read. Raises
    ServiceError, OSError or ValueError.
    """
    with download.open_inside(folder, path) as file:
        start = file.read(_HEADER)
        head = start + file.read(min(_LONGEST, int.from_bytes(start[12:16], "little")))
        header = snapshot.header_of(head, size=os.fstat(file.fileno()).st_size)
        return tuple(_column(file.fileno(), header.arrays[name]) for name in _COLUMNS if name in header.arrays)


def _column(descriptor: int, array: snapshot.Array) -> memoryview:
    return memoryview(os.pread(descriptor, snapshot.size_of(array), array.offset)).cast(snapshot.TYPES[array.dtype])  # type: ignore[call-overload, no-any-return]
