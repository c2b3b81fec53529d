"""Initial velocities of all nodes, and warnings about joined or tied parts with different velocities."""

import numpy as np

from conoid.cases.model import schema

from ..bonds import interface
from ..bonds.pieces import Pieces
from ..model.hashing import uniform
from ..model.shares import Shares
from ..model.state import Floats, Indices
from .setting import velocities

_JITTER = 0x6A697474
"""Seed of the random part of the initial velocities."""
_ALIKE = 1e-6
"""Ratio of the difference between two velocities to the larger velocity. A difference with a smaller ratio counts as
round-off. Chosen value."""


def initial_velocities(case: schema.Case, x: Floats, part: Indices, shares: Shares) -> tuple[Floats, list[str]]:
    """Return the initial velocities of the nodes (n, 3), m/s, and a warning if parts with a common node have different
    velocities.

    A common node gets the mean velocity, weighted by mass. ``part``: (n,) the part that represents each node.
    """
    v = np.zeros_like(x)
    for index, spec in enumerate(case.parts):
        chosen = part == index
        v[chosen] = velocities(spec, x[chosen])
    warnings = _mean_velocities(case, v, x, shares)
    for index, spec in enumerate(case.parts):
        if spec.jitter > 0.0:
            chosen = part == index
            places = 3 * np.flatnonzero(chosen)[:, None] + np.arange(3)
            v[chosen] += spec.jitter * (2.0 * uniform(places, _JITTER) - 1.0)
    return v, warnings


def _mean_velocities(case: schema.Case, v: Floats, x: Floats, shares: Shares) -> list[str]:
    """Set the velocities of nodes that belong to several parts with different velocities. Return a warning if nodes
    with different velocities of their parts exist.
    """
    own = np.zeros((len(shares.node), 3))
    for index, spec in enumerate(case.parts):
        chosen = shares.part == index
        own[chosen] = velocities(spec, x[shares.node[chosen]])
    odd = np.isin(shares.node, shares.node[(own != v[shares.node]).any(axis=1)])
    if not odd.any():
        return []
    nodes, weight = np.unique(shares.node[odd]), shares.fraction[odd, None]
    v[nodes] = 0.0
    np.add.at(v, shares.node[odd], weight * own[odd])
    names = " and ".join(repr(case.parts[i].name) for i in np.unique(shares.part[odd]))
    found = f"bond: {len(nodes)} nodes of {names} have two different initial velocities"
    return [f"{found}; they start with the mass-weighted mean"]


def parted(case: schema.Case, x: Floats, tets: Indices, tied: Pieces) -> list[str]:
    """Return warnings about ``tied`` parts that start with different velocities at their bond."""
    warnings = []
    for k, one, two in interface.tied_pairs(case):
        places = x[np.unique(interface.corners(tied.slave[tied.bond == k], tets))]
        u, v = (velocities(case.parts[i], places) for i in (one, two))
        if (most := float(np.abs(u - v).max(initial=0.0))) > _ALIKE * float(np.abs([u, v]).max(initial=0.0)):
            warnings.append(
                f"bond[{k}]: {case.parts[one].name!r} and {case.parts[two].name!r} start with different velocities at "
                f"their bond; the difference is up to {most:.3g} m/s: in the first step the bond dissipates the energy "
                "of this difference, or breaks"
            )
    return warnings
