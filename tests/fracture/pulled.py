"""A bar of two bonded parts that is pulled apart."""

from typing import Any

from ..worker.joints import bar

AREA = 9e-6
"""Area of the interface, m^2."""
WHOLE, PARTS = bar((3, 3, 6), 1e-3, 3e-3, 0.1)
BOND = {"strength": "20 MPa", "shear_strength": "30 MPa", "energy": "10 J/m^2", "shear_energy": "25 J/m^2"}


def drawn(x: str, z: str) -> list[dict[str, Any]]:
    """Returns a scene in which the lower end is fixed and the upper end is driven, without motion along y."""
    below, above = [-1, -1, "0.1 mm"], [-1, -1, "5.9 mm"]
    return [
        {"kind": "velocity", "x": 0, "z": 0, "low": [-1, -1, -1], "high": [1, 1, below[2]]},
        {"kind": "velocity", "x": x, "z": z, "low": above, "high": [1, 1, 1]},
    ]
