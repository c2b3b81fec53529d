"""Reason why a tet ends the run, found from the state of the tet. The text is the same on all ranks."""

import numpy as np

from ..materials.equation_of_state import GRUNEISEN, pole
from ..materials.models import EQUATIONS
from ..model.rows import VOLUME_RATIO
from ..model.state import Block, Floats
from ..simulation import Simulation


def why(sim: Simulation) -> str:
    """Returns the reason why the stable step of the limiting tet is NaN. Collective."""
    tet = sim.limiting_id()
    compression, bound = sim.comm.maximum(np.max([_compression(block, tet) for block in sim.model.blocks], axis=0))
    if compression >= bound > 0.0:
        return f"is compressed by 1 - V/V0 = {compression:.4g}; its equation of state ends at the pole, {bound:.4g}"
    return "turned inside out, or its stress is not a number"


def _compression(block: Block, tet: int) -> Floats:
    """(2,) compression in the equation of state of a tet, and compression at the pole of that equation; -inf if the
    block does not contain the tet.
    """
    places = np.flatnonzero(block.id == tet)
    if EQUATIONS[block.eos] is not GRUNEISEN or not len(places):
        return np.full(2, -np.inf)
    return np.array([1.0 - float(block.at(VOLUME_RATIO, places)[0]), pole(block.params)])
