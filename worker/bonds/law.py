"""Law of a bond that may break. The traction has the normal part t_n and the shear part t_s. An ellipse that shrinks
with the opening delta limits the traction. The strengths s_n and s_s are the axes of the ellipse at the start; D is the
damage.

    (<t_n> / s_n)^2 + (|t_s| / s_s)^2 <= (1 - D)^2,   dD = d(delta) / delta_c,   delta_c = 2 G / |T|,

Here T is the traction on the initial ellipse in the present direction. G is the fracture energy per area: 1 / G = (1 -
B) / G_n + B / G_s, where B is the fraction of the work that is done in shear, and G_n and G_s are the fracture energies
in tension and shear. The traction therefore decreases linearly with the opening delta, and opening in one direction
dissipates the energy G. Below the strength the bond does not open. An open bond closes without resistance, and
transmits pressure when it is closed. The bond transmits tension again when it reaches its widest opening. Therefore an
open bond stores no energy. Sliding is permanent.
"""

import numpy as np

from ..contact.geometry import at, cross, dot, minus
from ..kernels.jit import njit, types
from .records import (
    BREAKS,
    DAMAGE,
    ENERGY,
    LAST,
    NORMAL,
    OPENING,
    PUSH,
    ROWS,
    SHEAR_ENERGY,
    SHEAR_STRENGTH,
    SPEED,
    STRENGTH,
    WIDEST,
)
from .records import NODES as _NODES

_FULL = 1.0 - 1e-6
"""Ratio of a traction to the size of the ellipse. A traction with a larger ratio opens the bond."""
_F, _I = types.float64, types.int64
_VECTOR = types.UniTuple(_F, 3)  # type: ignore[no-untyped-call]


@njit(_VECTOR(_VECTOR, _VECTOR, _VECTOR, _F, _F, _F, _F, _F, _F, _F), cache=True, error_model="numpy")
def project(push, speed, out, closed, play, step, normal_limit, shear_limit, dt, stiff):  # type: ignore[no-untyped-def]
    """Returns a new impulse of a tied row. The impulse is ``push`` minus ``step``, kg, times the relative velocity
    ``speed``, and is then projected onto the ellipse of the largest impulses across and along the interface. ``out``:
    outward normal of the tied side.

    ``closed``: distance by which the bond may close without resistance, m; ``play``: distance by which it may open
    without resistance, m; ``dt``: time step, s; ``stiff``: remaining fraction of the strength.
    """
    along, opening = dot(push, out), -dot(speed, out)
    x = push[0] - along * out[0] - step * (speed[0] + opening * out[0])
    y = push[1] - along * out[1] - step * (speed[1] + opening * out[1])
    z = push[2] - along * out[2] - step * (speed[2] + opening * out[2])
    pulled, pressed = along + step * (opening - play / dt), along + step * (opening + closed / dt)
    along = pulled if pulled > 0.0 else min(pressed, 0.0)
    size = (max(along, 0.0) / normal_limit) ** 2 + (x * x + y * y + z * z) / shear_limit**2
    factor = stiff / np.sqrt(size) if size > stiff * stiff else 1.0
    along = factor * along if along > 0.0 else along
    return along * out[0] + factor * x, along * out[1] + factor * y, along * out[2] + factor * z


@njit(_VECTOR(ROWS, _NODES, _I), cache=True, error_model="numpy")
def normal(rows, nodes, r):  # type: ignore[no-untyped-def]
    """Returns the mean normal of the tied faces at the node of the tied row ``r``."""
    x, face = nodes.x, rows.face
    p, q, w = 0.0, 0.0, 0.0
    for s in range(rows.side[r], rows.side[r + 1]):
        o = at(x, face[s, 0])
        n = cross(minus(at(x, face[s, 1]), o), minus(at(x, face[s, 2]), o))
        p, q, w = p + n[0], q + n[1], w + n[2]
    length = np.sqrt(p * p + q * q + w * w)
    return p / length, q / length, w / length


@njit(_I(ROWS, _NODES, _F, _F, _I, _I), cache=True, error_model="numpy")
def open_bonds(rows, nodes, mean_dt, dt, first, stop):  # type: ignore[no-untyped-def]
    """Opens the tied rows from ``first`` to ``stop`` whose traction is at its limit. Returns the number of tied rows
    that have failed.

    ``mean_dt``: time for which the impulses act, s; ``dt``: time step, s.

    1. Relative velocity at the end of the step, stored for the next one.
    2. Tension and shear of the impulse, opening velocity, power.
    3. Damage, if the impulse is at the ellipse: at once without fracture energy, else in proportion to the opening.
    4. Present and largest opening of a damaged row.
    5. A failed row has no impulse.
    """
    v, state, laws, apart = nodes.v, rows.state, rows.laws, 0
    for r in range(first, stop):
        if state[r, DAMAGE] >= 1.0:
            continue
        # 1. Compute the relative velocity of the tied row at the end of the step.
        for i in range(3):
            speed = v[rows.node[r], i]
            for e in range(rows.begin[r], rows.begin[r + 1]):
                speed -= rows.weight[e] * v[rows.master[e], i]
            state[r, SPEED + i] = speed
            state[r, LAST + i] = state[r, PUSH + i]
        b = rows.bond[r]
        if laws[b, BREAKS] == 0.0:
            continue
        # 2. Compute tension and shear, opening velocity and power.
        along, opening, work, shear = 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            along += state[r, PUSH + i] * state[r, NORMAL + i]
            opening -= state[r, SPEED + i] * state[r, NORMAL + i]
        for i in range(3):
            slide = state[r, PUSH + i] - along * state[r, NORMAL + i]
            shear += slide * slide
            work -= slide * state[r, SPEED + i]
        across = max(along, 0.0)
        work += across * opening
        # 3. Update the damage, if the impulse is on the ellipse.
        force, tension = mean_dt * rows.area[r], across * across
        size = np.sqrt(tension / (force * laws[b, STRENGTH]) ** 2 + shear / (force * laws[b, SHEAR_STRENGTH]) ** 2)
        full = size > 0.0 and size >= _FULL * (1.0 - state[r, DAMAGE])
        if full and laws[b, ENERGY] == 0.0:
            state[r, DAMAGE] = 1.0
        elif full:
            mixed = shear / (tension + shear)
            energy = 1.0 / ((1.0 - mixed) / laws[b, ENERGY] + mixed / laws[b, SHEAR_ENERGY])
            length = np.sqrt(tension + shear)
            critical = 2.0 * energy * size * force / length
            state[r, DAMAGE] = min(state[r, DAMAGE] + max(dt * work / length, 0.0) / critical, 1.0)
        # 4. Update the present and the largest opening of a damaged row.
        if state[r, DAMAGE] > 0.0:
            state[r, OPENING] = max(state[r, OPENING] + dt * opening, 0.0)
            state[r, WIDEST] = max(state[r, WIDEST], state[r, OPENING])
        # 5. Set the impulse of a failed row to zero.
        if state[r, DAMAGE] >= 1.0:
            apart += 1
            for i in range(3):
                state[r, PUSH + i] = state[r, LAST + i] = 0.0
    return apart
