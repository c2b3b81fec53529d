"""First places of the rows in the scratch memory of a thread. A row has CHUNK float64 numbers.

Each pass and each law uses the rows from NODAL to MOVED for its own values. The second pass of the averaged pressure
forms uses the four rows from CORNER_CHANGE on.
"""

from ..model.state import CHUNK

EDGE = 0
"""Nine rows: edges e1, e2, e3, m; after the gradients are computed, area vectors b1, b2, b3 at the end of the step, m^2
(tet4.py)."""
RATE = 9 * CHUNK
"""Nine rows: velocity differences, m/s; after the rates are computed, rate of deformation D, and SPIN."""
D_XX, D_YY, D_ZZ, D_YZ, D_ZX, D_XY = (RATE + k * CHUNK for k in range(6))
SPIN = RATE + 6 * CHUNK
"""3 rows: axial vector of dt/2 times the spin."""
VOLUME_MID = 18 * CHUNK
"""Volume at mid-step, m^3."""
DILATATION = 19 * CHUNK
"""Trace of the rate of deformation, 1/s."""
VOLUME = 20 * CHUNK
"""Volume at the end of the step, m^3."""
AREAS = 21 * CHUNK
"""Sum of |b|^2 of the four nodes, m^4."""
MODULUS = 22 * CHUNK
"""Density times the square of the wave speed, Pa."""
LIMIT = 23 * CHUNK
"""Reciprocal of the largest stable step, 1/s."""
TRIAL = 24 * CHUNK
"""Von Mises equivalent of the trial stress, Pa."""
SEEN = 25 * CHUNK
"""Volume strain of the step from which the pressure is computed. The strain is that of the tet, or the mean over its
nodes."""
CHANGE = 26 * CHUNK
"""Change of the volume of the tet in the step, m^3."""
NODAL = 27 * CHUNK
CORNER_CHANGE = 36 * CHUNK
"""4 rows: change of the volume ratio at each corner."""
MOVED = 40 * CHUNK
"""9 rows: displacements of nodes 1, 2, 3 less the displacement of node 0, m."""
SPEED = 49 * CHUNK
"""Rate of change of the volume divided by the volume, 1/s."""
VOLUME_SEEN = 50 * CHUNK
"""Volume from which the pressure is computed, m^3."""
CHANGE_SEEN = 51 * CHUNK
"""Change of VOLUME_SEEN in the step, m^3."""
BEFORE = 52 * CHUNK
"""Pressure before the step, Pa."""
SCRATCH = 53 * CHUNK
"""Number of float64 in the scratch memory of a thread."""
