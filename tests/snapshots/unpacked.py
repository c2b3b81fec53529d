"""A snapshot of a shattered body, and its arrays read with numpy."""

import numpy as np

from conoid.cases.output import snapshot
from conoid.worker.snapshots import blob
from conoid.worker.snapshots.blob import Budget, Made

from .shattered import Shattered

STAMP = {"n": 7, "step": 1200, "t": 2.5e-5}


def made(body: Shattered, ranks: int = 1, budget: Budget | None = None) -> Made:
    stamp = {**STAMP, "ranks": ranks}
    return blob.made(body.whole(ranks), stamp, lambda labels: np.asarray(1e-6 * labels), budget or Budget())


def arrays(data: bytes) -> dict[str, np.ndarray]:
    header = snapshot.header_of(data)
    return {
        name: np.frombuffer(data, array.dtype, int(np.prod(array.shape)), array.offset).reshape(array.shape)
        for name, array in header.arrays.items()
    }
