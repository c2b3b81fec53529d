"""Material that still moves towards the plane of a probe at the end of a run (cases/warnings/unreached.py)."""

from collections.abc import Iterator

from conoid.cases.model.measures import kind
from conoid.cases.warnings.unreached import Before, unreached

from ..simulation import Simulation


def found(sim: Simulation) -> Iterator[str]:
    """Yield a warning for each probe of a residual velocity whose part has not passed the plane. Collective."""
    probes = [k for k, probe in enumerate(sim.case.probes) if kind(probe.field) == "residual_velocity"]
    if probes:
        yield from unreached(sim.case, {k: Before(*sim.probes.before(k, sim.model.nodes.v)) for k in probes})
