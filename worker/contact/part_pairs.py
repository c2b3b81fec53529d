"""Which parts meet, with what friction, and what the lighter of two that meet weighs."""

import numpy as np

from conoid.cases.model.joined import bodies, meeting
from conoid.cases.model.schema import Case

from ..model.state import Flags, Floats, Nodes
from ..parallel.comm import Comm
from ..rigid.stage import Rigid


def friction(case: Case) -> Floats:
    """(parts, parts) Coulomb's coefficient, NaN where two parts do not meet: parts of one body that cannot come apart
    do not.
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


def itself(case: Case, mu: Floats) -> Flags:
    """(parts,) whether the body of each part may meet itself: the part, or another one of the body; ``mu`` as
    ``friction`` gives it.
    """
    body = np.array(bodies(case))
    return np.asarray((~np.isnan(mu) & (body[:, None] == body)).any(axis=1))


def lighter(mu: Floats, nodes: Nodes, mobility: Floats, comm: Comm, rigid: Rigid | None = None) -> float:
    """The heaviest node, kg, of the lighter of two parts that meet, over all that do; of ``rigid`` bodies their whole
    mass. All ranks take part.

    No impulse is more than it times a speed: the lighter body cannot give more. What is held along some direction,
    ``mobility`` (nodes, 3) 0, gives as much as it gets. 0 where no parts meet.
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
