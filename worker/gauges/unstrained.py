"""Warnings about parts of a finished run that could have been rigid, because their strains are very small
(cases/warnings/unstrained.py).
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from conoid.cases.reading.library import material
from conoid.cases.warnings.unstrained import Strained, could_be_rigid

from ..model.rows import PLASTIC_STRAIN
from ..output.history import extremes
from ..parallel.fixed_point import exact_sums
from ..simulation import Simulation
from .fields import tet_volumes


def found(sim: Simulation, folder: Path, eroded: int) -> Iterator[str]:
    """Yield a message for each part that could have been rigid. Collective. ``eroded``: number of removed tets."""
    case, parts = sim.case, len(sim.case.parts)
    if case.contact is None or parts < 2 or all(part.rigid is not None for part in case.parts):
        return
    sums, most = np.zeros((1, 2 * parts)), np.zeros(parts)
    for block in sim.model.blocks:
        sums[0, block.part] += block.n
        sums[0, parts + block.part] += float(tet_volumes(block.tets, sim.model.nodes.x).sum())
        if not block.rigid and block.rows > PLASTIC_STRAIN:
            most[block.part] = max(most[block.part], float(block.row(PLASTIC_STRAIN).max(initial=0.0)))
    totals, most, limiter = exact_sums(sim.comm, sums), sim.comm.maximum(most), sim.limiter()
    names = [f"internal.{name}" for name in sim.model.parts]
    energies = extremes(folder, names) if sim.comm.rank == 0 else {}
    if not energies:
        return
    whole = max(sum(energies[name][1] for name in names), 1e-300)
    strains = []
    for i, part in enumerate(case.parts):
        energy, volume = max(energies[names[i]][1], 0.0), float(totals[parts + i])
        stiffness = material(case, part.material).elastic.young * volume
        strain = float(np.sqrt(2.0 * energy / stiffness)) if stiffness > 0.0 else 0.0
        worn = bool(eroded) and part.erosion is not None
        strains.append(Strained(int(totals[i]), strain, energy / whole, most[i] > 0.0 or worn))
    yield from could_be_rigid(case, strains, limiter)
