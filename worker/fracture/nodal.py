"""Facet tractions from nodal stress. The stress is a mean over the stars of the three nodes of a facet, which is
smoother than the mean of its two tets.

The stress of a node is the mean stress of its tets, weighted with their initial volumes. The sums are sums of integers,
so that the two sides of a facet compute the same traction on all ranks. A facet is a candidate only if it also passes
the criterion with the stress of its two tets (criterion.py).
"""

import numpy as np

from ..kernels.jit import njit, types
from ..mesh.faces import FACES
from ..model.rows import MASS, PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ
from ..model.state import CHUNK, Flags, Floats, Nodes
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, complete
from ..parallel.tags import Tag
from .criterion import effective, outward
from .facets import Body
from .records import CANDIDATES, INTERFACE, MESH, POINTS, Candidates, InterfaceFacets
from .stars import Stars

_QUANTA = 2.0**30
"""Number of quanta in the strength of a part, and number of quanta in the mass of its heaviest tet."""
_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P, _MASS = PRESSURE * CHUNK, MASS * CHUNK


def stresses(
    bodies: list[tuple[Body, Stars]],
    wanted: Flags,
    nodes: Nodes,
    heaviest: Floats,
    neighbours: list[Neighbour],
    comm: Comm,
) -> Floats:
    """(nodes, 6) mean Cauchy stress xx, yy, zz, yz, zx, xy of nodes, Pa, without the viscous part. Computed for the
    ``wanted`` nodes and for the shared nodes of the bodies; zero at other nodes.

    ``heaviest`` (parts,): mass of the heaviest tet of each part on all ranks, kg. The quantum of a nodal sum depends on
    the mass of the heaviest tet and on the strength of the part. Therefore two bodies in one call must not have a
    common node. Collective.
    """
    sums, strength = np.zeros((nodes.n, 7), np.int64), np.zeros(nodes.n)
    for other in neighbours:
        wanted[other.nodes] = True
    for body, star in bodies:
        held, own = star.count[: nodes.n] > 0, body.tough.strength
        strength[held] = own
        per_mass = _QUANTA / heaviest[body.block.part]
        _add(
            sums, np.flatnonzero(wanted & held), star.first, star.count, star.pool, body.mesh, _QUANTA / own, per_mass
        )  # fmt: skip
    complete(comm, neighbours, sums, Tag.NODAL_STRESS)
    return np.asarray(sums[:, :6] / np.maximum(sums[:, 6:], 1) * strength[:, None])


@njit(
    types.void(
        types.int64[:, ::1], types.int64[::1], types.int32[::1], types.int32[::1], types.int32[::1], MESH,
        types.float64, types.float64,
    ),
    cache=True,
    error_model="numpy",
)  # fmt: skip
def _add(sums, nodes, first, count, pool, mesh, of_stress, of_mass):  # type: ignore[no-untyped-def]
    """Adds the products of stress and mass of the tets in the stars of ``nodes`` to ``sums``, and also their masses."""
    state, rows = mesh.state, mesh.columns
    for a in nodes:
        for e in pool[first[a] : first[a] + count[a]]:
            at = (e // CHUNK) * rows * CHUNK + e % CHUNK
            p, weight = state[at + _P], np.rint(state[at + _MASS] * of_mass)
            share = weight / _QUANTA * of_stress
            sums[a, 0] += np.int64(np.rint((state[at + _SXX] - p) * share))
            sums[a, 1] += np.int64(np.rint((state[at + _SYY] - p) * share))
            sums[a, 2] += np.int64(np.rint((state[at + _SZZ] - p) * share))
            sums[a, 3] += np.int64(np.rint(state[at + _SYZ] * share))
            sums[a, 4] += np.int64(np.rint(state[at + _SZX] * share))
            sums[a, 5] += np.int64(np.rint(state[at + _SXY] * share))
            sums[a, 6] += np.int64(weight)


def replace(found: Candidates, shared: InterfaceFacets, body: Body, stress: Floats, x: Floats) -> None:
    """Sets the tractions of candidates of ``body`` from the ``stress`` (nodes, 6) of their nodes, at the positions
    ``x`` (nodes, 3). If the effective size of a new traction exceeds that of the mean traction of the two tets, the new
    traction is reduced to the size of the mean traction.
    """
    _replace(found, shared, body.mesh, stress, x, body.law.weight, body.spec.friction)


@njit(types.void(CANDIDATES, INTERFACE, MESH, POINTS, POINTS, types.float64, types.float64), cache=True)
def _replace(found, shared, mesh, stress, x, weight, friction):  # type: ignore[no-untyped-def]
    normal, out = np.empty(3), found.traction
    for m in range(len(found.place)):
        tet, face, row = mesh.tets[found.place[m]], found.face[m], found.shared[m]
        outward(normal, x, tet, face)
        if row >= 0 and not shared.first[row]:
            normal *= -1.0
        out[m, :3] = 0.0
        for a in np.sort(tet[FACES[face]]):
            s = stress[a]
            out[m, 0] += s[0] * normal[0] + s[5] * normal[1] + s[4] * normal[2]
            out[m, 1] += s[5] * normal[0] + s[1] * normal[1] + s[3] * normal[2]
            out[m, 2] += s[4] * normal[0] + s[3] * normal[1] + s[2] * normal[2]
        out[m, :3] /= 3.0
        own = effective(out[m, :3], normal, weight, friction)
        if own > out[m, 3]:
            out[m, :3] *= out[m, 3] / own
        else:
            out[m, 3] = own
