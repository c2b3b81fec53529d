"""Fragments: tets connected through intact and cohesive facets. The module computes mass, motion, energy and new
surface of each fragment.

The label of a fragment is the smallest global id of its tets. Each rank finds its own connected pieces. Then every rank
solves the small graph of the pieces that are connected across ranks (connectivity.py).

A tet gives a quarter of its mass to each of its nodes, at the position and with the velocity of the node. Therefore
mass, momentum, angular momentum and energy, summed over all fragments, are equal to the sums over the nodes. The
inertia is that of the lumped masses, which is larger than the inertia of the solid; for a single tet the lumped inertia
is five times as large. Nodes without tets belong to no fragment.

The values of the tets of a fragment are summed as integers. The quantum of each fragment is 2^-60 of its largest term,
so the sums do not depend on order and ranks, and a small fragment keeps its digits beside a large one. Centre and
velocity are summed first, and quantities relative to them in a second pass: sums about the origin would lose the digits
of r^2 / extent^2.
"""

import csv
import io
import os
from itertools import repeat
from pathlib import Path

import numpy as np

from conoid.cases.output import fragments as tables

from ..mesh.faces import FACES, areas
from ..model.ids import places
from ..model.rows import MASS
from ..model.state import Block, Floats, Ints, Model
from ..parallel.comm import Comm

_NODE_BITS = 40
"""Number of bits that store a global node id."""
_LIMB = 2.0**30
"""Number of quanta in one limb of an exact sum, see parallel/fixed_point.py."""
_FLAT = 1e-10
"""Smallest ratio of a principal moment of inertia to the largest one. An axis with a smaller ratio is treated as an
axis without inertia."""

FRAGMENT = np.dtype([
    ("label", np.int64), ("part", np.int64), ("tets", np.int64), ("nodes", np.int64), ("mass", float),
    ("centre", float, 3), ("velocity", float, 3), ("angular_momentum", float, 3), ("inertia", float, 6),
    ("translation", float), ("rotation", float), ("deformation", float), ("low", float, 3), ("high", float, 3),
    ("extent", float), ("new_surface", float),
])  # fmt: skip
"""Data type of a row in the table of fragments; cases/output/fragments.py describes the columns."""


class Groups:
    """Fragments of the tets of one rank, and sums over each fragment. The sums do not depend on the order of their
    terms. All methods are collective.
    """

    def __init__(self, labels: Ints, comm: Comm) -> None:
        """``labels`` (n,): label of the fragment of each tet."""
        self._comm = comm
        self.label, self.of = np.unique(labels, return_inverse=True)
        """Labels (g,) of the fragments with a tet on this rank, ascending; and for each tet the index (n,) of its
        label."""
        self._order = np.argsort(self.of, kind="stable")
        self._starts = np.searchsorted(self.of[self._order], np.arange(len(self.label)))
        everywhere, ranks = np.unique(np.concatenate(comm.share(self.label)), return_counts=True)
        self.split = everywhere[ranks > 1]
        """(s,) labels of the fragments with tets on several ranks. All ranks have the same array."""
        at = places(self.split, self.label)
        self._here, self._at = np.flatnonzero(at >= 0), at[at >= 0]

    def largest(self, values: Floats) -> Floats:
        """(g, k) maximum in each fragment of the columns of ``values``, (n, k)."""
        found = np.maximum.reduceat(values[self._order], self._starts, axis=0)
        if len(self.split):
            parts = np.full((len(self.split), values.shape[1]), -np.inf)
            parts[self._at] = found[self._here]
            found[self._here] = self._comm.maximum(parts)[self._at]
        return np.asarray(found)

    def count(self, words: Ints) -> Ints:
        """(g, k) sum in each fragment of the columns of ``words``, (n, k)."""
        return self.complete(np.add.reduceat(words[self._order], self._starts, axis=0))

    def complete(self, found: Ints, elsewhere: Ints | None = None) -> Ints:
        """Adds the sums ``found`` (g, k) of all ranks, for the fragments with tets on several ranks. ``elsewhere`` (s,
        k): terms that are added to the sums of these fragments.
        """
        if len(self.split):
            parts = np.zeros((len(self.split), found.shape[1]), np.int64) if elsewhere is None else elsewhere
            parts[self._at] += found[self._here]
            found[self._here] = self._comm.sum(parts)[self._at]
        return found

    def sums(self, values: Floats) -> Floats:
        """(g, k) sum in each fragment of the columns of ``values``, (n, k). The error is at most n quanta."""
        exponent = np.maximum(np.frexp(self.largest(np.abs(values)))[1], -900)
        scaled = values * np.ldexp(1.0, 30 - exponent)[self.of]
        high = np.rint(scaled)
        k = values.shape[1]
        words = self.count(np.column_stack([high, np.rint((scaled - high) * _LIMB)]).astype(np.int64))
        return np.asarray(np.ldexp(words[:, :k] * _LIMB + words[:, k:], exponent - 60))


def table(model: Model, labels: list[Ints], comm: Comm) -> "np.ndarray | None":
    """Returns the table of fragments, (fragments,) of ``FRAGMENT``, by ascending label, on rank 0; None on other ranks.
    The velocities are those of the nodes. Collective.

    The results are bit-identical for any number of ranks, because every rank computes the values of a tet by the same
    operations, sums over tets are exact, and rank 0 computes the quantities derived from the sums.
    """
    blocks, nodes = model.blocks, model.nodes
    tets = np.concatenate([np.zeros((0, 4), np.int64), *(block.tets for block in blocks)]).astype(np.int64)
    mass = np.concatenate([np.zeros(0), *(block.row(MASS) for block in blocks)])
    groups = Groups(np.concatenate([np.zeros(0, np.int64), *labels]), comm)
    rows = np.zeros(len(groups.label), FRAGMENT)
    rows["label"] = groups.label
    part = np.concatenate([np.zeros(0), *(np.full(block.n, float(block.part)) for block in blocks)])
    rows["part"] = -groups.largest(-part[:, None])[:, 0]  # the first part among the parts that share the node
    rows["tets"] = groups.count(np.ones((len(tets), 1), np.int64))[:, 0]
    rows["nodes"] = _node_counts(model, tets, groups, comm)
    _move(rows, groups, tets, mass, nodes.x, nodes.v)
    broken = np.concatenate([np.zeros(0), *(_broken_area(block, nodes.x0) for block in blocks)])
    rows["new_surface"] = groups.sums(broken[:, None])[:, 0]
    pieces = comm.gather(rows)
    if pieces is None:
        return None
    everything = np.concatenate(pieces)
    return _finished(everything[np.unique(everything["label"], return_index=True)[1]])


def _move(rows: "np.ndarray", groups: Groups, tets: Ints, mass: Floats, x: Floats, v: Floats) -> None:
    """Fills in mass, centre, velocity and bounding box. Then fills in angular momentum, inertia and kinetic energy
    relative to centre and velocity.
    """
    quarter, corners = mass / 4.0, tets.T
    moment, momentum = np.zeros((2, len(tets), 3))
    reach = np.full((len(tets), 6), -np.inf)
    for corner in corners:
        moment += quarter[:, None] * x[corner]
        momentum += quarter[:, None] * v[corner]
        reach = np.maximum(reach, np.column_stack([x[corner], -x[corner]]))
    sums, box = groups.sums(np.column_stack([mass, moment, momentum])), groups.largest(reach)
    rows["mass"], rows["high"], rows["low"] = sums[:, 0], box[:, :3], -box[:, 3:]
    rows["centre"], rows["velocity"] = sums[:, 1:4] / sums[:, :1], sums[:, 4:7] / sums[:, :1]
    centre, velocity = rows["centre"][groups.of], rows["velocity"][groups.of]
    about = np.zeros((len(tets), 10))
    for corner in corners:
        about += quarter[:, None] * _about(x[corner] - centre, v[corner] - velocity)
    sums = groups.sums(about)
    rows["angular_momentum"], rows["inertia"], rows["deformation"] = sums[:, :3], sums[:, 3:9], sums[:, 9]


def _about(r: Floats, w: Floats) -> Floats:
    """(n, 10) angular momentum, inertia and kinetic energy, each per mass, of points at ``r``, m, with velocity ``w``,
    m/s.

    The components of the inertia have the order xx, yy, zz, yz, zx, xy. The products are written out, because the sums
    of a linear algebra library may depend on the length of the arrays.
    """
    x, y, z = r.T
    u, v, o = w.T
    return np.column_stack([
        y * o - z * v, z * u - x * o, x * v - y * u,
        y * y + z * z, z * z + x * x, x * x + y * y, -(y * z), -(z * x), -(x * y),
        0.5 * (u * u + v * v + o * o),
    ])  # fmt: skip


def _broken_area(block: Block, x0: Floats) -> Floats:
    """(n,) initial area, m^2, of the broken faces of each tet."""
    area = np.zeros(block.n)
    if len(block.bond):
        for face in range(4):
            broken = np.flatnonzero(block.bond[:, face])
            area[broken] += areas(x0, block.tets[broken][:, FACES[face]].astype(np.int64))
    return area


def _node_counts(model: Model, tets: Ints, groups: Groups, comm: Comm) -> Ints:
    """(g,) number of nodes of each fragment. If a fragment has tets on several ranks, each of its nodes is counted by
    the owner of the node.
    """
    nodes = model.nodes
    group, node = np.divmod(np.unique(groups.of[:, None] * np.int64(nodes.n) + tets), max(nodes.n, 1))
    place = places(groups.split, groups.label).astype(np.int64)[group]
    found = np.bincount(group[place < 0], minlength=len(groups.label)).astype(np.int64)
    named = (place << _NODE_BITS | nodes.id[node])[place >= 0]
    owner = nodes.owner[node[place >= 0]]
    received = comm.swap({int(rank): named[owner == rank] for rank in np.unique(owner)})
    counted = np.unique(np.concatenate([np.zeros(0, np.int64), *received.values()])) >> _NODE_BITS
    elsewhere = np.bincount(counted, minlength=len(groups.split)).astype(np.int64)
    return groups.complete(found[:, None], elsewhere[:, None])[:, 0]


def _finished(rows: "np.ndarray") -> "np.ndarray":
    """Computes the derived quantities from the sums: energies and extent. The energy of rotation is 1/2 L . I^-1 L,
    with the angular momentum L and the inertia I.

    Axes without inertia have no angular momentum and are omitted. Before the call the column ``deformation`` contains
    the kinetic energy relative to the centre.
    """
    xx, yy, zz, yz, zx, xy = rows["inertia"].T
    tensors = np.stack([xx, xy, zx, xy, yy, yz, zx, yz, zz], axis=1).reshape(-1, 3, 3)
    moments, axes = np.linalg.eigh(tensors)
    about_axes = (axes * rows["angular_momentum"][:, :, None]).sum(axis=1)
    heavy = moments > _FLAT * moments[:, 2:]
    rows["rotation"] = 0.5 * np.divide(about_axes**2, moments, out=np.zeros_like(moments), where=heavy).sum(axis=1)
    rows["deformation"] -= rows["rotation"]
    rows["translation"] = 0.5 * rows["mass"] * (rows["velocity"] ** 2).sum(axis=1)
    rows["extent"] = (rows["high"] - rows["low"]).max(axis=1, initial=0.0)
    return rows


def write(folder: Path, index: int, t: float, parts: list[str], rows: "np.ndarray") -> str:
    """Writes the table of fragments of frame ``index``, atomically. Returns the path of the file relative to the run's
    folder.

    Each number is written with enough digits that reading it gives the bit-identical number.
    """
    path = tables.path(folder, index)
    path.parent.mkdir(exist_ok=True)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(tables.header())
    label, part, *values = rows.dtype.names or ()
    columns = [column for name in values for column in rows[name].reshape(len(rows), -1).T.tolist()]
    writer.writerows(zip(repeat(t), rows[label].tolist(), [parts[p] for p in rows[part]], *columns, strict=False))
    beside = path.with_suffix(".part")
    with beside.open("w", encoding="utf-8") as file:
        file.write(text.getvalue())
        file.flush()
        os.fsync(file.fileno())
    beside.rename(path)
    return str(path.relative_to(folder))
