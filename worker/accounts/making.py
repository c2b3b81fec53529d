"""Energy that a line of the ledger makes, and its limit.

The sum of all energy lines can be correct although one line is wrong: if a line returns more energy than it has
received, this energy moves the bodies or goes into another line. Therefore the energy created by each line is checked
separately, relative to the largest energy so far: the largest of the energy received, the work of the stress, and the
kinetic energy.

========  ==========================================  ===============================================
lasting   plastic, viscous, friction, fracture        decrease of the line since its largest value
returned  contact, averaging, eroded, cohesive        negative part of the line
stepping  the time integration                        magnitude of the line: an error of either sign
========  ==========================================  ===============================================

``elastic`` is not judged: with an equation of state that depends on heat it is negative in hot matter that has expanded
(docs/theory/time_integration.md, Time integration). When such material erodes, its elastic energy moves to ``eroded``,
and its heat stays in ``plastic`` and ``viscous``. Therefore ``eroded`` may be negative, at most by the heat of the
eroded tets. No line is judged while the largest energy is round-off.
"""

import math
from typing import NamedTuple

from conoid.cases.messages import Energy

from ..errors import EnergyError

LASTING = ("plastic", "viscous", "friction", "fracture")
RETURNED = ("contact", "averaging", "eroded", "cohesive")
STEPPING = "stepping"
WARNED = 0.01
"""Energy that a line may make without a warning, as a share of the largest energy. The value was chosen: it is the
usual accuracy of reference values."""
STRAIN = 1e-10
"""Volume strain of the whole model. Energies below the energy of this strain are round-off: positions are rounded to
some 1e-16 of a coordinate, so strains are rounded to 1e-15, and the energy of this strain is accurate to 1e-5 of
itself."""


class Made(NamedTuple):
    """The largest energy that a line has made."""

    share: float
    """Energy made by the line, divided by the largest energy until then."""
    t: float
    """Time at which the share was largest, s."""


class Making:
    """Energy that each line of the ledger has made so far; equal on all ranks."""

    def __init__(self, rounding: float) -> None:
        """``rounding``: largest energy, J, at which no line is judged."""
        self._rounding = rounding
        self._largest = dict.fromkeys(LASTING, 0.0)
        self._energy = 0.0
        self.worst: dict[str, Made] = {}
        """Energy made, by the name of the line; only lines that have made energy."""

    def keep(self) -> tuple[dict[str, float], float, dict[str, tuple[float, float]]]:
        """Return the state of the object for a checkpoint."""
        return self._largest, self._energy, {name: (made.share, made.t) for name, made in self.worst.items()}

    def resume(self, known: tuple[dict[str, float], float, dict[str, tuple[float, float]]]) -> None:
        """Restore the state from the array of ``keep``."""
        self._largest, self._energy, worst = known
        self.worst = {name: Made(*made) for name, made in worst.items()}

    def look(self, energy: Energy, largest: float, t: float, heat: float = 0.0) -> None:
        """Add the lines of the ledger at time ``t``, s.

        ``largest``: maximum of received energy, work of the stress and kinetic energy, J; ``heat``: heat of eroded
        matter with a pressure that depends on heat, J.
        """
        self._energy = max(self._energy, largest)
        found = {name: -getattr(energy, name) for name in RETURNED}
        found["eroded"] -= heat
        for name in LASTING:
            value = getattr(energy, name)
            self._largest[name] = max(self._largest[name], value)
            found[name] = self._largest[name] - value
        found[STEPPING] = abs(energy.stepping)
        if self._energy <= self._rounding:
            return
        for name, made in found.items():
            share = made / self._energy
            if share > self.worst.get(name, Made(0.0, 0.0)).share:
                self.worst[name] = Made(share, t)

    def ranked(self) -> list[tuple[str, Made]]:
        """Return the lines that have made energy, in descending order of this energy."""
        return sorted(self.worst.items(), key=lambda item: (-item[1].share, item[0]))

    def require(self, limit: float, safety: float, when: str) -> None:
        """Raise EnergyError if a line has made more than ``limit``, run.made_limit; ``safety``: numerics.dt_safety."""
        for name, made in self.ranked()[:1]:
            if made.share > limit:
                text = f"the line {name} of the energy has made {made.share:.3g} of the largest energy"
                raise EnergyError(f"{text}, above run.made_limit {limit:g}, {when}{_cure(name, made.share, safety)}")

    def warnings(self, safety: float) -> list[str]:
        """Return a warning for each line that has made more than WARNED."""
        return [
            f"the line {name} of the energy has made {made.share:.2g} of the largest energy by {made.t:.3g} s"
            f"{_cure(name, made.share, safety)}"
            for name, made in self.ranked()
            if made.share > WARNED
        ]


def _cure(name: str, share: float, safety: float) -> str:
    """Return the remedy, if one is derived and measured in docs/theory/energy.md, "Energy that a line makes"."""
    if name == STEPPING:
        left = 0.5 * min(WARNED, share)
        wanted = safety * math.sqrt(left / share)
        rest = f"numerics.dt_safety = {wanted:.2g} would leave {100.0 * left:.2g} %"
        return f"; it falls with the square of the step: {rest}"
    if name == "averaging":
        return "; with numerics.pressure = 'standard' there is none, but tets lock where they flow"
    return ""
