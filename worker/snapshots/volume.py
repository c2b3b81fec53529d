"""All tets of a model, stored in few bytes, for sections. The layout is that of a snapshot (cases/output/snapshot.py).

Nodes are in the order of a Z-curve through the box (Morton 1966). The four nodes of a tet are ascending, and the tets
are sorted by their nodes. Therefore the differences of successive values are small, and gzip compresses the zeros of
their high bytes.
"""

import gzip

import numpy as np

from ..model.state import Floats, Ints

MOST_TETS = 1_000_000
"""Largest number of tets of a model for which the file is written. Chosen value: a page cuts a model with the largest
number of tets in 20 ms, and the file is made in 0.9 s of CPU time."""
_BITS = 10
"""Number of bits of a coordinate on the Z-curve. Chosen value: the resolution is finer than meshes of ``MOST_TETS``
tets."""
_LEVEL = 1
"""Compression level of gzip. Chosen value: level 6 takes three times as long and saves 5 % of the bytes."""


def ordered(places: "np.ndarray", tets: Ints) -> tuple["np.ndarray", Ints, Ints]:
    """Return three arrays: the nodes in the order of the Z-curve (k,), the tets with indices of these nodes (n, 4), and
    the original row of each tet (n,).

    ``places``: (v, 3) uint16 positions; ``tets``: (n, 4) nodes.
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
    """Return (4, 4, n) bytes (uint8) of differences modulo 2^32; the first index is the byte of the 32 bits, lowest
    first; the second index is the corner.

    The first node of a tet is compared with the first node of the previous tet; each other node is compared with the
    previous corner of its tet.
    """
    change = np.concatenate([np.diff(corners[:, :1], axis=0, prepend=0), np.diff(corners, axis=1)], axis=1)
    words = np.ascontiguousarray(change.T).astype("<u4")
    return np.ascontiguousarray(np.moveaxis(words.view(np.uint8).reshape(4, -1, 4), 2, 0))


def speed(v: Floats, tets: Ints) -> Floats:
    """Return (n,) the magnitude of the mean velocity of the nodes of each tet, m/s."""
    mean = (v[tets[:, 0]] + v[tets[:, 1]] + v[tets[:, 2]] + v[tets[:, 3]]) / 4.0
    return np.asarray(np.sqrt(mean[:, 0] ** 2 + mean[:, 1] ** 2 + mean[:, 2] ** 2))


def packed(data: bytes) -> bytes:
    """Return the data compressed by gzip, without a time stamp."""
    return gzip.compress(data, _LEVEL, mtime=0)
