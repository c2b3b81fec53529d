"""Averaged pressures with an equation of state that depends on heat: heat is also averaged over nodes."""

import numpy as np
import pytest

from conoid.cases.reading.library import library
from conoid.worker.model.rows import MASS, PRESSURE, WORK, WORK_PLASTIC

from .kernels import COPPER_GAS, Form, Patch, build, run, scene
from .meshes import block, free_tets

MM = 1e-3
STEEL_4340 = library()["steel_4340"]


@pytest.mark.parametrize("form", ["nodal", "split"])
def test_a_free_tet_has_its_own_heat(form: Form) -> None:
    """The nodes of the tet have no other tet: the pressure is that of the standard form, up to the third order of the
    strain.
    """
    pressures = []
    for each in ("standard", form):
        tet = free_tets(1, 5)
        patch, dt = Patch(tet, STEEL_4340, each), 1e-8
        for scale in np.linspace(1.0, 0.9, 101)[1:]:
            patch.nodes.v[:] = (tet.points * [1.0, 1.0, scale] - patch.nodes.x) / dt
            patch.nodes.x[:] = tet.points * [1.0, 1.0, scale]
            patch.advance(dt)
        pressures.append(float(patch.get(PRESSURE)[0]))
    assert pressures[0] > 10e9
    assert pressures[1] == pytest.approx(pressures[0], rel=1e-6)


def test_heat_is_a_mean_over_nodes() -> None:
    """Hot and cold tets are adjacent: heat is averaged by volume at the nodes, and then over the four nodes of a
    tet."""
    mesh = block((4, 4, 4), MM)
    patch = Patch(mesh, COPPER_GAS, "nodal")
    own = np.random.default_rng(1).uniform(0.0, 1e5, len(mesh.tets))
    patch.put(WORK, own * patch.get(MASS))
    patch.advance(1e-9)
    tets, volume = patch.tets, patch.get(MASS) / 8930.0
    heat, volumes = (np.bincount(tets.ravel(), np.repeat(each, 4)) for each in (own * volume, volume))
    expected = 1.96 * 8930.0 * (heat / volumes)[tets].mean(axis=1)
    assert np.abs(patch.get(PRESSURE) / expected - 1.0).max() < 1e-9
    assert np.std(expected) < 0.5 * np.std(1.96 * 8930.0 * own)


@pytest.mark.parametrize("form", ["nodal", "split"])
def test_a_bar_that_is_pulled_keeps_its_elastic_energy(form: Form) -> None:
    """The dissipation is at most the work that was done: the term ``elastic`` does not fall below zero."""
    low, high = {"low": (-1.0,) * 3, "high": (1.0, 1.0, 0.1 * MM)}, {"low": (-1.0, -1.0, 5.9 * MM), "high": (1.0,) * 3}
    held = [{"kind": "velocity", "x": 0.0, "y": 0.0, "z": z, **box} for z, box in ((-150.0, low), (150.0, high))]
    case = scene(STEEL_4340, form, end=15e-6, boundaries=held, velocity=(0.0, 0.0, 0.0), viscosity={})
    sim = build(case, [block((3, 3, 12), 0.5 * MM)])
    run(sim)
    work, plastic = (sum(float(each.row(row).sum()) for each in sim.model.blocks) for row in (WORK, WORK_PLASTIC))
    assert plastic > 5.0
    assert work - plastic > 0.0
