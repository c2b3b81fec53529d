"""Rows with data of the corners of narrow sides, for loops that the compiler vectorizes (corner_contact.py)."""

from ...kernels.jit import njit, types
from ..geometry import VECTOR, cross, dot
from ..surface.sharp import SHARP

_BENT = 1.0 - SHARP * SHARP
"""Square of the sine of the largest angle between two neighbouring faces of a smooth surface, which is the limit for
sharp edges (surface/sharp.py)."""
MANY = 64
"""Number of corners in one block of rows. A block has 10 kB and fits into the first-level cache."""
WORD = 8
"""Number of flags in a word, which is the number of float64 in the longest vector register."""
CORNER, TO_F, TO_G, INWARD = (MANY * row for row in (0, 3, 6, 9))
"""First rows of three vectors and of one position, with three components each. The vectors are those from the corner to
the other two nodes of the side, clockwise seen from outside, and the inward normal of the side. The position is that of
the corner."""
SQUARE, FF, GG, FG, TWIN = (MANY * row for row in (12, 13, 14, 15, 16))
"""Rows of numbers: the square of the normal, the dot products of the two edges, and the index of the corner's twin
among the members of the family."""
ROWS = 17
"""Number of rows of a block."""
_I, _F, _F1 = types.int64, types.float64, types.float64[::1]


@njit(f"{VECTOR}(float64[::1], int64, int64)", cache=True, forceinline=True)
def vector(w, row, i):  # type: ignore[no-untyped-def]
    """Returns the vector of corner ``i``."""
    return w[row + i], w[row + MANY + i], w[row + 2 * MANY + i]


@njit(f"void(float64[::1], int64, int64, {VECTOR})", cache=True, forceinline=True)
def set_vector(w, row, i, a):  # type: ignore[no-untyped-def]
    """Sets the vector of corner ``i`` to ``a``."""
    w[row + i], w[row + MANY + i], w[row + 2 * MANY + i] = a


@njit(types.void(_F1, _I), cache=True, error_model="numpy")
def measure(w, n):  # type: ignore[no-untyped-def]
    """Computes the edges, normals and dot products of the first ``n`` corners. Before the call, the rows of the edges
    have the positions of their ends."""
    for row in (TO_F, TO_G):
        to, o = w[row:], w[CORNER:]
        for i in range(n):
            to[i] -= o[i]
            to[MANY + i] -= o[MANY + i]
            to[2 * MANY + i] -= o[2 * MANY + i]
    for i in range(n):
        f = w[TO_F + i], w[TO_F + MANY + i], w[TO_F + 2 * MANY + i]
        g = w[TO_G + i], w[TO_G + MANY + i], w[TO_G + 2 * MANY + i]
        m = cross(f, g)
        w[INWARD + i], w[INWARD + MANY + i], w[INWARD + 2 * MANY + i] = m
        w[SQUARE + i], w[FF + i], w[GG + i], w[FG + i] = dot(m, m), dot(f, f), dot(g, g), dot(f, g)


@njit(types.void(types.uint8[::1], _F1, _I, _I, _F, _F, _F), cache=True, error_model="numpy")
def under(flags, w, n, member, x, y, z):  # type: ignore[no-untyped-def]
    """Sets a flag for each of the first ``n`` corners whose side is above the ``member`` at x, y, z and contains its
    foot.

    A foot beyond an edge still counts if a neighbouring face could contain it, at an angle below that of a sharp edge.
    A foot on the far side of the corner does not count.
    """
    for i in range(n):
        r = x - w[CORNER + i], y - w[CORNER + MANY + i], z - w[CORNER + 2 * MANY + i]
        along_f = dot((w[TO_F + i], w[TO_F + MANY + i], w[TO_F + 2 * MANY + i]), r)
        along_g = dot((w[TO_G + i], w[TO_G + MANY + i], w[TO_G + 2 * MANY + i]), r)
        below = dot((w[INWARD + i], w[INWARD + MANY + i], w[INWARD + 2 * MANY + i]), r)
        of_f, of_g = w[GG + i] * along_f - w[FG + i] * along_g, w[FF + i] * along_g - w[FG + i] * along_f
        beyond = _BENT * dot(r, r) * w[SQUARE + i]
        flags[i] = (
            (below > 0.0)
            & (w[TWIN + i] != member)
            & (of_f + of_g <= w[SQUARE + i])
            & ((of_f >= 0.0) | ((along_g > 0.0) & (of_f * of_f <= beyond * w[GG + i])))
            & ((of_g >= 0.0) | ((along_f > 0.0) & (of_g * of_g <= beyond * w[FF + i])))
        )
