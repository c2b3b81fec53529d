"""All tets of a model in few bytes, for sections; in the layout of a snapshot (cases/output/snapshot.py).

Nodes are in the order of a Z-curve through the box (Morton 1966), tets have their nodes ascending and are sorted by
them: differences of successive values are small, and gzip compresses the zeros of their high bytes.
"""

import gzip

import numpy as np

from ..model.state import Floats, Ints

MOST_TETS = 400_000
"""Largest number of tets of a model with such a file. Chosen: a page cuts them in 20 ms."""
_BITS = 10
"""Bits of a coordinate on the Z-curve. Chosen: finer than meshes of ``MOST_TETS``."""
_LEVEL = 1
"""Level of gzip. Chosen: level 6 takes three times as long for 5 % less."""


def ordered(places: "np.ndarray", tets: Ints) -> tuple["np.ndarray", Ints, Ints]:
    """Return the nodes in their order (k,), the tets over them (n, 4), and the original row of each tet (n,);
    ``places``: (v, 3) uint16; ``tets``: (n, 4) nodes.
    """
    used = np.unique(tets)
    nodes = used[np.argsort(_along(places[used]), kind="stable")]
    number = np.zeros(len(places), np.int64)
    number[nodes] = np.arange(len(nodes))
    corners = np.sort(number[tets], axis=1)
    order = np.argsort(corners[:, 0] << 32 | corners[:, 1], kind="stable")
    return nodes, corners[order], order


def _along(places: "np.ndarray") -> Ints:
    """Return (v,) the position of each node on the Z-curve."""
    words = np.zeros(len(places), np.int64)
    cells = (places >> (16 - _BITS)).astype(np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            words |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return words


def steps(corners: Ints) -> "np.ndarray":
    """Return (4, 4, n) uint8: for each byte of 32 bits, lowest first, and each corner the difference of the first
    node from that of the tet before, and of the others from the corner before; modulo 2^32.
    """
    change = np.concatenate([np.diff(corners[:, :1], axis=0, prepend=0), np.diff(corners, axis=1)], axis=1)
    words = np.ascontiguousarray(change.T).astype("<u4")
    return np.ascontiguousarray(np.moveaxis(words.view(np.uint8).reshape(4, -1, 4), 2, 0))


def speed(v: Floats, tets: Ints) -> Floats:
    """Return (n,) the size of the mean velocity of the nodes of each tet, m/s."""
    mean = (v[tets[:, 0]] + v[tets[:, 1]] + v[tets[:, 2]] + v[tets[:, 3]]) / 4.0
    return np.asarray(np.sqrt(mean[:, 0] ** 2 + mean[:, 1] ** 2 + mean[:, 2] ** 2))


def packed(data: bytes) -> bytes:
    """Return the data compressed by gzip, without a time."""
    return gzip.compress(data, _LEVEL, mtime=0)
