"""Energy account of the rigid bodies, and the values that they add to the sums of the energy balance."""

from typing import Any

import numpy as np

from ..model.state import Floats
from .bodies import Bodies, dot
from .stops import BodyStops

_KEPT = {
    "contact_loss": "contact_loss", "external_work": "external_work", "friction_loss": "friction_loss",
    "bond_loss": "bond_loss", "_later": "later", "_before": "before",
}  # fmt: skip
"""Names of the sums in a checkpoint, and names of the attributes that contain the sums."""


class BodyAccount:
    """Work done on the rigid bodies of a case. Half of the work of an impulse is computed with the velocity before the
    impulse, half with the velocity after it. All ranks have equal values.
    """

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        self.contact_loss, self.external_work, self.friction_loss, self.bond_loss = np.zeros((4, bodies.n))
        """(b,) four energies of each body, J: loss by impact and friction; external work; the part of the loss that is
        friction on walls; loss by tied bonds."""
        self.later = np.zeros((4, bodies.n))
        """(4, b) second halves of the four energies in the last step, J."""
        self.before = np.stack([bodies.speed, bodies.momentum])
        """(2, b, 3) velocity v(n-1/2), m/s, and angular momentum at n-1/2, kg m^2/s, of each body."""

    def keep(self) -> dict[str, Any]:
        """Returns the state of the account for a checkpoint."""
        return {name: getattr(self, attribute).copy() for name, attribute in _KEPT.items()}

    def resume(self, known: dict[str, Any]) -> None:
        """Restores the state of the account from a checkpoint."""
        for name, values in known.items():
            setattr(self, _KEPT[name], values.copy())

    def note(self) -> None:
        """Adds the second halves of the energies of the last step, and stores the motion at n-1/2; to be called before
        the kick.
        """
        self.contact_loss += self.later[0]
        self.external_work += self.later[1]
        self.friction_loss += self.later[2]
        self.bond_loss += self.later[3]
        self.later[:] = 0.0
        self.before[0], self.before[1] = self._bodies.speed, self._bodies.momentum

    def book(self, impulse: Floats, of_bonds: Floats, stops: BodyStops) -> None:
        """Adds half of the work of the impulses, computed with the velocities before the impulses. For the next step,
        stores the half of the work that is computed with the velocities after the impulses.

        ``impulse`` (b, 6): impulses of contact and walls; ``of_bonds`` (b, 6): impulses of tied bonds. The work of all
        other changes of the motion, and of driven walls, is external work.
        """
        bodies, rubbed, walls = self._bodies, stops.rubbed, stops.walls
        speed, momentum = self.before
        change = [bodies.mass[:, None] * (bodies.speed - speed), bodies.momentum - momentum]
        outside = np.concatenate(change, axis=1) - impulse - of_bonds
        halves = np.zeros((2, 4, bodies.n))
        times_n = (speed, momentum, walls.before), (bodies.speed, bodies.momentum, walls.speed)
        for k, (v, spin, of_walls) in enumerate(times_n):
            rate = bodies.rates(spin)
            parts = (impulse, -0.5), (outside, 0.5), (rubbed, -0.5), (of_bonds, -0.5)
            for m, (given, sign) in enumerate(parts):
                halves[k, m] = sign * (dot(given[:, :3], v) + dot(given[:, 3:], rate))
            for w in np.flatnonzero(~walls.plain).tolist():
                moved = 0.5 * dot(stops.of_walls[w], of_walls[w][None])
                halves[k, 0] += moved
                halves[k, 1] += moved if walls.lightness[w] == 0.0 else 0.0
                halves[k, 2] += 0.5 * dot(stops.rubbed_by[w], of_walls[w][None])
        self.contact_loss += halves[0, 0]
        self.external_work += halves[0, 1]
        self.friction_loss += halves[0, 2]
        self.bond_loss += halves[0, 3]
        self.later = halves[1]

    def kinetic(self) -> Floats:
        """(b,) kinetic energy at n, J, computed as the product of the velocities before and after n."""
        bodies, (speed, momentum) = self._bodies, self.before
        linear = bodies.mass * dot(speed, bodies.speed)
        return np.asarray(0.5 * (linear + dot(momentum, bodies.rates(bodies.momentum))))

    def quantity(self, body: int, field: str, axis: int, share: float) -> float:
        """Returns the kinetic energy of a body, J, or a component of ``momentum``, ``centre`` or ``centre_velocity``.
        The result contains only the fraction ``share`` of the change by the last impulses.
        """
        bodies, (speed, momentum) = self._bodies, self.before
        if field == "centre":
            return float(bodies.centre[body, axis])
        v = speed + share * (bodies.speed - speed)
        spin = momentum + share * (bodies.momentum - momentum)
        if field == "kinetic_energy":
            return float(0.5 * (bodies.mass * dot(v, v) + dot(spin, bodies.rates(spin)))[body])
        return float(v[body, axis] * (bodies.mass[body] if field == "momentum" else 1.0))

    def momenta(self) -> Floats:
        """(6,) momentum, kg m/s, and angular momentum about the origin, kg m^2/s, of all bodies at n."""
        bodies, (speed, momentum) = self._bodies, self.before
        p = 0.5 * bodies.mass[:, None] * (speed + bodies.speed)
        own = 0.5 * (momentum + bodies.momentum)
        x = bodies.centre
        about = own + np.stack([x[:, i] * p[:, j] - x[:, j] * p[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
        return np.concatenate([p.sum(axis=0), about.sum(axis=0)])
