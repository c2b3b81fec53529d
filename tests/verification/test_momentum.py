"""V14: linear and angular momentum of a free body are conserved, for all materials and pressure forms."""

import math

import numpy as np
import pytest

from conoid.cases.model import materials
from conoid.worker.simulation import Simulation

from ..worker.kernels import COPPER, COPPER_GAS, FORMS, STEEL, STEEL_42CRMO4, Form, build, run, scene
from ..worker.meshes import Floats, block

METALS = {"elastic": STEEL, "plastic": COPPER, "hot": STEEL_42CRMO4, "gas": COPPER_GAS}
MESH = block((4, 4, 4), 2.5e-3, shake=0.2, seed=8)
STEPS = 1500


def exact(values: Floats) -> Floats:
    """Returns (3,) the sums of the columns, correctly rounded."""
    return np.array([math.fsum(column) for column in values.T])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("metal", METALS)
def test_a_spinning_bursting_body_keeps_its_momentum(metal: str, form: Form) -> None:
    """The body moves, spins and starts with large random velocities; the forces add up to zero as integers in every
    step. The leapfrog scheme conserves x(n) x m v(n+1/2): a velocity has no moment about its own displacement, and
    forces of a symmetric stress have no moment.
    """
    material: materials.Material = METALS[metal]
    spin = {"centre": (5e-3, 5e-3, 5e-3), "rate": (3e3, 0.0, 1e4)}
    sim = build(scene(material, form, end=1.0, velocity=(120.0, -50.0, 7.0), spin=spin, viscosity={}), [MESH])
    nodes = sim.model.nodes
    nodes.v += np.random.default_rng(9).normal(size=nodes.v.shape) * 30.0
    centre = np.array([5e-3, 5e-3, 5e-3])

    def momenta() -> tuple[Floats, Floats]:
        p = nodes.mass[:, None] * nodes.v
        return exact(p), exact(np.cross(nodes.x - centre - flown, p))

    def look(sim: Simulation, before: Floats) -> None:
        assert (nodes.force.sum(axis=0) == 0).all()

    flown = np.zeros(3)
    linear, angular = momenta()
    run(sim, look, STEPS)
    flown = linear / nodes.mass.sum() * sim.clock.t
    assert sim.clock.step == STEPS
    end_linear, end_angular = momenta()
    assert np.abs(end_linear - linear).max() < 1e-12 * np.abs(linear).max()
    assert np.abs(end_angular - angular).max() < 1e-10 * np.abs(angular).max()
    assert np.abs(nodes.force).max() > 2**40
