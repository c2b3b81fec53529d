"""Damage of tets for frames: 0 intact, 1 failed.

The damage of a tet is the largest of three values: the damage of the material law; the dissipated fraction of the
fracture energy in the most damaged cohesive facet of the tet (1 for a facet that has failed); and the plastic strain of
the tet divided by its erosion strain.
"""

import numpy as np

from conoid.cases.model.joined import cohesive
from conoid.cases.model.schema import Case
from conoid.cases.output.fields import counting, damageable

from ..fracture.cohesive import Cohesion
from ..fracture.columns import Facets
from ..model.rows import DAMAGE, PLASTIC_STRAIN
from ..model.state import Block, Floats, Ints, Model
from ..parallel.comm import Comm


def damage(case: Case, model: Model, cohesion: Cohesion | None, comm: Comm) -> list[Floats] | None:
    """Return the damage of each tet, one array (n,) for each block; None if no part can be damaged. Collective."""
    if not damageable(case):
        return None
    limits = {i: p.erosion.plastic_strain for i, p in enumerate(case.parts) if p.erosion and p.erosion.plastic_strain}
    counted, glued = counting(case), cohesive(case)
    held, spent = _facets(cohesion, comm) if cohesion is not None else (np.zeros((0, 2), np.int64), np.zeros(0))
    found = []
    for block in model.blocks:
        values = _strained(block, limits.get(block.part))
        values = np.maximum(values, block.row(DAMAGE)) if block.part in counted else values
        found.append(np.maximum(values, _broken(block, held, spent)) if block.part in glued else values)
    return found


def spent_energy(f: Facets) -> Floats:
    """Return (m,) the fraction of its fracture energy that each facet has dissipated: 1 - (remaining area below the
    law) / energy.

    A facet has three pairs of nodes. The remaining area of a pair is strength share^2 critical / 2, where ``share`` is
    the remaining fraction of the traction (fracture/cohesive.py).
    """
    law, beyond = f.softening, np.maximum(f.state.top - f.softening.knee, 0.0)
    fallen = np.divide(beyond, law.critical, out=(beyond > 0.0).astype(float), where=law.critical > 0.0)
    left = 0.5 * law.strength * law.critical * np.maximum(1.0 - fallen, 0.0) ** 2
    return np.asarray(np.clip(1.0 - left.mean(axis=1) / f.constants.energy, 0.0, 1.0))


def _facets(cohesion: Cohesion, comm: Comm) -> tuple[Ints, Floats]:
    """Return the two tets (m, 2) at each cohesive facet of all ranks, and the dissipated fraction (m,) of its fracture
    energy.

    Collective.
    """
    shares = comm.share((cohesion.facets.tets, spent_energy(cohesion.facets)))
    return np.concatenate([tets for tets, _ in shares]), np.concatenate([spent for _, spent in shares])


def _strained(block: Block, limit: float | None) -> Floats:
    if limit is None or not block.has(PLASTIC_STRAIN):
        return np.zeros(block.n)
    return np.asarray(np.minimum(block.row(PLASTIC_STRAIN) / limit, 1.0))


def _broken(block: Block, held: Ints, spent: Floats) -> Floats:
    """Return (n,) the damage of the most damaged facet of each tet. A broken facet without cohesion has the damage
    1.
    """
    order = np.argsort(block.id)
    values, holding = np.zeros(block.n), np.zeros(block.n, np.int64)
    for side in (0, 1):
        at = np.minimum(np.searchsorted(block.id[order], held[:, side]), max(block.n - 1, 0))
        mine = block.id[order][at] == held[:, side] if block.n else np.zeros(len(held), bool)
        rows = order[at[mine]] if block.n else at[mine]
        np.maximum.at(values, rows, spent[mine])
        np.add.at(holding, rows, 1)
    apart = ((block.bond != 0) & (block.across >= 0)).sum(axis=1)
    values[apart > holding] = 1.0
    return values
