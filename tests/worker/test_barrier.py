"""Barrier pressure that prevents the collapse of a tet in the averaged pressure forms, and scenes in which tets were
crushed without the barrier."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.model import schema
from conoid.cases.model.bodies import Box
from conoid.worker import simulation
from conoid.worker.elements.barrier import SQUEEZED, STIFF
from conoid.worker.model.rows import PRESSURE, VISCOUS, WORK
from conoid.worker.parallel.comm import SerialComm

from . import formulas
from .kernels import HARD, STEEL, Floats, Patch, run
from .meshes import free_tets

BULK = 200e9 / 1.2
DT = 1e-8


@pytest.mark.parametrize("material", [STEEL, HARD])
def test_it_is_a_potential_of_the_own_volume(material: object) -> None:
    """A tet is compressed to 8 % of its volume and released. The pressure agrees with its formula, and the work with
    the integral of the pressure."""
    mesh = free_tets(1, 3)
    patch = Patch(mesh, material, "nodal")  # type: ignore[arg-type]
    there = np.linspace(1.0, 0.08, 4000) ** (1.0 / 3.0)
    pressures, work, extra = [0.0], [0.0], 0.0
    volume = float(mesh.volumes()[0])
    for old, new in pairwise(np.concatenate([there, there[::-1][1:]])):
        patch.nodes.v[:], patch.nodes.x[:] = mesh.points * (new - old) / DT, mesh.points * new
        before, done = patch.get(PRESSURE)[0], patch.get(WORK)[0]
        patch.advance(DT)
        change = volume * (new**3 - old**3)
        extra += patch.get(WORK)[0] - done + 0.5 * (before + patch.get(PRESSURE)[0]) * change
        pressures.append(patch.get(VISCOUS)[0])
        work.append(extra)
    ratio = np.concatenate([there, there[::-1][1:]]) ** 3
    depth = SQUEEZED / np.minimum(ratio, SQUEEZED) - 1.0
    assert np.allclose(pressures, STIFF * BULK * depth**2, rtol=1e-9, atol=1e-3)
    integral = SQUEEZED**2 / ratio - ratio - 2.0 * SQUEEZED * np.log(SQUEEZED / ratio)  # of (s / J - 1)^2, J to s
    stored = STIFF * BULK * volume * np.where(ratio < SQUEEZED, integral, 0.0)
    assert np.abs(work - stored).max() < 1e-3 * stored.max()
    assert abs(work[-1]) < 1e-6 * stored.max()


def test_a_plate_that_meets_another_is_not_crushed_at_its_edge() -> None:
    """Plates of copper collide at 1.5 km/s each with `nodal`. Without the barrier the volume of a tet in the contact
    plane, and thus the time step, became zero at 2.18 us.
    """
    bodies = {"upper": (0.01, 2.01, -1500.0), "lower": (-3.0, 0.0, 1500.0)}
    plates = [
        schema.Part(
            name=name, material="copper_ofhc", velocity=(0.0, 0.0, speed),
            mesh=Box(
                shape="box", low=(-4e-3, -4e-3, 1e-3 * low), high=(4e-3, 4e-3, 1e-3 * high), element_size=0.8e-3,
                generator="structured",
            ),
        )
        for name, (low, high, speed) in bodies.items()
    ]  # fmt: skip
    case = schema.Case(
        name="plates", parts=tuple(plates), contact=schema.Contact(), run=schema.Run(end_time=2.4e-6, frames=0)
    )
    sim = simulation.build(case, Path(), SerialComm())
    least: list[float] = []

    def watch(now: simulation.Simulation, before: Floats) -> None:
        if now.clock.step % 20 == 0:
            now.ledger.close(before)
            ratios = [
                formulas.volumes(now.model.nodes.x[part.tets.astype(np.int64)])
                / formulas.volumes(now.model.nodes.x0[part.tets.astype(np.int64)])
                for part in now.model.blocks
            ]
            least.append(float(np.concatenate(ratios).min()))

    run(sim, watch, 3000)
    assert sim.clock.done
    assert 0.03 < min(least) < SQUEEZED
    assert sim.ledger.worst < 2e-4
