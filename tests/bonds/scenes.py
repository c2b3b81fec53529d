"""Two blocks with non-matching meshes, bonded at z = 0, and the energy balance of a run."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from conoid.cases import load
from conoid.cases.messages import Energy
from conoid.worker import simulation, step
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

START = """
name = "bonded"
[materials.steel]
density = 7850
elastic = {{ young = 200e9, poisson = {poisson} }}
[numerics]
pressure = "standard"
[run]
end_time = {end}
frames = 0
"""
BOND = """
[[bond]]
parts = ["below", "above"]
kind = "tied"
"""
SYMMETRY = "".join(f'\n[[boundaries]]\nkind = "symmetry"\naxis = "{axis}"\n' for axis in "xy")
EVERYWHERE = "low = [-1, -1, {low}]\nhigh = [1, 1, {high}]\n"


def start(end: float, poisson: float = 0.0) -> str:
    """Returns the material steel, and the end time of the run, s."""
    return START.format(end=end, poisson=poisson)


def block(
    name: str, low: tuple[float, float, float], high: tuple[float, float, float], size: float, more: str = ""
) -> str:
    """Returns a part of steel between two corners, mm, with tets of a ``size``, mm."""
    corners = [[1e-3 * c for c in corner] for corner in (low, high)]
    return f"""
[[parts]]
name = "{name}"
material = "steel"
{more}
[parts.mesh]
shape = "box"
low = {corners[0]}
high = {corners[1]}
generator = "structured"
element_size = {1e-3 * size}
"""


def moved(low: float, high: float, velocity: tuple[float, float, float], course: str = "") -> str:
    """Gives the nodes between two heights, m, a velocity, m/s."""
    x, y, z = velocity
    box = EVERYWHERE.format(low=low, high=high)
    return f'\n[[boundaries]]\nkind = "velocity"\n{box}x = {x}\ny = {y}\nz = {z}\n{course}\n'


def built(text: str) -> Simulation:
    """Returns the simulation before its first step, on one rank."""
    return simulation.build(load.parse_toml(text), Path(), SerialComm())


def run(sim: Simulation, each: Callable[[], None] | None = None) -> Energy:
    """Runs the case and returns the energy balance at the end; ``each`` is called in every step, at time n."""
    step.prepare(sim)
    while True:
        before: np.ndarray = sim.model.nodes.v.copy()
        step.first_half(sim)
        if each is not None:
            each()
        if sim.clock.done:
            return sim.ledger.close(before)
        step.second_half(sim)


def area(sim: Simulation) -> float:
    """Returns the area of the bonds, m^2."""
    assert sim.bonds is not None
    return float(sim.bonds.ties.rows.area.sum())
