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

The spring comes taut into the world, with an energy of strength e / 2 that nobody has paid: it is lent, and D = e is as
far as the way back may lead. A pair that would go further back lets go, of as much of its traction as keeps it from
that, or of all: its offset is shortened, and from then on its traction begins where it stands. Its stiffness stays,
and the strength and critical opening become what leaves the area under the law, from there on, at what is left of the
energy (law.py; when, in release.py).

A facet whose nodes have not separated holds by itself: its pairs are one node, on which its tractions cancel.
"""

from dataclasses import dataclass, fields

import numpy as np

from ..migration.parcel import Parcel
from ..parallel.comm import Comm
from ..parallel.fixed_point import Tally, exact_sums
from ..state import Floats, Indices, Ints, Nodes, extended
from ..topology import Split
from . import law


@dataclass
class Facets:
    """The cohesive facets of one rank: those whose side of smaller tet id is its own. SI."""

    tets: Ints
    """(m, 2) global ids of the tets of either side."""
    nodes: Indices
    """(m, 6) local nodes of the first side, counter-clockwise seen from outside of it, and those across."""
    energy: Floats
    """(m,) J/m^2."""
    area: Floats
    """(m,) at insertion."""
    shear: Floats
    """(m,) b^2."""
    strength: Floats
    """(m, 3) of each pair, as all below: where the traction begins to fall."""
    critical: Floats
    """(m, 3) from there to where nothing is left."""
    knee: Floats
    """(m, 3) size of the opening at which the traction begins to fall."""
    lent: Floats
    """(m, 3) that down to which it gives back what it has taken: e, less or 0 once it has let go."""
    offset: Floats
    """(m, 3, 3) along the normal, along the first edge, and across both."""
    top: Floats
    """(m, 3) largest size of the opening so far, offset included, and the knee at least."""
    size: Floats
    """(m, 3) the present one."""
    opening: Floats
    """(m, 3, 3) how far the nodes are apart."""
    pull: Floats
    """(m, 3, 3) force on the node of the first side, N."""
    work: Floats
    """(m, 3) done on the pair so far, J."""
    foreseen: Floats
    """(m, 3, 3) velocity of opening, m/s, that the forces of the last step would have led to by themselves."""

    def columns(self) -> list["np.ndarray"]:
        """The columns, in the order of their names here."""
        return [getattr(self, column.name) for column in fields(self)]

    @property
    def pairs(self) -> law.Pairs:
        """What kernels take."""
        return law.Pairs(*(getattr(self, name) for name in law.Pairs._fields))


_COLUMNS = [column.name for column in fields(Facets) if column.name != "nodes"]


def _none() -> Facets:
    one, three, nine = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3))
    tets, nodes = np.zeros((0, 2), np.int64), np.zeros((0, 6), np.int32)
    return Facets(tets, nodes, one, one, one, three, three, three, three, nine, three, three, nine, nine, three, nine)


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
        moved: Ints = law.touching(f.nodes, split.copies.parents, len(ids))
        f.nodes[moved] = split.followed_sides(f.nodes[moved], ids, f.tets[moved])
        return moved

    def open(self, x: Floats) -> None:
        """Openings, tractions and work at the positions ``x`` (nodes, 3); what has failed is let go."""
        f = self.facets
        if not len(f.work):
            return
        if law.open_facets(f.pairs, x):
            kept = ~(f.top - f.knee >= np.maximum(f.critical, np.finfo(float).tiny)).all(axis=1)
            self._gone.add(f.work[~kept].sum(axis=1)[:, None])
            self.facets = Facets(*(column[kept] for column in f.columns()))

    def let_go(self, change: Ints, nodes: Nodes, steps: Floats, whole: bool) -> None:
        """Lowers tractions that would give what nobody has paid in the step ahead, and adds what that changes of the
        nodal forces to ``change`` (nodes, 3); see law.let_go.
        """
        law.let_go(change, self.facets.pairs, nodes.x, nodes.v, nodes.force, nodes.mass, steps, nodes.scale, whole)

    def foresee(self, nodes: Nodes, mean_dt: float) -> None:
        """Notes how pairs will open in the step ahead if nothing but forces acts."""
        law.foresee(self.facets.pairs, nodes.v, nodes.force, nodes.mass, mean_dt / nodes.scale)

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
        return int(law.scatter(force, self.facets.nodes, self.facets.pull, scale))

    def energies(self, comm: Comm) -> tuple[float, float]:
        """Energy, J, that is lost for good, and that the closing of facets would give back; all ranks take part."""
        f = self.facets
        beyond = np.maximum(f.top - f.knee, 0.0)
        share = np.divide(beyond, f.critical, out=(beyond > 0.0).astype(float), where=f.critical > 0.0)
        stiffness = f.strength * np.maximum(1.0 - share, 0.0) / f.top
        back = (f.area / 6.0) * (stiffness * (f.size**2 - f.lent**2)).sum(axis=1)
        work, reversible = exact_sums(comm, np.column_stack([f.work.sum(axis=1), back]))
        return float(work + self._gone.total(comm)[0] - reversible), float(reversible)


def sizes(offset: Floats, shear: Floats) -> Floats:
    """(m,) sizes of offsets (m, 3)."""
    return np.asarray(np.sqrt(offset[:, 0] ** 2 + shear * (offset[:, 1] ** 2 + offset[:, 2] ** 2)))


def frames(x: Floats, nodes: Indices) -> Floats:
    """(m, 3, 3) unit normal, first edge and the third direction, as rows, of facets ``nodes`` (m, 6)."""
    out = np.empty((len(nodes), 3, 3))
    for m in range(len(nodes)):
        law.turn(out[m], x, nodes[m])
    return out


def fresh(
    tets: Ints, nodes: Indices, strength: Floats, energy: Floats, area: Floats, shear: Floats, offset: Floats,
    force: Floats,
) -> Facets:  # fmt: skip
    """Facets whose three pairs are alike: ``offset`` and ``force`` are (m, 3), the others (m,) as in ``Facets``."""
    e, strength, critical = sizes(offset, shear), strength[:, None], (2.0 * energy / strength)[:, None]
    thrice, offset, force = np.ones((1, 3)), offset[:, None, :], force[:, None, :]
    zero = np.zeros((len(area), 3, 3))
    size = e[:, None] * thrice
    return Facets(
        tets, nodes, energy, area, shear, strength * thrice, critical * thrice, size, size.copy(),
        np.repeat(offset, 3, axis=1), size.copy(), size.copy(), zero, np.repeat(force, 3, axis=1), zero[:, :, 0].copy(),
        zero.copy(),
    )  # fmt: skip
