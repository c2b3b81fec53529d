"""V21: the contact patch test. Blocks whose meshes do not match transmit a uniform pressure through their interface.
Contacts of nodes with faces from both sides do not pass the patch test exactly. If nodes of one mesh lie between nodes
of the other mesh, impulses act on whole nodes and not on the areas round the nodes. The limit of the test is an error
of 5 % of the pressure in the worst tet.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from conoid.cases import load
from conoid.worker import simulation
from conoid.worker.model.rows import PRESSURE, S_ZZ
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..worker import formulas
from ..worker.kernels import run
from ..worker.meshes import Floats

SIDE, YOUNG, SPEED, END = 20e-3, 1e6, 0.04, 40e-3
SCENE = """
name = "patch"
[materials.soft]
density = 1000
elastic.young = 1e6
elastic.poisson = POISSON
[numerics]
pressure = "standard"
viscosity = { linear = 1.0 }
[run]
end_time = 40e-3
frames = 0
[[boundaries]]
kind = "velocity"
parts = ["upper"]
low = [-1, -1, 39.9e-3]
high = [1, 1, 1]
z = -0.04
"""
PLANE = """
[[boundaries]]
kind = "symmetry"
axis = "AXIS"
"""
BLOCK = """
[[parts]]
name = "NAME"
material = "soft"
[parts.mesh]
shape = "box"
generator = "structured"
low = [0, 0, LOW]
high = [20e-3, 20e-3, HIGH]
element_size = SIZE
"""


def pressed(poisson: float, sizes: tuple[float, float]) -> Simulation:
    """Returns two blocks at the end of a slow compression, so that the pressure is uniform."""
    text = SCENE.replace("POISSON", str(poisson)) + "".join(PLANE.replace("AXIS", axis) for axis in "xyz")
    for k, (name, size) in enumerate(zip(("lower", "upper"), sizes, strict=True)):
        block = BLOCK.replace("NAME", name).replace("SIZE", str(size))
        text += block.replace("LOW", str(k * SIDE)).replace("HIGH", str((k + 1) * SIDE))
    return run(simulation.build(load.parse_toml(text), Path(), SerialComm()))


def stress(sim: Simulation, part: str) -> tuple[Floats, "np.ndarray"]:
    """Returns (tets,) the stress normal to the interface, Pa, and flags of the tets that have a node on the
    interface.
    """
    blocks = [block for block in sim.model.blocks if sim.model.parts[block.part] == part]
    values = np.concatenate([block.row(S_ZZ) - block.row(PRESSURE) for block in blocks])
    z = sim.model.nodes.x0[np.concatenate([block.tets for block in blocks]), 2]
    return values, (np.abs(z - SIDE) < 1e-9).any(axis=1)


def under_pressure(poisson: float, stretch: float) -> float:
    """Returns the stress of a free bar of the given length over its initial length, Pa: sides without stress, p = -K ln
    J."""
    bulk, shear = YOUNG / (3.0 * (1.0 - 2.0 * poisson)), YOUNG / (2.0 * (1.0 + poisson))

    def sides(width: float) -> Floats:
        F = np.diag([width, width, stretch])
        stress: Floats = np.diag(formulas.hyperelastic(F[None], shear)[0][0]) + bulk * np.log(np.linalg.det(F))
        return stress

    width = brentq(lambda width: float(sides(width)[0]), 0.9, 1.1, xtol=1e-14)
    return float(sides(width)[2])


@pytest.mark.parametrize(("poisson", "sizes"), [(0.0, (5e-3, 3e-3)), (0.3, (5e-3, 4e-3))])
def test_a_uniform_pressure_passes_an_interface_of_two_meshes(poisson: float, sizes: tuple[float, float]) -> None:
    sim = pressed(poisson, sizes)
    expected = under_pressure(poisson, 1.0 - SPEED * END / (2.0 * SIDE))
    for part in ("lower", "upper"):
        values, touching = stress(sim, part)
        assert touching.any()
        assert values.mean() == pytest.approx(expected, rel=0.02)
        error = np.abs(values / values.mean() - 1.0)
        assert error[touching].max() < 0.05
        assert error[~touching].max() < 0.05
        assert np.sqrt((error[touching] ** 2).mean()) < 0.02
