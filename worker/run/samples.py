"""Samples of a run, which are the lines of history.csv, and the times at which they are taken."""

import math

import msgspec

from conoid.cases.messages import Energy, PartEnergy

from .. import step
from ..clock import Clock
from ..model.state import Floats
from ..output.history import History
from ..simulation import Simulation


class Samples:
    """Object that takes samples and stores the latest sample."""

    def __init__(self, sim: Simulation, history: History | None, number: int, lines: int) -> None:
        """``history``: the history file, None on all ranks except 0; ``number``: number of samples scheduled so far;
        ``lines``: number of samples taken so far.
        """
        run = sim.case.run
        self._history = history
        self._names = [probe.name for probe in sim.case.probes]
        self._every = run.end_time, run.samples
        self.number = number
        """Number of samples that were scheduled so far."""
        self.lines = lines
        """Number of samples that were taken so far."""
        self.next = number * run.end_time / run.samples
        """Simulated time of the next sample, s."""
        self.time: float | None = None
        """Simulated time of the latest sample, s."""
        self.energy: Energy | None = None
        self.parts: dict[str, PartEnergy] = {}
        self.measured: list[float] = []
        """Values of the probes at the latest sample."""

    def due(self, clock: Clock) -> bool:
        """Return whether the simulation has reached the time of the next sample."""
        return clock.t >= self.next

    def probes(self) -> dict[str, float | None]:
        """Return a dictionary from the name of each probe to its latest value. NaN is returned as None, because JSON
        has no NaN.
        """
        named = zip(self._names, self.measured, strict=True)
        return {name: None if math.isnan(value) else value for name, value in named}

    def take(self, sim: Simulation, before: Floats, *, ending: bool) -> None:
        """Write energies, momenta and probes at time n to the history. Raises PhysicsError if the energy balance has a
        too large error.

        Collective. ``before``: (nodes, 3) v(n-1/2); ``ending``: whether this is the sample after the last step.
        """
        clock, (end, samples) = sim.clock, self._every
        self.energy, self.parts, self.time = sim.ledger.close(before), sim.ledger.parts, clock.t
        if ending:
            step.end(sim, before)
        if sim.crushing is not None:
            sim.crushing.count()
        probes = sim.probes.measure(step.between(sim, before) if sim.probes.sums and not ending else None)
        self.measured = probes.tolist()
        self.number, self.lines = int(clock.t * samples / end) + 1, self.lines + 1
        self.next = self.number * end / samples
        limiter = sim.limiter()
        if self._history is not None:
            parts = [value for part in self.parts.values() for value in msgspec.structs.astuple(part)]
            extra = [*sim.ledger.momentum, *sim.ledger.angular_momentum, *parts, *probes]
            self._history.write(clock.step, clock.t, clock.dt, limiter, self.energy, extra)
        sim.ledger.require(sim.case.run, sim.case.numerics.dt_safety, f"at step {clock.step}, t = {clock.t:.6g} s")
