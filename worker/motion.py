"""Kick (velocity update) and move (position update) of the nodes. Velocities and positions are changed in place."""

from .kernels.jit import njit, types
from .model.state import Nodes
from .parallel.arguments import Follow, reader
from .parallel.passes import Pass
from .parallel.team import TASK, Stage, Team

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
    """Kick (velocity update) and move (position update) of the nodes of a rank, on the threads of its ``team``."""

    def __init__(self, team: Team) -> None:
        self._kick, self._move = Pass(team, _kick, *_KICK), Pass(team, _move, *_MOVE)

    def kick(self, nodes: Nodes, impulse_quantum: float, shorter: float) -> None:
        """Computes v*(n+1/2) from v(n-1/2) and the force f(n). ``impulse_quantum``: mean of the two time steps divided
        by the force scale, N s. ``shorter``: (dt(n-1/2) - dt(n+1/2)) / 4 divided by the force scale. Adds to
        ``stepping``, J, the first part of the work of f(n) that is caused by unequal time steps.
        """
        self._kick.run(nodes.n, nodes.v, nodes.force, nodes.mass, nodes.stepping, impulse_quantum, shorter)

    def kicking(self, nodes: Nodes, impulse_quantum: Follow, shorter: Follow) -> Stage:
        """Returns the kernel of ``kick`` as a stage of a program (parallel/program.py)."""
        return self._kick.stage(nodes.n, nodes.v, nodes.force, nodes.mass, nodes.stepping, impulse_quantum, shorter)

    def move(self, nodes: Nodes, dt: float, shorter: float) -> None:
        """Computes x(n+1) from x(n) with the time step ``dt``, s. Adds to ``stepping`` , J, the second part of the work
        of f(n) that is caused by unequal time steps. Then sets the forces to zero.
        """
        self._move.run(nodes.n, nodes.x, nodes.v, nodes.force, nodes.stepping, dt, shorter)

    def moving(self, nodes: Nodes, dt: Follow, shorter: Follow) -> Stage:
        """Returns the kernel of ``move`` as a stage of a program (parallel/program.py)."""
        return self._move.stage(nodes.n, nodes.x, nodes.v, nodes.force, nodes.stepping, dt, shorter)
