"""Mohr-Coulomb flow with dilation: the return compared with its conditions, and the triaxial path with closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest

from conoid.cases import load
from conoid.cases.model import materials
from conoid.cases.reading.library import library
from conoid.worker import simulation
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import DILATION, PLASTIC_STRAIN, PRESSURE, S_ZZ, WORK, WORK_AVERAGED, WORK_PLASTIC
from conoid.worker.parallel.comm import SerialComm

from . import formulas
from .brittle import BULK, DT, PHI, SHEAR, C, brittle, free, random_deviators, stretched
from .kernels import FORMS, Form, Patch, run
from .meshes import REGULAR, Floats, block

ANGLES = (math.radians(20.0), PHI)


def glass(psi: float, **keys: float) -> materials.Material:
    """Returns glass with dilation."""
    return brittle(C, PHI, dilation_angle=psi, **keys)


def multipliers(flow: Floats, apart: "np.ndarray", psi: float) -> Floats:
    """Returns (n, 2) the amounts of flow of two mechanisms in each plastic strain (n, 3), sorted with the largest
    amount first. One mechanism is (1 + sin psi, 0, sin psi - 1). The other mechanism is on the other side of the edge
    of the yield surface on which the stress is, ``apart`` (n, 2).
    """
    s = math.sin(psi)
    one, low, high = np.array([[1 + s, 0, s - 1], [0, 1 + s, s - 1], [1 + s, s - 1, 0]])
    rows = [
        np.linalg.lstsq(np.stack([one, low if b else high], axis=1), f, rcond=None)[0] if not (a and b) else
        np.array([f @ one / (one @ one), 0.0])
        for f, (a, b) in zip(flow, apart, strict=True)
    ]  # fmt: skip
    built = [m[0] * one + m[1] * (low if b else high) for m, (_, b) in zip(rows, apart, strict=True)]
    assert np.abs(np.array(built) - flow).max() < 1e-10 * np.abs(flow).max()
    return np.array(rows)


@pytest.mark.parametrize("psi", ANGLES)
def test_a_return_is_on_the_surface_by_flow_along_the_potential(psi: float) -> None:
    """Returns to the plane and to the edges of the yield surface have positive amounts of flow, for stresses of 0.2 to
    200 times the strength."""
    n, random = 4_000, np.random.default_rng(7)
    trial = random_deviators(n, random)
    q = formulas.mises(trial)
    pressure = q * random.uniform(0.1, 1.0, n)
    patch = free(n, glass(psi), trial, pressure)
    patch.advance(DT)
    s, grown = patch.deviator, patch.get(PRESSURE) - pressure
    d, before = np.linalg.eigvalsh(s)[:, ::-1], np.linalg.eigvalsh(trial)[:, ::-1]
    strength = 2.0 * (C * math.cos(PHI) + patch.get(PRESSURE) * math.sin(PHI))
    f = (1.0 + math.sin(PHI)) * d[:, 0] - (1.0 - math.sin(PHI)) * d[:, 2] - strength
    flowed = patch.get(PLASTIC_STRAIN) > 0.0
    assert 0.1 * n < flowed.sum() < n
    assert (np.abs(f[flowed]) < 1e-9 * (q + pressure)[flowed]).all()
    assert (f[~flowed] <= 1e-12 * q[~flowed]).all()
    assert np.allclose(BULK * patch.get(DILATION), grown, rtol=1e-9, atol=1e-6 * BULK * 1e-9)
    plastic = (before - d)[flowed] / (2.0 * SHEAR) + patch.get(DILATION)[flowed, None] / 3.0
    apart = -np.diff(d[flowed], axis=1) > 1e-9 * q[flowed, None]
    scaled = plastic / np.abs(plastic).max(axis=1)[:, None]
    flows = multipliers(scaled, apart, psi)
    assert flows.min() > -1e-9
    edges = (~apart).sum(axis=0)
    assert edges.min() > 50
    assert apart.all(axis=1).sum() > 200


def elastic_work(patch: Patch, form: Form) -> Floats:
    """Returns (tets,) the elastic part of the work, J."""
    averaged = 0.0 if form == "standard" else patch.get(WORK_AVERAGED)
    return patch.get(WORK) - patch.get(WORK_PLASTIC) - averaged


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("psi", ANGLES)
def test_the_triaxial_path(form: Form, psi: float) -> None:
    """In this test a block under the lateral pressure s is shortened along z. The block is elastic up to the stress f +
    s (1 + sin phi) / (1 - sin phi). Beyond the elastic limit no stress changes if the volume grows by 2 sin psi / (1 -
    sin psi) of the shortening, half of this growth on each lateral axis. The work on the block is the work of the
    stress at the elastic limit. The stored energy is p^2 / 2K + q^2 / 6G per present volume; the rest of the work is
    plastic.
    """
    patch, lateral, steps = Patch(block((2, 2, 2)), glass(psi), form), 100e6, 200
    patch.put(PRESSURE, lateral)
    low, sine = math.sin(psi), math.sin(PHI)
    axial = (2.0 * C * math.cos(PHI) + lateral * (1.0 + sine)) / (1.0 - sine)
    elastic = (axial - lateral) / 72e9 / (steps * DT)
    for _ in range(steps):
        stretched(patch, np.diag([0.22 * elastic, 0.22 * elastic, -elastic]))
    assert np.abs(patch.stress / np.diag([lateral, lateral, axial]).clip(1.0) + np.eye(3)).max() < 1e-6
    stored, side = elastic_work(patch, form), 0.5 * (1.0 + low) / (1.0 - low)
    done, strain = patch.get(WORK_PLASTIC).copy(), (2.0 * side - 1.0) * elastic * DT
    for _ in range(steps):
        stretched(patch, elastic * np.diag([side, side, -1.0]))
    assert np.abs(patch.stress / np.diag([lateral, lateral, axial]).clip(1.0) + np.eye(3)).max() < 1e-6
    volume = (
        np.linalg.det(np.diff(patch.corners(patch.sim.model.nodes.x0)[:, [0, 1, 0, 2, 0, 3]], axis=1)[:, ::2]) / 6.0
    )
    spent = (axial - 2.0 * lateral * side) * elastic * steps * DT * volume
    p, q = (axial + 2.0 * lateral) / 3.0, axial - lateral
    grown = (p * p / (2.0 * BULK) + q * q / (6.0 * SHEAR)) * strain * steps * volume
    assert np.allclose(patch.get(WORK_PLASTIC) - done, spent - grown, rtol=1e-9)
    assert np.allclose(elastic_work(patch, form) - stored, grown, rtol=1e-9)


def test_the_apex_removes_the_deviator_and_no_strength_returns() -> None:
    """The deviator becomes zero for a pressure far beyond the apex, and the pressure rises at most by the amount of the
    flow to the apex.
    """
    trial = random_deviators(500, np.random.default_rng(3))
    patch = free(500, glass(ANGLES[0]), trial, -1e12)
    patch.advance(DT)
    q = formulas.mises(trial)
    assert (formulas.mises(patch.deviator) <= 1e-12 * q).all()
    most = 2.0 * math.sin(ANGLES[0]) * q / (2.0 * SHEAR) / (1.0 - math.sin(ANGLES[0]) / 3.0)
    assert (patch.get(DILATION) > 0.0).all()
    assert (patch.get(DILATION) <= most).all()


def test_failed_material_keeps_its_volume() -> None:
    """In shear at constant volume the pressure rises until the failure strain is reached; afterwards the pressure is
    constant.
    """
    law = glass(ANGLES[0], failure_strain=0.02)
    patch = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), law)
    patch.put(PRESSURE, 0.5e9)
    seen = []
    for _ in range(200):
        stretched(patch, np.array([[0.0, 5e3, 0.0], [5e3, 0.0, 0.0], [0.0, 0.0, 0.0]]))
        seen.append((patch.get(PLASTIC_STRAIN)[0], patch.get(PRESSURE)[0]))
    strain, pressure = np.array(seen).T
    failed = np.concatenate([[False], strain[:-1] > 0.02])
    assert 20 < failed.sum() < 180
    flowing = (strain > 0.0) & ~failed
    rises = np.diff(pressure)[flowing[1:] & flowing[:-1]]
    assert (rises > 0.0).all()
    assert np.ptp(pressure[failed]) == 0.0


def plastic(sim: simulation.Simulation) -> tuple[float, float]:
    """Returns the logarithmic volume and the logarithmic height of the cube minus their elastic parts from the mean
    stress.
    """
    nodes, (tets,) = sim.model.nodes, sim.model.blocks
    volume = TetMesh(nodes.x, tets.tets.astype(np.int32)).volumes()
    p, s = (float(tets.row(row) @ volume / volume.sum()) for row in (PRESSURE, S_ZZ))
    height = math.log(float(np.ptp(nodes.x[:, 2])))
    return math.log(float(volume.sum())) + p / BULK, height + p / (3.0 * BULK) - s / (2.0 * SHEAR)


@pytest.mark.parametrize("form", FORMS)
def test_a_cube_swells_as_it_should_and_keeps_its_energy(form: Form) -> None:
    """In the shipped triaxial test with a dilation angle of 20 degrees, the ratio of plastic volume to plastic height
    in the flow agrees with the formula."""
    data = load.read_data(load.shipped_path("triaxial_glass"))
    made = library()["soda_lime_mohr_coulomb"].model_dump(exclude_none=True)
    made["strength"]["dilation_angle"] = ANGLES[0]
    data["materials"] = {"soda_lime_mohr_coulomb": made}
    case = load.parse_case(load.apply_overrides(data, [f'numerics.pressure="{form}"', "run.frames=0"]))
    sim = simulation.build(case, Path(), SerialComm())
    course, energies = [], []

    def watch(sim: simulation.Simulation, before: Floats) -> None:
        if sim.clock.t > 45e-6 and sim.clock.step % 20 == 0:
            course.append(plastic(sim))
            energies.append(sim.ledger.close(before))

    run(sim, watch)
    grown, shortened = np.ptp(np.array(course), axis=0)
    expected = 2.0 * math.sin(ANGLES[0]) / (1.0 - math.sin(ANGLES[0]))
    assert grown / shortened == pytest.approx(expected, rel=0.01)
    assert sim.ledger.worst < 1e-4
    assert all(e.elastic > 0.0 and e.plastic > 0.0 for e in energies)
