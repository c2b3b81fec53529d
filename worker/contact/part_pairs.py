"""Properties of pairs of parts: permission of contact, coefficient of friction, and the mass that bounds the contact
impulses.
"""

import numpy as np

from conoid.cases.model.joined import bodies, meeting
from conoid.cases.model.schema import Case

from ..model.state import Flags, Floats, Nodes
from ..parallel.comm import Comm
from ..rigid.stage import Rigid


def friction(case: Case) -> Floats:
    """(parts, parts) Coulomb's coefficient of friction. The coefficient is NaN if the two parts cannot be in contact,
    for example parts of one body that cannot separate.
    """
    assert case.contact is not None
    spec, names = case.contact, [part.name for part in case.parts]
    meets = np.array([name in spec.parts or not spec.parts for name in names])
    mu = np.where(meets[:, None] & meets[None, :], spec.friction, np.nan)
    for i, part in enumerate(case.parts):
        if part.name not in case.self_contact:
            mu[i, i] = np.nan
    body, meet = np.array(bodies(case)), np.array(meeting(case))
    one = (body[:, None] == body) & ~np.eye(len(body), dtype=bool) & ~meet
    mu[one] = np.nan
    for pair in spec.pairs:
        i, j = (names.index(name) for name in pair.parts)
        mu[i, j] = mu[j, i] = pair.friction
    return mu


def self_contact(case: Case, mu: Floats) -> Flags:
    """(parts,) True for each part that can be in contact with itself or with another part of its body. ``mu``: result
    of ``friction``.
    """
    body = np.array(bodies(case))
    return np.asarray((~np.isnan(mu) & (body[:, None] == body)).any(axis=1))


def lighter(mu: Floats, nodes: Nodes, mobility: Floats, comm: Comm, rigid: Rigid | None = None) -> float:
    """Returns a mass, kg, that bounds contact impulses. For a pair of parts it is the mass of the heaviest node of the
    lighter part; the result is the maximum over all pairs in contact. For ``rigid`` bodies the mass is that of the
    whole body; the result is 0 if there is no pair. Collective.

    No impulse exceeds the mass of the heaviest node times a speed, because the lighter part has no more momentum. A
    part with a held direction (``mobility`` (nodes, 3) is 0) can transmit any impulse. For a pair with such a part, the
    mass of the other part is used.
    """
    mass, held = np.zeros(len(mu)), np.zeros(len(mu))
    np.maximum.at(mass, nodes.part, nodes.mass)
    np.maximum.at(held, nodes.part, (mobility <= 0.0).any(axis=1))
    mass, held = comm.maximum(np.stack([mass, held]))
    if rigid is not None:
        mass[rigid.bodies.part] = rigid.bodies.mass
    gives = np.where(held > 0.0, np.inf, mass)
    pairs = np.minimum.outer(gives, gives)
    pairs = np.where(np.isinf(pairs), np.maximum.outer(mass, mass), pairs)
    np.fill_diagonal(pairs, mass)
    return float(pairs[~np.isnan(mu)].max(initial=0.0))
