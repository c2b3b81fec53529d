"""Nodes: forces to velocities, velocities to positions. Increments are added, positions never recomputed."""

from .kernels.jit import njit, types
from .model.state import Nodes
from .parallel.arguments import reader
from .parallel.passes import Pass
from .parallel.team import TASK, Team

_F, _F1, _F2 = types.float64, types.float64[::1], types.float64[:, ::1]
_KICK = _F2, types.int64[:, ::1], _F1, _F1, _F, _F
_MOVE = _F2, _F2, types.int64[:, ::1], _F1, _F, _F
_of_kick, _of_move = reader(*_KICK), reader(*_MOVE)


@njit(TASK, cache=True, error_model="numpy")
def _kick(table, begin, end, thread):  # type: ignore[no-untyped-def]
    v, force, mass, stepping, impulse_quantum, shorter = _of_kick(table)
    v, force, mass, stepping = v[begin:end], force[begin:end], mass[begin:end], stepping[begin:end]
    for i in range(len(mass)):
        factor, power = impulse_quantum / mass[i], 0.0
        for k in range(3):
            power += v[i, k] * force[i, k]
            v[i, k] += force[i, k] * factor
        stepping[i] += shorter * power


@njit(TASK, cache=True, error_model="numpy")
def _move(table, begin, end, thread):  # type: ignore[no-untyped-def]
    x, v, force, stepping, dt, shorter = _of_move(table)
    x, v, force, stepping = x[begin:end], v[begin:end], force[begin:end], stepping[begin:end]
    for i in range(len(x)):
        power = 0.0
        for k in range(3):
            x[i, k] += dt * v[i, k]
            power += v[i, k] * force[i, k]
            force[i, k] = 0
        stepping[i] -= shorter * power


class Leapfrog:
    """Moves the nodes of a rank, by the threads of its ``team``."""

    def __init__(self, team: Team) -> None:
        self._kick, self._move = Pass(team, _kick, *_KICK), Pass(team, _move, *_MOVE)

    def kick(self, nodes: Nodes, impulse_quantum: float, shorter: float) -> None:
        """v(n-1/2) to v*(n+1/2); ``impulse_quantum`` is the mean step over the force scale, N s; ``shorter``: a quarter
        of what the step ahead is shorter than the one behind, over the force scale, for the account ``stepping``, J.
        """
        self._kick.run(nodes.n, nodes.v, nodes.force, nodes.mass, nodes.stepping, impulse_quantum, shorter)

    def move(self, nodes: Nodes, dt: float, shorter: float) -> None:
        """x(n) to x(n+1), in a step ``dt``, s; ends the account that ``kick`` has begun, with the same f(n), and leaves
        no force.
        """
        self._move.run(nodes.n, nodes.x, nodes.v, nodes.force, nodes.stepping, dt, shorter)
