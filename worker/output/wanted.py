"""Data of the additional fields that a case requests for frames."""

import numpy as np

from conoid.cases.checks.on import bits
from conoid.cases.model.boundaries import Wall
from conoid.cases.output import layout

from ..boundaries.moving_walls import MovingWalls
from ..boundaries.walls import RigidWalls
from ..model.state import Floats
from ..simulation import Simulation
from .fields import Wanted


def wanted(sim: Simulation, index: int) -> Wanted:
    """Return the requested fields of frame ``index`` and the data for them. The function ``wanted`` must be called
    exactly once for each frame.
    """
    run = sim.case.run
    sets = {layout.set_array(name): bit for name, bit in bits(sim.case).items()}
    passed = run.end_time / run.frames if index else 0.0
    return Wanted(run.fields, _impulses(sim), passed, sim.walls.places(len(sim.case.boundaries_of(Wall))), sets)


def _impulses(sim: Simulation) -> Floats | None:
    """Return (nodes, 3) the impulses of contact and walls on each node since the last call, N s; None if the case
    requests no contact pressure.
    """
    if "contact_pressure" not in sim.case.run.fields:
        return None
    found = np.zeros((sim.model.nodes.n, 3))
    if sim.contact is not None:
        found += sim.contact.books.pressed / sim.contact.books.scale
        sim.contact.books.pressed[:] = 0
    for walls in (bound for bound in sim.boundaries if isinstance(bound, RigidWalls | MovingWalls)):
        found[walls.nodes] += walls.since_last_report()
    return found
