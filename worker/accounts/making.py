"""Energy that a term of the energy ledger creates, and the limit of this energy.

The sum of all terms can be correct although one term is wrong: if a term returns more energy than it has received, this
energy moves the bodies or goes into another term. Therefore the energy that each term has created is checked
separately. This created energy is divided by the largest energy so far, which is the maximum of the energy received,
the work of the stress, and the kinetic energy.
"""

import math
from typing import NamedTuple

from conoid.cases.messages import Energy

from ..errors import EnergyError

LASTING = ("plastic", "viscous", "friction", "fracture")
RETURNED = ("contact", "averaging", "eroded", "cohesive")
STEPPING = "stepping"
WARNED = 0.01
"""Energy that a term may create without a warning, divided by the largest energy. Chosen value: the usual accuracy of
reference values."""
STRAIN = 1e-10
"""Volume strain of the whole model. An energy below the energy of this strain counts as round-off, because positions
are rounded to about 1e-16 of a coordinate, so strains are rounded to 1e-15, and the energy of this strain has a
relative error of 1e-5."""


class Made(NamedTuple):
    """Largest energy that a term has created."""

    share: float
    """Energy that the term has created, divided by the largest energy of the model up to that time."""
    t: float
    """Simulated time at which ``share`` was largest, s."""


class Making:
    """Energy that each term of the ledger has created so far. All ranks have equal values."""

    def __init__(self, rounding: float) -> None:
        """``rounding``: energy, J. No term is checked while the largest energy of the model is below ``rounding``."""
        self._rounding = rounding
        self._largest = dict.fromkeys(LASTING, 0.0)
        self._energy = 0.0
        self.worst: dict[str, Made] = {}
        """Energies created; the keys are the names of the terms. Only terms that have created energy are in the
        table."""

    def keep(self) -> tuple[dict[str, float], float, dict[str, tuple[float, float]]]:
        """Return the energies for a checkpoint."""
        return self._largest, self._energy, {name: (made.share, made.t) for name, made in self.worst.items()}

    def resume(self, known: tuple[dict[str, float], float, dict[str, tuple[float, float]]]) -> None:
        """Restore the energies from the array that ``keep`` returned."""
        self._largest, self._energy, worst = known
        self.worst = {name: Made(*made) for name, made in worst.items()}

    def look(self, energy: Energy, largest: float, t: float, heat: float = 0.0) -> None:
        """Check the terms of the ledger at time ``t``, s, and record the energies that they have created.

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
        """Return the terms that have created energy, in descending order of this energy."""
        return sorted(self.worst.items(), key=lambda item: (-item[1].share, item[0]))

    def require(self, limit: float, safety: float, when: str) -> None:
        """Raise EnergyError if a term has created more than ``limit``, run.made_limit. ``safety``:
        numerics.dt_safety.
        """
        for name, made in self.ranked()[:1]:
            if made.share > limit:
                text = f"the term {name} of the energy ledger has created {made.share:.3g} of the largest energy"
                raise EnergyError(f"{text}, above run.made_limit {limit:g}, {when}{_cure(name, made.share, safety)}")

    def warnings(self, safety: float) -> list[str]:
        """Return a warning for each term that has created more than WARNED."""
        return [
            f"the term {name} of the energy ledger has created {made.share:.2g} of the largest energy by {made.t:.3g} s"
            f"{_cure(name, made.share, safety)}"
            for name, made in self.ranked()
            if made.share > WARNED
        ]


def _cure(name: str, share: float, safety: float) -> str:
    """Return the remedy for the energy that a term creates. The text is empty if docs/theory/energy.md, "Energy that a
    line makes", derives no remedy.
    """
    if name == STEPPING:
        left = 0.5 * min(WARNED, share)
        wanted = safety * math.sqrt(left / share)
        rest = f"numerics.dt_safety = {wanted:.2g} would leave {100.0 * left:.2g} %"
        return f"; this energy decreases with the square of the step: {rest}"
    if name == "averaging":
        return "; with numerics.pressure = 'standard' this energy is zero, but tets lock in plastic flow"
    return ""
