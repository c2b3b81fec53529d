"""Energy that a line of the ledger makes, beside its limit.

The sum of all lines closes also where one of them is wrong: what it gives that it has never taken moves the bodies, or
is lost in another line. So each line is judged by itself, over the largest energy that there has been so far: what has
come in, the work of the stress, or motion.

========  ==========================================  =============================================
lasting   plastic, viscous, friction, fracture        what the line has fallen by since its largest
returned  contact, averaging, eroded, cohesive        what it is below zero
stepping  the time integration                        its magnitude: an error either way
========  ==========================================  =============================================

``elastic`` is not judged: with an equation of state that sees heat it is below zero in hot matter that has expanded
(docs/theory/time_integration.md, Time integration). Where such matter erodes, its elastic energy goes to ``eroded`` and
its heat stays in ``plastic`` and ``viscous``: so ``eroded`` may be below zero by that heat, and no more. No line is
judged while the largest energy is that of rounding.
"""

import math
from typing import NamedTuple

from conoid.cases.messages import Energy

from ..errors import EnergyError

LASTING = ("plastic", "viscous", "friction", "fracture")
RETURNED = ("contact", "averaging", "eroded", "cohesive")
STEPPING = "stepping"
TOLD = 0.01
"""Share of the largest energy that a line may make without a warning. Chosen: what references are usually read to."""
STRAIN = 1e-10
"""Energy below that of this volume strain everywhere is rounding: positions are rounded to some 1e-16 of a coordinate,
so strains to 1e-15, and the energy of this one is right to 1e-5 of itself."""


class Made(NamedTuple):
    """The worst that a line has made."""

    share: float
    """Of the largest energy until then."""
    t: float
    """s."""


class Making:
    """What each line has made so far; equal on all ranks."""

    def __init__(self, rounding: float) -> None:
        """``rounding``: the energy below which nothing is judged, J."""
        self._rounding = rounding
        self._largest = dict.fromkeys(LASTING, 0.0)
        self._energy = 0.0
        self.worst: dict[str, Made] = {}
        """By the name of the line, of those that have made any."""

    def keep(self) -> tuple[dict[str, float], float, dict[str, tuple[float, float]]]:
        """All of it."""
        return self._largest, self._energy, {name: (made.share, made.t) for name, made in self.worst.items()}

    def resume(self, known: tuple[dict[str, float], float, dict[str, tuple[float, float]]]) -> None:
        """Takes it back."""
        self._largest, self._energy, worst = known
        self.worst = {name: Made(*made) for name, made in worst.items()}

    def look(self, energy: Energy, largest: float, t: float, heat: float = 0.0) -> None:
        """Takes the lines of time ``t``, s; ``largest``: of what has come in, work of the stress and motion now, J;
        ``heat``: of what has eroded and has a pressure that sees heat, J.
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
        """The lines that have made any, the worst first."""
        return sorted(self.worst.items(), key=lambda item: (-item[1].share, item[0]))

    def require(self, limit: float, safety: float, when: str) -> None:
        """Raises EnergyError where a line has made more than ``limit``, run.made_limit; ``safety``: of the step."""
        for name, made in self.ranked()[:1]:
            if made.share > limit:
                text = f"the line {name} of the energy has made {made.share:.3g} of the largest energy"
                raise EnergyError(f"{text}, above run.made_limit {limit:g}, {when}{_cure(name, made.share, safety)}")

    def warnings(self, safety: float) -> list[str]:
        """A line for each that has made more than TOLD."""
        return [
            f"the line {name} of the energy has made {made.share:.2g} of the largest energy by {made.t:.3g} s"
            f"{_cure(name, made.share, safety)}"
            for name, made in self.ranked()
            if made.share > TOLD
        ]


def _cure(name: str, share: float, safety: float) -> str:
    """What helps, as far as it is derived and measured (docs/theory/energy.md, Energy that a line makes)."""
    if name == STEPPING:
        wanted = safety * math.sqrt(0.5 * TOLD / share)
        return f"; it falls with the square of the step: numerics.dt_safety = {wanted:.2g} would leave half a per cent"
    if name == "averaging":
        return "; with numerics.pressure = 'standard' there is none, but tets lock where they flow"
    return ""
