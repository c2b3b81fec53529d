"""Program under mpiexec: makes one communication of each kind, of known size, and prints the communication counts of
each rank as JSON.
"""

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from conoid.worker.parallel.comm import Comm
from conoid.worker.parallel.mpi import connect
from conoid.worker.parallel.tags import Tag


def talk(comm: Comm) -> list[tuple[str, dict[str, int]]]:
    """Returns the communication counts of this rank for each operation."""
    right, left = (comm.rank + 1) % comm.size, (comm.rank - 1) % comm.size
    out, into = np.zeros((5, 3), np.int64), np.zeros((5, 3), np.int64)
    words, result = np.zeros(9, np.int64), np.zeros(9, np.int64)

    def exchange() -> None:
        standing = comm.exchange([(right, out)], [(left, into)], Tag.FORCE)
        for _ in range(4):
            standing.begin()
            standing.finish()
        standing.free()

    verbs: dict[str, Callable[[], Any]] = {
        "exchange": exchange,
        "swap": lambda: comm.swap({right: np.arange(7), comm.rank: np.arange(2), left: np.zeros(0, np.int64)}),
        "trade": lambda: comm.trade({right: np.arange(3)}, [left]),
        "sum": lambda: comm.sum(words),
        "maximum": lambda: comm.maximum(np.zeros(2)),
        "begin_maximum": lambda: comm.begin_maximum(words, result).finish(),
        "begin_sum": lambda: comm.begin_sum(words, result).finish(),
        "share": lambda: comm.share(bytes(1000)),
        "barrier": comm.barrier,
    }
    counted = []
    for name, verb in verbs.items():
        comm.sent.since_last()
        verb()
        counted.append((name, comm.sent.since_last()))
    return counted


if __name__ == "__main__":
    world = connect()
    every = world.gather(talk(world))
    if every is not None:
        print(json.dumps(every))
