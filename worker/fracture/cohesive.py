r"""Cohesive facets: a traction that falls linearly with the opening, irreversible (Camacho and Ortiz 1996).

::

    T ^ strength                        opening d = d_n n + d_t, measured by its size
      |\                                     D = sqrt(<d_n>^2 + b^2 |d_t|^2),  b^2 = 1 / shear weight
      | \                                    T = s(D_max) / D_max (<d_n> n + b^2 d_t)
      |  \                                   s = strength (1 - (D_max - e) / critical)
      | / \                              critical = 2 energy / strength; the way back is the secant
      |/   \
      +--+--+----> D                     The opening starts from an offset of size e along the traction at insertion:
         e   e + critical                x+ = x- is D = e, T = that traction.

With e = 0 this is the usual law, whose stiffness is without bound when a facet has just been inserted: the first
rounding error decides on the direction of the traction, and the way back needs a step of no length. The offset gives
the traction at insertion back in size and direction, keeps the area under the curve, and bounds the stiffness by
strength / e; e is the smallest that leaves the time step as it is. Each facet has three points, its pairs of nodes, so
that no way of opening is without stiffness. Under pressure only d_t counts: the rest is for contact.

A facet whose nodes have not separated holds by itself: its pairs are one node, on which its tractions cancel.
"""

from dataclasses import dataclass, fields

import numpy as np

from ..elements.tet4 import largest_of, quanta
from ..jit import njit
from ..migration.parcel import Parcel
from ..parallel.comm import Comm
from ..parallel.fixed_point import Tally, exact_sums
from ..state import Floats, Indices, Ints, Nodes, extended
from ..topology import Split

_F2, _F3 = "float64[:, ::1]", "float64[:, :, ::1]"


@dataclass
class Facets:
    """The cohesive facets of one rank: those whose side of smaller tet id is its own. SI."""

    tets: Ints
    """(m, 2) global ids of the tets of either side."""
    nodes: Indices
    """(m, 6) local nodes of the first side, counter-clockwise seen from outside of it, and those across."""
    strength: Floats
    critical: Floats
    area: Floats
    """(m,) at insertion."""
    shear: Floats
    """(m,) b^2."""
    offset: Floats
    """(m, 3) along the normal, along the first edge, and across both."""
    top: Floats
    """(m, 3) largest size of the opening so far, offset included, at each pair."""
    size: Floats
    """(m, 3) the present one."""
    opening: Floats
    """(m, 3, 3) present opening of each pair."""
    pull: Floats
    """(m, 3, 3) force on the node of the first side, N."""
    work: Floats
    """(m,) done on the facet so far, J."""

    def columns(self) -> list["np.ndarray"]:
        """The columns, in the order of their names here."""
        return [getattr(self, column.name) for column in fields(self)]


_COLUMNS = [column.name for column in fields(Facets) if column.name != "nodes"]


def _none() -> Facets:
    one, three, nine = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3))
    tets, nodes = np.zeros((0, 2), np.int64), np.zeros((0, 6), np.int32)
    return Facets(tets, nodes, one, one, one, one, three, three, three, nine, nine, one)


class Cohesion:
    """Opens the cohesive facets of one rank and adds up their work."""

    def __init__(self, energy: float) -> None:
        """``energy``: order of magnitude of the work on a facet, J."""
        self.facets = _none()
        self._gone = Tally(np.array([energy]))

    def insert(self, new: Facets) -> None:
        """Takes up facets that have just broken."""
        for column, mine, rows in zip(fields(Facets), self.facets.columns(), new.columns(), strict=True):
            setattr(self.facets, column.name, extended(mine, rows))

    def follow(self, split: Split, ids: Ints) -> Ints:
        """Takes up the copies of a split; ``ids``: of the local nodes. Returns the rows of facets that hang on a parent
        or a copy.
        """
        f = self.facets
        moved: Ints = _touching(f.nodes, split.copies.parents, len(ids))
        f.nodes[moved] = split.followed_sides(f.nodes[moved], ids, f.tets[moved])
        return moved

    def open(self, x: Floats) -> None:
        """Openings, tractions and work at the positions ``x`` (nodes, 3); what has failed is let go."""
        f = self.facets
        if not len(f.work):
            return
        failed = _open(
            x, f.nodes, f.strength, f.critical, f.area, f.shear, f.offset, f.top, f.size, f.opening, f.pull, f.work
        )
        if failed:
            e = sizes(f.offset, f.shear)
            kept = ~((f.top - e[:, None] >= f.critical[:, None]).all(axis=1))
            self._gone.add(f.work[~kept][:, None])
            self.facets = Facets(*(column[kept] for column in f.columns()))

    def keep(self, parcel: Parcel) -> None:
        """Adds the facets to a parcel."""
        f, ids = self.facets, parcel.nodes["id"]
        columns = {name: getattr(f, name) for name in _COLUMNS}
        parcel.rows["cohesive"] = {"tet": f.tets[:, 0], "with": ids[f.nodes], **columns}
        parcel.sums["cohesive.gone"], parcel.known["cohesive"] = self._gone.words, self._gone.scale

    def resume(self, parcel: Parcel, nodes: Nodes) -> None:
        """Takes them back."""
        table = parcel.rows["cohesive"]
        self.facets = Facets(nodes=nodes.places(table["with"]), **{name: table[name] for name in _COLUMNS})
        self._gone.words, self._gone.scale = parcel.sums["cohesive.gone"], parcel.known["cohesive"]

    def scatter(self, force: Ints, scale: float) -> int:
        """Adds the forces in quanta of 1 / ``scale`` N to the nodal sums; returns the bits of the largest."""
        return int(_scatter(force, self.facets.nodes, self.facets.pull, scale))

    def energies(self, comm: Comm) -> tuple[float, float]:
        """Energy, J, that is lost for good, and that the closing of facets would give back; all ranks take part.

        Facets that are pressed together beyond where they began have given back more than that: the second is negative.
        """
        f = self.facets
        e = sizes(f.offset, f.shear)
        stiffness = f.strength[:, None] * np.maximum(1.0 - (f.top - e[:, None]) / f.critical[:, None], 0.0) / f.top
        stored = 0.5 * stiffness * (f.size**2 - (e * e)[:, None])
        back = (f.area / 3.0) * stored.sum(axis=1)
        work, reversible = exact_sums(comm, np.column_stack([f.work, back]))
        return float(work + self._gone.total(comm)[0] - reversible), float(reversible)


def sizes(offset: Floats, shear: Floats) -> Floats:
    """(m,) sizes of offsets (m, 3)."""
    return np.asarray(np.sqrt(offset[:, 0] ** 2 + shear * (offset[:, 1] ** 2 + offset[:, 2] ** 2)))


def frames(x: Floats, nodes: Indices) -> Floats:
    """(m, 3, 3) unit normal, first edge and the third direction, as rows, of facets ``nodes`` (m, 6)."""
    out = np.empty((len(nodes), 3, 3))
    for m in range(len(nodes)):
        _frame(out[m], x, nodes[m])
    return out


@njit(f"void({_F2}, {_F2}, int32[::1])", cache=True, error_model="numpy")
def _frame(frame, x, nodes):  # type: ignore[no-untyped-def]
    """Normal, first edge, and n x e, of the triangle in the middle between the two sides."""
    for i in range(3):
        a = x[nodes[0], i] + x[nodes[3], i]
        frame[1, i] = x[nodes[1], i] + x[nodes[4], i] - a
        frame[2, i] = x[nodes[2], i] + x[nodes[5], i] - a
    length, across = 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[0, i] = frame[1, j] * frame[2, k] - frame[1, k] * frame[2, j]
        length += frame[1, i] * frame[1, i]
        across += frame[0, i] * frame[0, i]
    for i in range(3):
        frame[0, i] /= np.sqrt(across)
        frame[1, i] /= np.sqrt(length)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[2, i] = frame[0, j] * frame[1, k] - frame[0, k] * frame[1, j]


@njit(
    f"boolean({_F2}, int32[:, ::1], float64[::1], float64[::1], float64[::1], float64[::1], {_F2}, {_F2}, {_F2}, "
    f"{_F3}, {_F3}, float64[::1])",
    cache=True,
    error_model="numpy",
)
def _open(x, nodes, strength, critical, area, shear, offset, top, size, opening, pull, work):  # type: ignore[no-untyped-def]
    """Returns whether some facet has failed at all three pairs. The work is that of the mean of old and new force."""
    frame, d, force = np.empty((3, 3)), np.empty(3), np.empty(3)
    failed = False
    for m in range(len(nodes)):
        _frame(frame, x, nodes[m])
        b2 = shear[m]
        e = np.sqrt(offset[m, 0] ** 2 + b2 * (offset[m, 1] ** 2 + offset[m, 2] ** 2))
        left = False
        for p in range(3):
            for c in range(3):
                d[c] = offset[m, c]
                for i in range(3):
                    d[c] += frame[c, i] * (x[nodes[m, 3 + p], i] - x[nodes[m, p], i])
            d[0] = max(d[0], 0.0)
            size[m, p] = np.sqrt(d[0] * d[0] + b2 * (d[1] * d[1] + d[2] * d[2]))
            top[m, p] = max(top[m, p], size[m, p])
            share = max(1.0 - (top[m, p] - e) / critical[m], 0.0)
            left |= share > 0.0
            stiffness = area[m] / 3.0 * strength[m] * share / top[m, p]
            for i in range(3):
                force[i] = stiffness * (frame[0, i] * d[0] + b2 * (frame[1, i] * d[1] + frame[2, i] * d[2]))
                now = x[nodes[m, 3 + p], i] - x[nodes[m, p], i]
                work[m] += 0.5 * (pull[m, p, i] + force[i]) * (now - opening[m, p, i])
                opening[m, p, i], pull[m, p, i] = now, force[i]
        failed |= not left
    return failed


@njit(f"int64(int64[:, ::1], int32[:, ::1], {_F3}, float64)", cache=True)
def _scatter(force, nodes, pull, scale):  # type: ignore[no-untyped-def]
    peak = 0
    for m in range(len(nodes)):
        for p in range(3):
            fx, fy, fz = pull[m, p, 0], pull[m, p, 1], pull[m, p, 2]
            peak = max(peak, largest_of(fx, fy, fz))
            f = quanta(fx, fy, fz, scale)
            for i in range(3):
                force[nodes[m, p], i] += f[i]
                force[nodes[m, 3 + p], i] -= f[i]
    return peak


@njit(f"void(int64[:, ::1], int64, int32[:, ::1], {_F3}, float64)", cache=True)
def scatter_copies(change, first, nodes, pull, scale):  # type: ignore[no-untyped-def]
    """Adds the forces ``pull`` on facets ``nodes`` (m, 6), in quanta, to the rows of nodes from ``first`` on."""
    for m in range(len(nodes)):
        for k in range(6):
            if nodes[m, k] >= first:
                for i in range(3):
                    force = np.int64(np.rint(pull[m, k % 3, i] * scale))
                    change[nodes[m, k] - first, i] += force if k < 3 else -force


@njit("int64[::1](int32[:, ::1], int64[::1], int64)", cache=True)
def _touching(table, some, n):  # type: ignore[no-untyped-def]
    """Rows of ``table`` (m, 6) with one of ``some`` of the ``n`` nodes."""
    flags, rows, found = np.zeros(n, np.bool_), np.empty(len(table), np.int64), 0
    for a in some:
        flags[a] = True
    for i in range(len(table)):
        for k in range(table.shape[1]):
            if flags[table[i, k]]:
                rows[found] = i
                found += 1
                break
    return rows[:found].copy()
