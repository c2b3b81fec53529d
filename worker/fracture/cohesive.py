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

import numpy as np

from ..migration.parcel import Parcel
from ..model.state import Flags, Floats, Indices, Ints, Nodes
from ..model.topology import Split
from ..parallel.fixed_point import Tally
from . import law
from .columns import FacetConstants, Facets, PairState, Softening


class Cohesion:
    """Opens the cohesive facets of one rank and adds up their work."""

    def __init__(self, energy: float) -> None:
        """``energy``: order of magnitude of the work on a facet, J."""
        self.facets = Facets.none()
        self.gone = Tally(np.array([energy, energy]))
        """Work on the facets that have failed, J, and what they should have taken."""

    def insert(self, new: Facets) -> None:
        """Takes up facets that have just broken."""
        self.facets = self.facets.and_more(new)

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
        f, tiny = self.facets, np.finfo(float).tiny
        if not len(f.tets):
            return
        if law.open_facets(f, x):
            failed = f.state.top - f.softening.knee >= np.maximum(f.softening.critical, tiny)
            kept: Flags = np.asarray(~failed.all(axis=1))
            self.gone.add(np.column_stack([f.state.work.sum(axis=1), _whole(f)])[~kept])
            self.facets = f.take(kept)

    def let_go(self, change: Ints, nodes: Nodes, steps: Floats, whole: bool) -> None:
        """Lowers tractions that would give what nobody has paid in the step ahead, and adds what that changes of the
        nodal forces to ``change`` (nodes, 3); see law.let_go.
        """
        law.let_go(change, self.facets, nodes.x, nodes.v, nodes.force, nodes.mass, steps, nodes.scale, whole)

    def foresee(self, nodes: Nodes, mean_dt: float) -> None:
        """Notes how pairs will open in the step ahead if nothing but forces acts."""
        law.foresee(self.facets, nodes.v, nodes.force, nodes.mass, mean_dt / nodes.scale)

    def keep(self, parcel: Parcel) -> None:
        """Adds the facets to a parcel."""
        columns, ids = self.facets.columns(), parcel.nodes["id"]
        nodes, first = columns.pop("nodes"), columns["tets"][:, 0]
        parcel.rows["cohesive"] = {"tet": first, "with": ids[nodes], **columns}
        parcel.sums["cohesive.gone"], parcel.known["cohesive"] = self.gone.words, self.gone.scale

    def resume(self, parcel: Parcel, nodes: Nodes) -> None:
        """Takes them back."""
        table = parcel.rows["cohesive"]
        self.facets = Facets.of({**table, "nodes": nodes.places(table["with"])})
        self.gone.words, self.gone.scale = parcel.sums["cohesive.gone"], parcel.known["cohesive"]

    def scatter(self, force: Ints, scale: float) -> int:
        """Adds the forces in quanta of 1 / ``scale`` N to the nodal sums; returns the bits of the largest."""
        return int(law.scatter(force, self.facets.nodes, self.facets.state.pull, scale))

    def columns(self) -> Floats:
        """(m, 3) work on each facet, what its closing would give back, and what it takes in the end, J."""
        f, s = self.facets.softening, self.facets.state
        beyond = np.maximum(s.top - f.knee, 0.0)
        share = np.divide(beyond, f.critical, out=(beyond > 0.0).astype(float), where=f.critical > 0.0)
        stiffness = f.strength * np.maximum(1.0 - share, 0.0) / s.top
        back = (self.facets.constants.area / 6.0) * (stiffness * (s.size**2 - f.lent**2)).sum(axis=1)
        return np.column_stack([s.work.sum(axis=1), back, _whole(self.facets)])

    @staticmethod
    def energies(sums: Floats, gone: Floats) -> tuple[float, float, float]:
        """Energy, J, that is lost for good, that the closing of facets would give back, and that all facets take which
        have ever been inserted, when they have failed; by the sums of ``columns`` and of ``gone`` over all ranks.
        """
        work, reversible, whole = sums
        gone_work, gone_whole = gone
        return float(work + gone_work - reversible), float(reversible), float(whole + gone_whole)


def _whole(facets: Facets) -> Floats:
    """(m,) energy, J, that each of the facets takes in the end."""
    return facets.constants.energy * facets.constants.area


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
    softening = Softening(strength * thrice, critical * thrice, size, size.copy(), np.repeat(offset, 3, axis=1))
    state = PairState(
        size.copy(), size.copy(), zero, np.repeat(force, 3, axis=1), zero[:, :, 0].copy(), zero.copy(),
    )  # fmt: skip
    return Facets(tets, nodes, FacetConstants(energy, area, shear), softening, state)
