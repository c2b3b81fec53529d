"""Facet tractions from nodal stress: means over the stars of the three nodes, smoother than those of the two tets.

Each node has the mean stress of the tets that hang on it, weighted with their initial volumes; sums of integers, so
that both sides of a facet, on whichever ranks, find the same traction. A facet must pass by its two tets as well: only
such facets are looked at (elements/hot.py).
"""

import numpy as np

from ..jit import njit
from ..mesh.faces import FACES
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, complete
from ..parallel.tags import Tag
from ..state import CHUNK, MASS, PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, Flags, Floats, Nodes
from .bodies import Body, Loaded
from .criterion import effective, outward
from .stars import Stars

_QUANTA = 2.0**30
"""Quanta to the strength, and to the mass of the heaviest tet."""
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
    """(nodes, 6) mean Cauchy stress xx, yy, zz, yz, zx, xy without the viscous part, Pa, of the ``wanted`` (nodes,) and
    the shared nodes of these bodies; zero at others.

    ``heaviest`` (parts,): mass of the heaviest tet of each part on all ranks, kg. Sums are in quanta of that and of the
    part's strength. All ranks take part.
    """
    sums, strength = np.zeros((nodes.n, 7), np.int64), np.zeros(len(heaviest))
    for other in neighbours:
        wanted[other.nodes] = True
    for body, star in bodies:
        block, k = body.block, body.block.part
        strength[k] = body.tough.strength
        some = np.flatnonzero(wanted & (nodes.part == k))
        _add(
            sums, some, star.first, star.count, star.pool, block.state.reshape(-1), block.state.shape[1],
            _QUANTA / strength[k], _QUANTA / heaviest[k],
        )  # fmt: skip
    complete(comm, neighbours, sums, Tag.NODAL_STRESS)
    return np.asarray(sums[:, :6] / np.maximum(sums[:, 6:], 1) * strength[nodes.part][:, None])


@njit(
    "void(int64[:, ::1], int64[::1], int32[::1], int32[::1], int32[::1], float64[::1], int64, float64, float64)",
    cache=True,
    error_model="numpy",
)
def _add(sums, nodes, first, count, pool, state, rows, of_stress, of_mass):  # type: ignore[no-untyped-def]
    """Adds the stresses of the stars of ``nodes`` times their masses, and the masses, to ``sums``."""
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


def replace(loaded: Loaded, first: Flags, body: Body, stress: Floats, x: Floats) -> None:
    """The tractions of facets of ``body`` from the ``stress`` (nodes, 6) of their nodes, made as
    small as the effective one of the two tets where they pass it. ``first`` (m,): whether the places are on the side of
    the smaller tet id.
    """
    block = body.block
    _tractions(
        loaded.traction, loaded.places, loaded.faces, first, block.tets, stress, x, block.shear_weight,
        body.spec.friction,
    )  # fmt: skip


@njit(
    "void(float64[:, ::1], int32[::1], int32[::1], boolean[::1], uint32[:, ::1], float64[:, ::1], float64[:, ::1], "
    "float64, float64)",
    cache=True,
)
def _tractions(out, places, faces, first, tets, stress, x, weight, friction):  # type: ignore[no-untyped-def]
    normal = np.empty(3)
    for m in range(len(places)):
        tet = tets[places[m]]
        outward(normal, x, tet, faces[m])
        if not first[m]:
            normal *= -1.0
        out[m, :3] = 0.0
        for a in np.sort(tet[FACES[faces[m]]]):
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
