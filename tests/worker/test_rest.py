"""Chunks at rest are omitted without any change of a bit, until a wave arrives, in each pressure form and with each
kind of law."""

import numpy as np
import pytest

from conoid.cases.model.materials import Material
from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.elements import rest
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import state
from conoid.worker.simulation import Simulation

from .kernels import COPPER_GAS, FORMS, GLASS, STEEL, STEEL_42CRMO4, Form, build, scene
from .meshes import block

MM = 1e-3
LAWS = {"elastic": STEEL, "gas": COPPER_GAS, "johnson_cook": STEEL_42CRMO4, "crumbling": GLASS}
STEPS = 14


def struck(material: Material, form: Form, skip: bool) -> tuple[Simulation, list[int]]:
    """Returns a bar whose lower end has been pushed, after some steps, and the number of chunks at rest after each
    step."""
    viscosity, mesh = {"linear": 0.06, "shock": 0.4, "quadratic": 1.5}, block((3, 3, 36), MM)
    along = np.argsort(mesh.points[mesh.tets].mean(axis=1)[:, 2])
    sim = build(scene(material, form, viscosity=viscosity), [TetMesh(mesh.points, mesh.tets[along])])
    nodes = sim.model.nodes
    nodes.v[nodes.x0[:, 2] < 0.5 * MM, 2] = 50.0
    step.prepare(sim)
    (bar,), noted = sim.model.blocks, []
    for _ in range(STEPS):
        if not skip:
            bar.quiet[:] = 0
        step.first_half(sim)
        step.second_half(sim)
        noted.append(int((bar.quiet[:, rest.NOTED] > 0).sum()))
    return sim, noted


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("law", LAWS)
def test_no_bit_differs(law: str, form: Form) -> None:
    answers, limits = set(), set()
    for skip in (True, False):
        sim, noted = struck(LAWS[law], form, skip)
        answers.add(digest.digest(sim.model, sim.comm, [sim.elements.pressure] if sim.elements.split else []))
        limits.add((sim.reduction.limit, sim.limiting_tet()))
        assert (max(noted) >= 3) == (form != "split")
    assert len(answers) == len(limits) == 1


def test_a_wave_ends_the_rest() -> None:
    """Chunks that the wave has reached are not at rest any more; the other chunks still are at rest."""
    sim, noted = struck(STEEL, "standard", skip=True)
    (bar,) = sim.model.blocks
    moving = np.asarray((sim.model.nodes.v != 0.0).sum(axis=1)[bar.tets].sum(axis=1) > 0)
    reached = np.array([moving[c * state.CHUNK : (c + 1) * state.CHUNK].any() for c in range(bar.chunks)])
    assert noted[0] > noted[-1] > 0
    assert not (bar.quiet[reached, rest.NOTED] > 0).any()
