"""Insertion of cohesive facets. A new facet has the traction at which it broke, and the largest stiffness that the time
step allows.
"""

import numpy as np

from ..model.state import Floats, Indices, Ints, Nodes
from ..model.topology import Split
from . import criterion
from .breaking import Breaking
from .cohesive import frames, fresh
from .columns import Facets

_LEAST = 0.05
"""Cohesive facets may use the fraction 1 - safety^2 of the square of the highest frequency that the time step resolves.
The constant ``_LEAST`` is the smallest value of that fraction."""
_SHARES = 24.0
"""Factor 4 * 3 * 2 in the stiffness limit of a facet. A node has a quarter of the mass of its tet, up to three faces of
the tet open at the node, and both nodes of a pair move."""


class Insertion:
    """Creation of the cohesive facets of one rank."""

    def __init__(self, safety: float) -> None:
        """``safety``: safety factor of the time step."""
        self._unused = max(1.0 - safety**2, _LEAST)
        self.longest = 0.0
        """Longest stable time step so far, s, among the steps in which a face was overstressed."""

    def facets(self, b: Breaking, nodes: Nodes, split: Split) -> Facets:
        """Returns the cohesive facets that replace the broken facets ``b``, at the present positions of the nodes. The
        function returns only facets whose first side is on this rank.
        """
        f = b.facets
        before = np.concatenate([f.nodes, f.nodes], axis=1)
        after = split.followed_sides(before, nodes.id, f.tets)
        places, faces = f.sides[:, 0, 1:].astype(np.int64).T.copy()
        size = criterion.areas(b.body.mesh.tets, places, faces, nodes.x)
        frequency = 4.0 * self._unused / self.longest**2
        m, stiffness = len(size), 3.0 * f.mass / _SHARES * frequency / size
        weight = b.body.law.weight
        along = (frames(nodes.x, before)[:, 0] * f.traction[:, :3]).sum(axis=1)
        share = shear_share(along, f.traction[:, :3], weight)
        return inserted(
            nodes, before, after, f.tets, f.traction[:, :3], f.traction[:, 3],
            b.body.tough.energies(share), np.full(m, weight), stiffness, size,
        )  # fmt: skip


def shear_share(along: Floats, traction: Floats, weight: float) -> Floats:
    """(m,) fraction of shear in the square of the effective traction: w t_s^2 / (<t_n>^2 + w t_s^2). ``along`` (m,):
    component t_n of the ``traction`` (m, 3) along the normal, Pa. ``weight``: weight w of shear.
    """
    shear = weight * np.maximum((traction * traction).sum(axis=1) - along * along, 0.0)
    whole = np.maximum(along, 0.0) ** 2 + shear
    return np.asarray(shear / np.where(whole > 0.0, whole, 1.0))


def inserted(
    nodes: Nodes, before: Indices, after: Indices, tets: Ints, traction: Floats, effective: Floats, energy: Floats,
    weight: Floats, stiffness: Floats, area: Floats,
) -> Facets:  # fmt: skip
    """Returns new facets at the present positions.

    ``before`` and ``after`` (m, 6): nodes of the first side and the opposite nodes, before and after the separation of
    nodes; ``traction`` (m, 3): traction on the outward normal of the first side, Pa; ``effective`` (m,): its effective
    size, Pa; ``weight``: weight of shear; ``stiffness`` (m,): largest stiffness that the time step allows, Pa/m.
    """
    frame = frames(nodes.x, before)
    along = (frame * traction[:, None]).sum(axis=2)
    along[:, 0] = np.maximum(along[:, 0], 0.0)
    shear = 1.0 / weight
    # The traction T = strength / e (<d_n> n + b^2 d_t) equals the traction at insertion if d_n = e t_n / strength and
    # d_t = e t_t / (b^2 strength). If the facet is under pressure, the effective traction contains only the shear
    # traction that exceeds friction.
    e = np.maximum(1.0, shear) * effective / stiffness
    pressed = along[:, 0] == 0.0
    across = np.sqrt(along[:, 1] ** 2 + along[:, 2] ** 2)
    held = np.where(pressed, effective * np.sqrt(shear) / np.where(across > 0.0, across, 1.0), 1.0)
    offset = (e / effective)[:, None] * along
    offset[:, 1:] *= (held / shear)[:, None]
    carried = along * np.stack([np.ones(len(area)), held, held], axis=1)
    force = (area / 3.0)[:, None] * (frame * carried[:, :, None]).sum(axis=1)
    return fresh(tets, after, effective, energy, area, shear, offset, force)
