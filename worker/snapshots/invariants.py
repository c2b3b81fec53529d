"""Stress invariants for pictures: von Mises stress, pressure, largest principal stress."""

import numpy as np

from ..model.state import Floats


def of(rows: "np.ndarray") -> dict[str, Floats]:
    """Return a dictionary from the name of each invariant to an array (n,), Pa. ``rows`` (7, n): deviatoric stress in
    the order xx, yy, zz, yz, zx, xy, and the pressure.

    The largest principal stress is 2 sqrt(J2/3) cos(a) - p with cos(3a) = (J3/2) (3/J2)^(3/2), 0 <= a <= pi/3 (Malvern
    1969, Introduction to the mechanics of a continuous medium, 3.3).
    """
    xx, yy, zz, yz, zx, xy, pressure = np.where(np.isfinite(rows), rows, 0.0).astype(np.float64)
    second = 0.5 * (xx * xx + yy * yy + zz * zz) + yz * yz + zx * zx + xy * xy
    third = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    radius = np.sqrt(second / 3.0)
    share = np.divide(third, 2.0 * radius**3, out=np.ones_like(third), where=radius > 0.0)
    angle = np.arccos(np.clip(share, -1.0, 1.0)) / 3.0
    largest = 2.0 * radius * np.cos(angle) - pressure
    return {"mises": np.sqrt(3.0 * second), "pressure": pressure, "principal_stress": largest}
