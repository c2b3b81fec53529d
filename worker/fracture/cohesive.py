r"""Cohesive facets with an irreversible law: the traction decreases linearly with the opening (Camacho and Ortiz 1996).

::

    T ^ strength                        opening d = d_n n + d_t, measured by its size
      |\                                     D = sqrt(<d_n>^2 + b^2 |d_t|^2),  b^2 = 1 / shear weight
      | \                                    T = s(D_max) / D_max (<d_n> n + b^2 d_t)
      |  \                                   s = strength (1 - (D_max - e) / critical)
      | / \                              critical = 2 energy / strength; unloading is along the secant
      |/   \
      +--+--+----> D                     The opening starts from an offset of size e along the traction at insertion:
         e   e + critical                x+ = x- is D = e, T = that traction.

     second side       3-------------4      A facet from the side (nodes 2 and 5 are behind). A facet has three pairs of
                      .      n      .       nodes, (0, 3), (1, 4) and (2, 5), each with an opening, a traction and a
     middle    - - - . - - - ^ - - . - -    third of the area. n is the normal of the triangle in the middle between the
                    .        +-> e.         sides, e a unit vector along its first edge:
     first side    0-------------1              d_n = n . d,   d_t = (e . d, (n x e) . d)

With the offset e = 0 the law is the usual cohesive law. The stiffness of the usual law is unbounded just after
insertion: rounding would determine the direction of the traction, and unloading would require a time step of zero. The
offset e reproduces the traction at insertion in size and direction. The offset leaves the area under the curve
unchanged and bounds the stiffness by strength / e. The size of e is the smallest size that leaves the stable time step
unchanged. With three pairs of nodes every mode of opening has a stiffness. If the facet is under pressure, only the
tangential opening d_t counts, because contact prevents penetration.

At insertion a cohesive facet is under tension: it stores the energy strength e / 2 per area, although no work was done
on it. While its effective opening D is at least the offset e (column ``lent``), a pair of nodes has absorbed at least
as much energy as it would release by closing. A pair that would close further is unloaded, partly or completely: its
offset is shortened, so that it obeys the law again from its present position. The unloading does not change the
stiffness of the pair. Strength and critical opening are set so that the area under the remaining law is the remaining
energy (formulas: law.py; time of unloading: unloading.py).

A facet whose nodes have not separated has no opening: the two nodes of a pair are the same node, so the tractions on
this node cancel.
"""

import numpy as np

from ..migration.parcel import Parcel
from ..model.ids import among
from ..model.state import Flags, Floats, Indices, Ints, Nodes
from ..model.topology import Split
from ..parallel.fixed_point import Tally
from ..parallel.passes import Pass
from ..parallel.team import Team
from . import law
from .columns import FacetConstants, Facets, PairState, Softening


class Cohesion:
    """Cohesive facets of one rank; updates their openings and tractions, and sums the work done on them."""

    def __init__(self, energy: float, threads: Team) -> None:
        """``energy``: order of magnitude of the work on a facet, J; the quantum of the energy sums is chosen from it.
        ``threads``: number of threads of the rank.
        """
        self.facets = Facets.none()
        self._open, self._unload, self._foresee = (
            Pass(threads, kernel, *kinds, size=law.FACETS_OF_A_TASK)
            for kernel, kinds in ((law.open_facets, law.OPEN), (law.unload, law.UNLOAD), (law.foresee, law.FORESEE))
        )
        self.gone = Tally(np.array([energy, energy]))
        """Two sums over the failed facets: work done on the facets, J, and fracture energy of the facets, J."""

    def insert(self, new: Facets) -> None:
        """Adds facets that broke in this step."""
        self.facets = self.facets.and_more(new)

    def close(self, gone: Ints) -> None:
        """Ends the facets of the tets ``gone`` (k,), ids, ascending. The present traction of these facets acts until
        the next call of ``open``, which adds its work to the sums and removes the facets.
        """
        of, law = among(gone, self.facets.tets).any(axis=1), self.facets.softening
        law.strength[of] = law.critical[of] = law.knee[of] = 0.0

    def follow(self, split: Split, ids: Ints) -> Ints:
        """Replaces nodes of facets by the copies of these nodes; ``ids``: global ids of the local nodes. Returns the
        rows of the facets with a node that separated.
        """
        f = self.facets
        moved: Ints = law.touching(f.nodes, split.copies.parents, len(ids))
        f.nodes[moved] = split.followed_sides(f.nodes[moved], ids, f.tets[moved])
        return moved

    def open(self, x: Floats) -> None:
        """Computes openings, tractions and work at the positions ``x`` (nodes, 3), m; removes the facets that have
        failed.
        """
        f, tiny = self.facets, np.finfo(float).tiny
        if not len(f.tets):
            return
        failures = np.empty(self._open.many(len(f.tets)), np.int64)
        self._open.run(len(f.tets), *f, x, failures)
        if failures.any():
            failed = f.state.top - f.softening.knee >= np.maximum(f.softening.critical, tiny)
            kept: Flags = np.asarray(~failed.all(axis=1))
            self.gone.add(np.column_stack([f.state.work.sum(axis=1), _whole(f)])[~kept])
            self.facets = f.take(kept)

    def unload(self, change: Ints, nodes: Nodes, steps: Floats, whole: bool) -> None:
        """Lowers the tractions of pairs that would release more energy in the next step than they absorbed. Adds the
        change of the nodal forces, quanta, to ``change`` (nodes, 3). See law.unload.
        """
        of = nodes.x, nodes.v, nodes.force, nodes.mass
        self._unload.run(len(self.facets.tets), *self.facets, change.reshape(-1), *of, steps, nodes.scale, whole)

    def foresee(self, nodes: Nodes, mean_dt: float) -> None:
        """Stores the opening velocities that the pairs of nodes would have in the next step if only the present nodal
        forces acted.
        """
        of = nodes.v, nodes.force, nodes.mass
        self._foresee.run(len(self.facets.tets), *self.facets, *of, mean_dt / nodes.scale)

    def keep(self, parcel: Parcel) -> None:
        """Adds the facets to a parcel (a checkpoint or migration message)."""
        columns, ids = self.facets.columns(), parcel.nodes["id"]
        nodes, first = columns.pop("nodes"), columns["tets"][:, 0]
        parcel.rows["cohesive"] = {"tet": first, "with": ids[nodes], **columns}
        parcel.sums["cohesive.gone"], parcel.known["cohesive"] = self.gone.words, self.gone.scale

    def resume(self, parcel: Parcel, nodes: Nodes) -> None:
        """Restores the facets from a parcel (a checkpoint or migration message)."""
        table = parcel.rows["cohesive"]
        self.facets = Facets.of({**table, "nodes": nodes.places(table["with"])})
        self.gone.words, self.gone.scale = parcel.sums["cohesive.gone"], parcel.known["cohesive"]

    def scatter(self, force: Ints, scale: float) -> int:
        """Adds the cohesive forces, in quanta of 1 / ``scale`` N, to the nodal sums. Returns the largest force as its
        bit pattern (integer).
        """
        return int(law.scatter(force, self.facets.nodes, self.facets.state.pull, scale))

    def columns(self) -> Floats:
        """(m, 3) energies of each facet, J: work done on the facet, recoverable energy (released if the facet closes),
        fracture energy.
        """
        f, s = self.facets.softening, self.facets.state
        beyond = np.maximum(s.top - f.knee, 0.0)
        share = np.divide(beyond, f.critical, out=(beyond > 0.0).astype(float), where=f.critical > 0.0)
        stiffness = f.strength * np.maximum(1.0 - share, 0.0) / s.top
        back = (self.facets.constants.area / 6.0) * (stiffness * (s.size**2 - f.lent**2)).sum(axis=1)
        return np.column_stack([s.work.sum(axis=1), back, _whole(self.facets)])

    @staticmethod
    def energies(sums: Floats, gone: Floats) -> tuple[float, float, float]:
        """Returns three energies of all facets inserted so far, J: dissipated energy, energy recoverable by closing,
        and fracture energy. ``sums``: energies of the present facets, summed over all ranks; ``gone``: energies of the
        failed facets, summed over all ranks.
        """
        work, reversible, whole = sums
        gone_work, gone_whole = gone
        return float(work + gone_work - reversible), float(reversible), float(whole + gone_whole)


def _whole(facets: Facets) -> Floats:
    """(m,) fracture energy of each facet, J."""
    return facets.constants.energy * facets.constants.area


def sizes(offset: Floats, shear: Floats) -> Floats:
    """(m,) effective openings D, m, of facets with the offsets (m, 3), m."""
    return np.asarray(np.sqrt(offset[:, 0] ** 2 + shear * (offset[:, 1] ** 2 + offset[:, 2] ** 2)))


def frames(x: Floats, nodes: Indices) -> Floats:
    """(m, 3, 3) local axes of the facets ``nodes`` (m, 6), as rows: unit normal n, unit vector e of the first edge, and
    n x e.
    """
    out = np.empty((len(nodes), 3, 3))
    for m in range(len(nodes)):
        law.turn(out[m], x, nodes[m])
    return out


def fresh(
    tets: Ints, nodes: Indices, strength: Floats, energy: Floats, area: Floats, shear: Floats, offset: Floats,
    force: Floats,
) -> Facets:  # fmt: skip
    """Returns facets whose three pairs of nodes have the same state. ``offset`` and ``force`` are (m, 3), the other
    arguments (m,) as in ``Facets``.
    """
    e, strength, critical = sizes(offset, shear), strength[:, None], (2.0 * energy / strength)[:, None]
    thrice, offset, force = np.ones((1, 3)), offset[:, None, :], force[:, None, :]
    zero = np.zeros((len(area), 3, 3))
    size = e[:, None] * thrice
    softening = Softening(strength * thrice, critical * thrice, size, size.copy(), np.repeat(offset, 3, axis=1))
    state = PairState(
        size.copy(), size.copy(), zero, np.repeat(force, 3, axis=1), zero[:, :, 0].copy(), zero.copy(),
    )  # fmt: skip
    return Facets(tets, nodes, FacetConstants(energy, area, shear), softening, state)
