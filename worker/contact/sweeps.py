"""Impulses that keep meetings from passing: projected Jacobi sweeps whose order does not matter.

Every meeting asks for a normal velocity of at least ``wanted``. A sweep corrects each by its own want over a bound of
the l1 norm of its row of the contact matrix (Baker, Falgout, Kolev and Yang 2011): the sum over its nodes k and axes i
of |w_k| |n_i| S_ki / m_k, with S_ki the sum of |w| |n_i| over all meetings at the node. That is exact for one meeting
alone and for any number along one normal, and never an overshoot however many share a node. Impulses never pull;
friction is Coulomb's, on the sum over the sweeps. Impulses are integers: a meeting's add up to zero, and no order of
meetings or ranks changes a bit. Where there is friction, a pair of a node and a face begins with its impulses of the
step before, so that what sticks does not creep, however few the sweeps are.
"""

import numpy as np

from ..jit import njit

SHARES = float(2**30)
"""Quanta per unit of weight."""
_KEPT = 0.8
"""Share of the last push along the normal that a pair begins with: all of it would lag behind and make energy."""

_V2, _N2, _I2 = "float64[:, ::1]", "int32[:, ::1]", "int64[:, ::1]"


@njit(f"UniTuple(int32[::1], 2)({_N2}, boolean[::1], int64)", cache=True)
def parted(nodes, shared, n):  # type: ignore[no-untyped-def]
    """Which of ``n`` meetings have a node that is ``shared`` (nodes,) with another rank, and which have none."""
    border, inner = np.empty(n, np.int32), np.empty(n, np.int32)
    b, i = 0, 0
    for p in range(n):
        if shared[nodes[p, 0]] or shared[nodes[p, 1]] or shared[nodes[p, 2]] or shared[nodes[p, 3]]:
            border[b] = p
            b += 1
        else:
            inner[i] = p
            i += 1
    return border[:b], inner[:i]


@njit(f"void({_I2}, {_N2}, {_V2}, {_V2}, int32[::1])", cache=True)
def add_shares(shares, nodes, weights, normals, some):  # type: ignore[no-untyped-def]
    """Adds |w| |n_i| and |w| of ``some`` of the meetings to ``shares`` (nodes, 4), in quanta."""
    for p in some:
        for k in range(4):
            weight = abs(weights[p, k]) * SHARES
            for i in range(3):
                shares[nodes[p, k], i] += np.int64(np.rint(weight * abs(normals[p, i])))
            shares[nodes[p, k], 3] += np.int64(np.rint(weight))


@njit(f"void({_V2}, {_N2}, {_V2}, {_V2}, {_I2}, {_V2}, int64)", cache=True, error_model="numpy")
def mobilities(diagonal, nodes, weights, normals, shares, mobility, n):  # type: ignore[no-untyped-def]
    """(room, 2) bounds of the l1 norms of the rows along the normal and across, 1/kg; infinite where nothing moves."""
    for p in range(n):
        along, across = 0.0, 0.0
        for k in range(4):
            a = nodes[p, k]
            weight = abs(weights[p, k]) / SHARES
            most = 0.0
            for i in range(3):
                along += weight * abs(normals[p, i]) * shares[a, i] * mobility[a, i]
                most = max(most, mobility[a, i])
            across += weight * shares[a, 3] * most
        diagonal[p, 0] = along if along > 0.0 else np.inf
        diagonal[p, 1] = across if across > 0.0 else np.inf


@njit(f"void({_I2}, {_N2}, {_V2}, float64[::1], float64, int64)", cache=True)
def _add(impulse, nodes, weights, change, scale, p):  # type: ignore[no-untyped-def]
    """Gives ``change`` (3,), N s, of meeting p to its nodes; the shares add up to zero."""
    for i in range(3):
        rest = np.int64(0)
        for k in range(1, 4):
            part = np.int64(np.rint(weights[p, k] * change[i] * scale))
            impulse[nodes[p, k], i] += part
            rest += part
        impulse[nodes[p, 0], i] -= rest


@njit(
    f"void({_I2}, {_V2}, {_V2}, int32[::1], {_N2}, {_V2}, {_V2}, float64[::1], float64, float64, int32[::1])",
    cache=True,
)
def resume(impulse, push, kept, pair, nodes, weights, normals, friction, ratio, scale, some):  # type: ignore[no-untyped-def]
    """Pairs with friction, of ``some`` meetings, begin with ``ratio`` times what they have ``kept`` (candidates, 4),
    along and across the normal as it is now; others, and edges, from nothing.
    """
    change = np.empty(3)
    for p in some:
        if friction[p] == 0.0 or pair[p] < 0:
            continue
        along = 0.0
        for i in range(3):
            along += kept[pair[p], 1 + i] * normals[p, i]
        push[p, 0] = _KEPT * ratio * kept[pair[p], 0]
        for i in range(3):
            push[p, 1 + i] = ratio * (kept[pair[p], 1 + i] - along * normals[p, i])
            change[i] = push[p, 0] * normals[p, i] + push[p, 1 + i]
        _add(impulse, nodes, weights, change, scale, p)


@njit(
    f"void({_I2}, {_V2}, boolean[::1], boolean[::1], {_V2}, {_N2}, {_V2}, {_V2}, float64[::1], float64[::1], {_V2}, "
    "float64, int32[::1])",
    cache=True,
    error_model="numpy",
)
def sweep(  # type: ignore[no-untyped-def]
    impulse, push, settled, moved, v, nodes, weights, normals, wanted, friction, diagonal, scale, some,
):  # fmt: skip
    """Adds the corrections of ``some`` meetings to ``impulse`` (nodes, 3), in quanta of 1 / ``scale`` N s.

    ``push`` (room, 4) holds each meeting's sum over the sweeps so far: along the normal, and the friction vector, N s.
    A meeting that has changed nothing in its last sweep, ``settled`` (room,), would change nothing while none of its
    nodes has ``moved`` (nodes,) since: it is passed over, without a change of any bit.
    """
    rate, change = np.empty(3), np.empty(3)
    for p in some:
        if settled[p]:
            a, b, c, d = nodes[p, 0], nodes[p, 1], nodes[p, 2], nodes[p, 3]
            if not (moved[a] or moved[b] or moved[c] or moved[d]):
                continue
        speed = 0.0
        for i in range(3):
            rate[i] = 0.0
            for k in range(4):
                rate[i] += weights[p, k] * v[nodes[p, k], i]
            speed += normals[p, i] * rate[i]
        old = push[p, 0]
        push[p, 0] = max(0.0, old + (wanted[p] - speed) / diagonal[p, 0])
        settled[p] = push[p, 0] == old and (old == 0.0 or friction[p] == 0.0)
        if settled[p]:
            continue
        for i in range(3):
            change[i] = (push[p, 0] - old) * normals[p, i]
        if friction[p] > 0.0:
            size = 0.0
            for i in range(3):
                rate[i] = push[p, 1 + i] - (rate[i] - speed * normals[p, i]) / diagonal[p, 1]
                size += rate[i] * rate[i]
            most = friction[p] * push[p, 0]
            factor = most / np.sqrt(size) if size > most * most else 1.0
            for i in range(3):
                change[i] += factor * rate[i] - push[p, 1 + i]
                push[p, 1 + i] = factor * rate[i]
        _add(impulse, nodes, weights, change, scale, p)


@njit(f"void({_V2}, {_I2}, boolean[::1], {_I2}, {_V2}, float64)", cache=True)
def give(v, total, moved, impulse, mobility, scale):  # type: ignore[no-untyped-def]
    """Turns the completed impulses (nodes, 3) of a sweep into velocities, adds them to ``total`` and clears them; notes
    which nodes have ``moved`` (nodes,).
    """
    for a in range(len(v)):
        moved[a] = False
        for i in range(3):
            j = impulse[a, i]
            if j != 0:
                moved[a] = True
                v[a, i] += j * (mobility[a, i] / scale)
                total[a, i] += j
                impulse[a, i] = 0


@njit(
    f"void({_I2}, {_V2}, boolean[::1], boolean[::1], {_V2}, {_N2}, {_V2}, {_V2}, float64[::1], float64[::1], {_V2}, "
    f"float64, int32[::1], {_I2}, {_V2}, int64)",
    cache=True,
)
def sweep_all(  # type: ignore[no-untyped-def]
    impulse, push, settled, moved, v, nodes, weights, normals, wanted, friction, diagonal, scale, some, total,
    mobility, many,
):  # fmt: skip
    """``many`` sweeps (``sweep``, ``give``) of meetings of which no other rank shares a node."""
    for _ in range(many):
        sweep(
            impulse, push, settled, moved, v, nodes, weights, normals, wanted, friction, diagonal, scale, some
        )  # fmt: skip
        give(v, total, moved, impulse, mobility, scale)


@njit(f"{_V2}({_V2}, {_N2}, {_V2}, int64)", cache=True)
def rates(v, nodes, weights, n):  # type: ignore[no-untyped-def]
    """(n, 3) relative velocity at each meeting, m/s."""
    out = np.zeros((n, 3))
    for p in range(n):
        for k in range(4):
            for i in range(3):
                out[p, i] += weights[p, k] * v[nodes[p, k], i]
    return out


@njit(f"void(int64[::1], {_V2}, {_V2}, {_V2}, {_N2}, {_V2}, {_V2}, float64[::1], float64, int64)", cache=True)
def heat(words, push, slip, v, nodes, weights, normals, friction, joule, n):  # type: ignore[no-untyped-def]
    """Adds the work of friction, mean sliding velocity times impulse, to two limbs of quanta of 1 / ``joule`` J."""
    for p in range(n):
        if friction[p] > 0.0 and push[p, 0] > 0.0:
            work = 0.0
            for i in range(3):
                rate = slip[p, i]
                for k in range(4):
                    rate += weights[p, k] * v[nodes[p, k], i]
                work -= 0.5 * push[p, 1 + i] * rate
            high = np.rint(work * joule)
            words[0] += np.int64(high)
            words[1] += np.int64(np.rint((work * joule - high) * 2.0**30))


@njit(f"void({_I2}, {_V2}, {_V2}, {_V2}, {_N2}, {_V2}, {_V2}, float64, int64)", cache=True)
def cost(words, push, before, v, nodes, weights, normals, joule, n):  # type: ignore[no-untyped-def]
    """Adds what the impulses along the normals take from the bodies, and what they have given back by the middle of
    their work, to two limbs (rows of ``words``) of quanta of 1 / ``joule`` J.

    An impulse J between the speeds u(n-1/2), of ``before``, and u(n+1/2) takes -J (u(n-1/2) + u(n+1/2)) / 2; the ledger
    at time n has the first half of that.
    """
    value = np.empty(2)
    for p in range(n):
        if push[p, 0] > 0.0:
            early, late = 0.0, 0.0
            for k in range(4):
                for i in range(3):
                    share = weights[p, k] * normals[p, i]
                    early += share * before[nodes[p, k], i]
                    late += share * v[nodes[p, k], i]
            value[0] = -0.5 * push[p, 0] * (early + late)
            value[1] = 0.5 * push[p, 0] * early
            for m in range(2):
                high = np.rint(value[m] * joule)
                words[0, m] += np.int64(high)
                words[1, m] += np.int64(np.rint((value[m] * joule - high) * 2.0**30))
