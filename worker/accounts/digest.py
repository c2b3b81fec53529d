"""Digest of the final state: a sha256 over nodes and tets in the order of their global ids. The digest is equal for any
number of ranks.
"""

import hashlib

import numpy as np

from ..model.rows import VOLUME_FLUX
from ..model.state import Floats, Model
from ..parallel.comm import Comm


def digest(model: Model, comm: Comm, nodal: list[Floats], more: bytes = b"") -> str | None:
    """Return the digest as hexadecimal text on rank 0, None on other ranks.

    Collective. The digest covers positions, velocities, the other ``nodal`` arrays, every row of the state of the tets
    except VOLUME_FLUX, and the bytes ``more``, which are equal on all ranks. VOLUME_FLUX is omitted, because it is a
    temporary value or a volume that is determined by the positions.
    """
    nodes, h = model.nodes, hashlib.sha256()
    owned = nodes.owned
    for values in (nodes.x, nodes.v, *nodal):
        _add(h, comm, nodes.id[owned], values[owned])
    for part in range(len(model.parts)):
        block = next((b for b in model.blocks if b.part == part), None)
        ids = block.id if block else np.zeros(0, np.int64)
        rows = comm.maximum(np.array([float(block.state.shape[1]) if block else 0.0]))
        for row in range(int(rows[0])):
            if row != VOLUME_FLUX:
                _add(h, comm, ids, block.row(row) if block else np.zeros(0))
    h.update(more)
    return h.hexdigest() if comm.rank == 0 else None


def _add(h: "hashlib._Hash", comm: Comm, ids: "np.ndarray", values: "np.ndarray") -> None:
    pieces = comm.gather((ids, values))
    if pieces is None:
        return
    all_ids = np.concatenate([ids for ids, _ in pieces])
    all_values = np.concatenate([values for _, values in pieces])
    h.update(np.ascontiguousarray(all_values[np.argsort(all_ids)]).tobytes())
