"""The energy ledger (energy balance). Every energy is in exactly one term, and the residual shows the error of the sum
of all terms.

The kinetic energy has the form that the leapfrog step conserves together with the trapezoidal work of the forces. For
equal steps the kinetic energy is 1/2 m v(n-1/2) . v(n+1/2). For the steps dt- before n and dt+ after n, at the end of
the first of them, the form is 1/2 m v(n-1/2) . v(n+1/2) + 1/4 (dt- - dt+) v(n-1/2) . f(n). At the start of the second
step the form is smaller by 1/4 (dt- - dt+) f(n) . (v(n-1/2) - v(n+1/2)). The energy that unequal time steps create is
an error of the method. The energy created by unequal steps is added to ``stepping``, for each node
(docs/theory/time_integration.md, Time integration). The work of the stress is computed for each tet from stress and
strain rate, not from nodal forces, so the residual compares two independent computations.
"""

from typing import Any

import numpy as np

from conoid.cases.messages import Energy, PartEnergy
from conoid.cases.model.schema import Run

from ..errors import EnergyError
from ..model.state import Floats
from .making import WARNED, Making
from .sums import Sums, Totals


class Ledger:
    """The terms of the energy ledger, summed over all ranks. All ranks have equal values.

    The constructor computes the initial energy. Collective.
    """

    def __init__(self, sums: Sums, parts: list[str]) -> None:
        """``parts``: names of the parts."""
        self._sums, self._names = sums, parts
        self.initial = sums.kinetic()
        self.worst = 0.0
        """Largest residual of the energy ledger so far."""
        self.making = Making(sums.rounding())
        """Energy that each term of the ledger has created."""
        self.lost = 0.0
        """Energy lost to contact (including friction) at the last call, divided by the initial energy."""
        self.residual = 0.0
        """Residual at the last call: sum of all terms minus the initial energy and the external work, divided by the
        largest energy. The largest energy is the maximum of the energy received so far, the work of the stress and the
        kinetic energy."""
        self.beyond = 0.0
        """Kinetic energy minus all received energy at the last call, divided by the largest energy (see ``residual``).
        If the difference is positive, the sum of all other terms of the ledger is negative."""
        self.unpaid = 0.0
        """Largest decrease of the energy lost to fracture so far, divided by the energy that all broken facets absorb.
        A decrease means that facets released more energy than they had absorbed."""
        self._taken = 0.0
        """Largest value so far of the energy lost to fracture, J."""
        self.came = self.initial
        """Largest value so far of the energy received, J."""
        self.momentum = np.zeros(3)
        """Linear momentum at the last call, kg m/s, including removed nodes."""
        self.angular_momentum = np.zeros(3)
        """Angular momentum about the origin at the last call, kg m^2/s, including removed nodes."""
        self.eroded_mass = 0.0
        """Mass of removed nodes at the last call, kg."""
        self.parts: dict[str, PartEnergy] = {}
        """Energies of each part at the last call; empty if the case has one part."""

    def keep(self) -> tuple[Any, ...]:
        """Return the state of the ledger for a checkpoint. All ranks return equal values."""
        largest = self.initial, self.came, self.worst, self.lost, self._taken, self.unpaid
        return largest, self.momentum, self.angular_momentum, self.eroded_mass, self.making.keep()

    def resume(self, known: tuple[Any, ...]) -> None:
        """Restore the state of the ledger from the array of ``keep``."""
        largest, self.momentum, self.angular_momentum, self.eroded_mass, made = known
        self.making.resume(made)
        self.initial, self.came, self.worst, self.lost, self._taken, self.unpaid = largest

    def close(self, before: Floats) -> Energy:
        """Return the ledger at time n. Collective. ``before`` is v(n-1/2) (nodes, 3); the model has v(n+1/2)."""
        sums = self._sums.take(before)
        self._set(sums)
        kinetic, loss, external, stepping = (float(sums.nodal[k]) for k in (0, 1, 2, 6))
        work, viscous, plastic, averaged = sums.works
        gone_work, gone_viscous, gone_plastic, gone_averaged, gone_heat = sums.eroded.works.tolist()
        eroded = gone_work - gone_plastic - gone_averaged + sums.eroded.kinetic
        plastic_sum, viscous_sum = float(plastic) + gone_plastic, float(viscous) + gone_viscous
        elastic, averaging = float(work - plastic - averaged), float(averaged) + gone_averaged
        fracture, cohesive, _ = sums.facets
        fracture += sum(sums.bonds)
        inside = elastic + plastic_sum + viscous_sum + averaging
        total = kinetic + inside + loss + eroded + fracture + cohesive + stepping
        scale = self._judge(total, kinetic, external, abs(float(work)))
        closed = Energy(
            kinetic=kinetic, elastic=elastic, plastic=plastic_sum, viscous=viscous_sum, averaging=averaging,
            contact=loss - sums.friction, friction=sums.friction, eroded=eroded, fracture=fracture, cohesive=cohesive,
            stepping=stepping, external=external, initial=self.initial, residual=self.residual,
        )  # fmt: skip
        self.making.look(closed, scale, sums.t, gone_heat)
        return closed

    def _set(self, sums: Totals) -> None:
        """Set the momenta, masses and ratios at time n."""
        self.parts = _named(self._names, sums.kinetic, sums.internal)
        self.eroded_mass = sums.eroded.mass
        self.momentum = sums.nodal[3:6] + sums.eroded.momenta[:3]
        self.angular_momentum = sums.nodal[7:] + sums.eroded.momenta[3:]
        self.lost = float(sums.nodal[1]) / self.initial if self.initial > 0.0 else 0.0
        lost, _, whole = sums.facets
        self._taken = max(self._taken, lost)
        self.unpaid = max(self.unpaid, (self._taken - lost) / whole if whole > 0.0 else 0.0)

    def _judge(self, total: float, kinetic: float, external: float, work: float) -> float:
        """Set the residual and return the largest energy, J.

        ``total``: sum of the terms of the ledger, J; ``work``: work of the stress, J.
        """
        self.came = max(self.came, abs(external))
        scale = max(self.came, work, kinetic)
        left = abs(total - self.initial - external)
        self.residual = left / scale if scale != 0.0 else left
        self.beyond = max(kinetic - self.initial - external, 0.0) / scale if scale != 0.0 else 0.0
        self.worst = max(self.worst, self.residual)
        return scale

    def warnings(self, safety: float) -> list[str]:
        """Return the warnings about the ledger so far; ``safety``: numerics.dt_safety."""
        found = [
            (self.worst, "the energy ledger has a residual of up to {:.2g} of the largest energy"),
            (self.unpaid, "facets that closed have released {:.2g} of the energy that all broken facets absorb, more "
             "than they had absorbed"),
        ]  # fmt: skip
        compare = f"compare with numerics.dt_safety = {0.5 * safety:.2g}"
        residuals = [f"{text.format(share)}; {compare}" for share, text in found if share > WARNED]
        return residuals + self.making.warnings(safety)

    def require(self, run: Run, safety: float, when: str) -> None:
        """Raise EnergyError if a limit of ``run`` is exceeded.

        The residual of the last call is compared with run.residual_limit. The energy that a term has created so far is
        compared with run.made_limit in each call. ``safety``: numerics.dt_safety.
        """
        limit = run.residual_limit
        for what, share in (
            ("the kinetic energy exceeds all received energy by", self.beyond),
            ("the energy residual is", self.residual),
        ):
            if not share <= limit:
                raise EnergyError(
                    f"{what} {share:.3g} of the largest energy, above run.residual_limit {limit:g}, {when}"
                )
        self.making.require(run.made_limit, safety, when)


def _named(parts: list[str], kinetic: Floats, internal: Floats) -> dict[str, PartEnergy]:
    """Return the energies of each part; an empty result if the case has one part only."""
    rows = zip(parts, kinetic.tolist(), internal.tolist(), strict=True)
    return {part: PartEnergy(kinetic=k, internal=i) for part, k, i in rows} if len(parts) > 1 else {}
