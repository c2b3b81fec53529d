"""The Mohr-Coulomb return compared with its conditions, closed forms and strengths (H19 of the hard cases)."""

import math

import numpy as np
import pytest

from conoid.cases.model import materials
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import PLASTIC_STRAIN, PRESSURE, WORK, WORK_PLASTIC
from conoid.worker.model.state import CHUNK

from . import formulas
from .brittle import BULK, DT, PHI, SHEAR, C, brittle, free, random_deviators, rotations, stretched
from .kernels import FORMS, GLASS, Form, Patch
from .meshes import REGULAR, Floats, block

LAWS = {
    "glass": brittle(strength_cap=3.6e9),
    "uncapped": brittle(),
    "tresca": brittle(0.5e9, 0.0),
    "steep": brittle(1e6, math.radians(89.0), strength_cap=2e9),
}


def excess(s: Floats, pressure: Floats | float, law: materials.MohrCoulomb) -> Floats:
    """Returns the larger of f and s1 - s3 - cap, Pa; f of the apex if the pressure is beyond the apex."""
    d = np.linalg.eigvalsh(s)
    sine, cosine = math.sin(law.friction_angle), math.cos(law.friction_angle)
    most = np.maximum(2.0 * law.cohesion * cosine + 2.0 * sine * np.asarray(pressure), 0.0)
    f = d[:, 2] - d[:, 0] + (d[:, 2] + d[:, 0]) * sine - most
    return np.asarray(np.maximum(f, d[:, 2] - d[:, 0] - (law.strength_cap or math.inf)))


@pytest.mark.parametrize("name", LAWS)
def test_a_hundred_thousand_random_stresses(name: str) -> None:
    """The new stress is on the yield surface, has the principal directions of the trial stress, and results from flow
    along (1, 0, -1) or an adjacent direction. The energy that the return dissipates is booked as plastic work."""
    n, random, law = 25_000, np.random.default_rng(len(name)), LAWS[name].strength
    assert isinstance(law, materials.MohrCoulomb)
    trial, pressure = random_deviators(n, random), random.normal(size=n) * 10.0 ** random.uniform(7.0, 10.0, n)
    patch = free(n, LAWS[name], trial, pressure)
    volume = float(np.linalg.det(REGULAR[1:] - REGULAR[0])) / 6.0
    patch.advance(DT)
    s, q = patch.deviator, formulas.mises(trial)
    before, after = excess(trial, pressure, law), excess(s, pressure, law)
    assert np.isfinite(s).all()
    assert (after <= 1e-13 * q + 1e-6).all()
    assert (after[before > 1e-13 * q] >= -1e-13 * q[before > 1e-13 * q]).all()
    assert (s[before < -1e-13 * q] == trial[before < -1e-13 * q]).all()
    assert (patch.get(PRESSURE) == pressure).all()
    assert 0.1 * n < (before > 0.0).sum() < 0.99 * n
    assert np.abs((s @ trial - trial @ s) / (q * q)[:, None, None]).max() < 1e-13
    _, directions = np.linalg.eigh(trial)
    flow = np.einsum("nji,njk,nki->ni", directions, trial - s, directions) / q[:, None]
    new = np.einsum("nji,njk,nki->ni", directions, s, directions) / q[:, None]
    assert (flow[:, 2] >= -1e-13).all()
    assert (flow[:, 0] <= 1e-13).all()
    apart = np.diff(new, axis=1) > 1e-9
    middle = np.where(apart[:, 0] & apart[:, 1], np.abs(flow[:, 1]), 0.0)
    assert middle.max() < 1e-13
    assert (flow[~apart[:, 1] & apart[:, 0], 1] >= -1e-9).all()
    assert (flow[~apart[:, 0] & apart[:, 1], 1] <= 1e-9).all()
    size = np.sqrt(((trial - s) ** 2).sum(axis=(1, 2)))
    assert np.abs(patch.get(PLASTIC_STRAIN) - math.sqrt(2 / 3) * size / (2 * SHEAR)).max() < 1e-13 * q.max() / SHEAR
    lost = volume * ((trial * trial).sum(axis=(1, 2)) - (s * s).sum(axis=(1, 2))) / (4.0 * SHEAR)
    assert (np.abs(patch.get(WORK_PLASTIC) - lost) <= 1e-12 * volume * q * q / SHEAR).all()
    assert (patch.get(WORK_PLASTIC) >= 0.0).all()
    flowed = patch.get(PLASTIC_STRAIN)
    patch.advance(DT)
    assert (np.abs(patch.deviator - s).max(axis=(1, 2)) <= 1e-13 * q).all()
    assert (patch.get(PLASTIC_STRAIN) - flowed <= 1e-13 * q / SHEAR).all()


@pytest.mark.parametrize(
    ("values", "pressure", "expected"),
    [
        ((3e9, 0.0, -3e9), 0.0, None),
        ((2e9, 2e9, -4e9), 0.2e9, "low"),
        ((2.2e9, 1.8e9, -4e9), 0.2e9, "low"),
        ((4e9, -2e9, -2e9), 0.2e9, "high"),
        ((4e9, -1.8e9, -2.2e9), 0.2e9, "high"),
        ((1e9, 0.0, -1e9), -C / math.tan(PHI), "apex"),
        ((1e9, 0.5e9, -1.5e9), -1e12, "apex"),
        ((5e9, 0.0, -5e9), 20e9, "cap"),
        ((4e9, 4e9, -8e9), 20e9, "low cap"),
    ],
)
def test_plane_edges_apex_and_cap(values: tuple[float, ...], pressure: float, expected: str | None) -> None:
    """The closed forms are those of docs/theory/materials.md."""
    sine = math.sin(PHI)
    most = 2.0 * (C * math.cos(PHI) + pressure * sine)
    a, b = most / (3.0 - sine), most / (3.0 + sine)
    forms = {
        None: (0.5 * most, 0.0, -0.5 * most),
        "low": (a, a, -2 * a),
        "high": (2 * b, -b, -b),
        "apex": (0.0, 0.0, 0.0),
        "cap": (1.8e9, 0.0, -1.8e9),
        "low cap": (1.2e9, 1.2e9, -2.4e9),
    }
    q = rotations(1, np.random.default_rng(1))[0]
    patch = free(1, LAWS["glass"], (q @ np.diag(values) @ q.T)[None], pressure)
    patch.advance(DT)
    assert np.abs(q.T @ patch.deviator[0] @ q - np.diag(forms[expected])).max() < 1e-5
    assert patch.get(PRESSURE)[0] == pressure


@pytest.mark.parametrize("length", [1, 7, CHUNK - 1, CHUNK])
def test_a_stress_gives_the_same_bits_in_any_place(length: int) -> None:
    """The result does not depend on the other tets of the chunk, nor on the last chunk, which has ``length`` tets."""
    random, kinds = np.random.default_rng(3), 40
    few, pressure = random_deviators(kinds, random), random.normal(size=kinds) * 1e9
    chosen = random.integers(0, kinds, 2 * CHUNK + length)
    patch = free(len(chosen), LAWS["glass"], few[chosen], pressure[chosen])
    patch.advance(DT)
    rows = np.column_stack([patch.deviator.reshape(-1, 9), patch.get(PLASTIC_STRAIN), patch.get(WORK_PLASTIC)])
    for kind in range(kinds):
        alike = rows[chosen == kind].view(np.int64)
        assert (alike == alike[0]).all()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("axial", [-1.0, 1.0])
def test_uniaxial_strength(form: Form, axial: float) -> None:
    """A block with free sides has the strength 2 c cos(phi) / (1 -+ sin(phi)) in compression and in tension. The sides
    of the block move so that the stress on the sides stays at zero; every tet of the block has the same strain.
    """
    patch = Patch(block((2, 2, 2)), LAWS["glass"], form)
    side, before, steps = 0.0, 0.0, 400
    strength = 2.0 * C * math.cos(PHI) / (1.0 + axial * math.sin(PHI))
    rate = 3.0 * strength / 72e9 / (steps * DT)
    for _ in range(steps):
        now = float(patch.stress[0, 0, 0])
        side -= (2.0 * now - before) / (2.0 * (BULK + SHEAR / 3.0)) / DT
        before = now
        stretched(patch, np.diag([side, side, axial * rate]))
    stress = patch.stress
    assert np.abs(stress / strength - np.diag([0.0, 0.0, axial])).max() < 1e-5
    assert patch.get(PLASTIC_STRAIN).min() > 0.5 * rate * steps * DT


def test_failed_glass_keeps_the_residual_strength() -> None:
    """In shear at a constant pressure the strength is 2 (c cos(phi) + p sin(phi)) until the failure strain, and 2 p
    sin(30 deg) afterwards."""
    patch = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), GLASS)
    patch.put(PRESSURE, 0.5e9)
    rate = 1e4
    seen = []
    for _ in range(100):
        stretched(patch, np.array([[0.0, rate, 0.0], [rate, 0.0, 0.0], [0.0, 0.0, 0.0]]))
        seen.append((patch.get(PLASTIC_STRAIN)[0], 2.0 * patch.deviator[0, 0, 1]))
    strain, strength = np.array(seen).T
    intact, failed = 2.0 * (C * math.cos(PHI) + 0.5e9 * math.sin(PHI)), 0.5e9
    flowing, over = strain > 0.0, np.concatenate([[False], strain[:-1] > 0.05])
    assert 20 < over.sum() < 80
    assert np.abs(strength[flowing & ~over] / intact - 1.0).max() < 1e-12
    assert np.abs(strength[over] / failed - 1.0).max() < 1e-12


@pytest.mark.parametrize("end", ["failure", "release"])
def test_no_elastic_energy_is_left_behind_when_the_strength_falls(end: str) -> None:
    """Work minus plastic work is the elastic energy of the stress, V s : s / 4 G, also after the loss of strength."""
    patch = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), GLASS if end == "failure" else LAWS["glass"])
    patch.put(PRESSURE, 1e9)
    volume = float(np.linalg.det(REGULAR[1:] - REGULAR[0])) / 6.0
    L = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) * 1e3

    def elastic() -> float:
        return float((patch.deviator**2).sum()) * volume / (4.0 * SHEAR)

    for _ in range(300):
        stretched(patch, L)
    full, intact = elastic(), 2.0 * (C * math.cos(PHI) + 1e9 * math.sin(PHI))
    assert abs(patch.get(WORK)[0] - patch.get(WORK_PLASTIC)[0] - full) < 1e-9 * full
    if end == "failure":
        for _ in range(500):
            stretched(patch, L)
        assert abs(elastic() / full / (1e9 / intact) ** 2 - 1.0) < 1e-9
    else:
        patch.put(PRESSURE, -1e9)
        stretched(patch, L)
        assert elastic() == 0.0
    assert abs(patch.get(WORK)[0] - patch.get(WORK_PLASTIC)[0] - elastic()) < 1e-9 * full
