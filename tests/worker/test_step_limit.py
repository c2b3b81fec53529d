"""The stable step compared with exact frequencies of single tets, with and without bulk viscosity."""

import math
from typing import Any

import numpy as np
import pytest

from conoid.worker.elements.limits import LENGTH_FACTOR
from conoid.worker.materials.law import BREAKS
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import PRESSURE, VISCOUS, WORK, WORK_VISCOUS
from conoid.worker.simulation import Simulation

from . import formulas
from .kernels import FORMS, STEEL, Form, Patch, build, run, scene
from .meshes import REGULAR, Floats, free_tets

YOUNG, DENSITY = 200e9, 7850.0
DT = 1e-9
LINEAR, SHOCK, QUADRATIC = 0.06, 0.4, 1.5


def moduli(poisson: float) -> tuple[float, float]:
    return YOUNG / (3.0 * (1.0 - 2.0 * poisson)), YOUNG / (2.0 * (1.0 + poisson))


def one(mesh: TetMesh, i: int, poisson: float, **keys: Any) -> Patch:
    """Returns tet ``i`` of a set as a separate patch, so that the limit of a pass is the limit of this tet."""
    points = mesh.points[mesh.tets[i]]
    metal = STEEL.model_copy(update={"elastic": STEEL.elastic.model_copy(update={"poisson": poisson})})
    return Patch(TetMesh(points, np.array([[0, 1, 2, 3]], np.int32)), metal, **keys)


def exact_step(patch: Patch, poisson: float) -> float:
    """Returns 2 / omega_max of the tet with a quarter of the mass of the tet at each node, s."""
    volume, grad = formulas.gradients(patch.corners())
    stiffness = formulas.stiffness(float(volume[0]), grad[0], *moduli(poisson))
    return 2.0 / math.sqrt(np.linalg.eigvalsh(stiffness)[-1] / (DENSITY * volume[0] / 4.0))


@pytest.mark.parametrize("poisson", [0.0, 0.22, 0.3, 0.49])
def test_bound_is_never_above_the_exact_limit(poisson: float) -> None:
    """The bound of the step is at most the exact limit and at least 0.57 of the exact limit, for tets of all shapes,
    including slivers.
    """
    mesh = free_tets(300, 1, flattest=1e-3)
    shares = []
    for i in range(300):
        patch = one(mesh, i, poisson)
        patch.advance(0.0)
        shares.append(1.0 / patch.limit / exact_step(patch, poisson))
    assert max(shares) <= 1.0 + 1e-12
    assert min(shares) > 0.57


def test_bound_of_the_regular_tet() -> None:
    """The bound for a regular tet with an edge of 1 m and nu = 0.3 is derived: |grad N|^2 = 3/2 at each node, so the
    bound is 1 / (c sqrt 6). The fastest mode of the regular tet is volumetric, with the strain energy 9/2 K V e^2 and
    the kinetic energy 3/16 rho V (de/dt)^2, r^2 = 3/8.
    """
    patch = one(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), 0, 0.3)
    patch.advance(0.0)
    bulk, shear = moduli(0.3)
    c = math.sqrt((bulk + 4.0 / 3.0 * shear) / DENSITY)
    assert math.isclose(1.0 / patch.limit, 1.0 / (c * math.sqrt(6.0)), rel_tol=1e-12)
    breathing = math.sqrt(9.0 * bulk / (DENSITY * 3.0 / 8.0))
    assert math.isclose(exact_step(patch, 0.3), 2.0 / breathing, rel_tol=1e-12)


def test_length_factor_makes_the_length_of_a_regular_tet_its_cube_root() -> None:
    volume, grad = formulas.gradients(REGULAR[None])
    assert math.isclose(
        LENGTH_FACTOR / formulas.inverse_length(grad)[0], float(volume[0]) ** (1.0 / 3.0), rel_tol=1e-15
    )


def squeezed(i: int, mesh: TetMesh, rate: float, poisson: float = 0.3) -> Patch:
    """Returns tet ``i`` at the end of a step of ``DT`` in which its volume changed at ``rate``, 1/s, with viscosity."""
    patch = one(mesh, i, poisson, viscosity={"linear": LINEAR, "shock": SHOCK, "quadratic": QUADRATIC})
    patch.strain(rate / 3.0 * np.eye(3), DT)
    patch.advance(DT)
    return patch


def viscous_law(patch: Patch, poisson: float = 0.3) -> tuple[float, float]:
    """Returns the viscous pressure q and its slope with respect to the rate of compression, from the formulas, at the
    end of the step. The pass divides the change of volume by the volume at the end of the step.
    """
    bulk, shear = moduli(poisson)
    volume, grad = formulas.gradients(patch.corners())
    density = DENSITY * float(free_volume(patch) / volume[0])
    c = math.sqrt((bulk + 4.0 / 3.0 * shear * free_volume(patch) / float(volume[0])) / density)
    length = LENGTH_FACTOR / float(formulas.inverse_length(grad)[0])
    squeeze = max(-growth(patch) / (DT * float(volume[0])), 0.0)
    speed = length * squeeze
    share = speed / (speed + 0.01 * c)
    q = density * speed * ((LINEAR + SHOCK * share) * c + QUADRATIC * speed)
    return q, density * length * ((LINEAR + SHOCK * share * (2.0 - share)) * c + 2.0 * QUADRATIC * speed)


def growth(patch: Patch) -> float:
    """Returns the change of volume of the tet in the step, m^3."""
    old = formulas.volumes(patch.corners() - DT * patch.corners(patch.nodes.v))
    return float(formulas.volumes(patch.corners())[0] - old[0])


def free_volume(patch: Patch) -> float:
    """Returns the initial volume of the tet, m^3."""
    return float(patch.nodes.mass.sum()) / DENSITY


@pytest.mark.parametrize("rate", [-1e7, -1e5, -10.0, 10.0, 1e6])
def test_bulk_viscosity(rate: float) -> None:
    mesh = free_tets(20, 2)
    for i in range(20):
        patch = squeezed(i, mesh, rate)
        q, _ = viscous_law(patch)
        assert math.isclose(patch.get(VISCOUS)[0], q, rel_tol=1e-8)
        assert (q > 0.0) == (rate < 0.0)
        assert math.isclose(patch.get(WORK_VISCOUS)[0], -0.5 * q * growth(patch), rel_tol=1e-6, abs_tol=1e-30)


@pytest.mark.parametrize("rate", [-1e8, -1e7, -1e5, 1e6])
def test_viscous_bound_is_never_above_the_exact_limit(rate: float) -> None:
    """A leapfrog scheme with the damping C of the previous step is stable while M - dt/2 C - dt^2/4 K is positive."""
    mesh = free_tets(40, 3, flattest=0.01)
    for i in range(40):
        patch = squeezed(i, mesh, rate)
        volume, grad = formulas.gradients(patch.corners())
        stiffness = formulas.stiffness(float(volume[0]), grad[0], *moduli(0.3))
        slope = viscous_law(patch)[1] if rate < 0.0 else 0.0
        damping = volume[0] * slope * np.outer(grad[0].reshape(-1), grad[0].reshape(-1))
        mass = free_volume(patch) * DENSITY / 4.0
        dt = 1.0 / patch.limit
        assert np.linalg.eigvalsh(mass * np.eye(12) - 0.5 * dt * damping - 0.25 * dt**2 * stiffness)[0] > -1e-9 * mass


def test_what_may_break_is_bounded_in_tension_as_if_it_were_let_go() -> None:
    """In a part that can break, the bound includes the viscosity at the speed |p| / (density c); in other parts the
    bound includes only the linear term."""
    mesh, found = free_tets(1, 4), []
    for breaks in (False, True):
        patch = one(mesh, 0, 0.3, viscosity={"linear": LINEAR, "shock": SHOCK, "quadratic": QUADRATIC})
        patch.block.params[BREAKS] = breaks
        patch.strain(1e6 * np.eye(3), DT)
        patch.advance(DT)
        found.append(patch.limit)
        volume, grad = formulas.gradients(patch.corners())
    density, bulk, shear = DENSITY * float(free_volume(patch) / volume[0]), *moduli(0.3)
    c = math.sqrt((bulk + 4.0 / 3.0 * shear * free_volume(patch) / float(volume[0])) / density)
    u = -float(patch.get(PRESSURE)[0]) / (density * c)
    share = u / (u + 0.01 * c)
    least = LENGTH_FACTOR * LINEAR * c
    tangent = LENGTH_FACTOR * ((LINEAR + SHOCK * share * (2.0 - share)) * c + 2.0 * QUADRATIC * u)
    steep = float(formulas.inverse_length(grad)[0])
    assert u > 1.0
    for limit, bound in zip(found, (least, tangent), strict=True):
        assert limit == pytest.approx(steep * (bound + math.sqrt(bound**2 + c**2)), rel=1e-8)


def test_viscous_bound_shrinks_with_the_rate() -> None:
    mesh = free_tets(1, 4)
    limits = [squeezed(0, mesh, rate).limit for rate in (0.0, -1e3, -1e6, -1e8)]
    assert limits == sorted(limits)
    assert limits[-1] > 1.5 * limits[0]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rate", [-1e9, 1e9])
def test_no_tet_changes_its_volume_by_more_than_a_quarter_in_a_step(rate: float, form: Form) -> None:
    """The limit by the motion also holds in the first step, because the first pass, with a step of zero, computes the
    rate. A slow motion does not change the step.
    """
    tet = TetMesh(1e-3 * REGULAR, np.array([[0, 1, 2, 3]], np.int32))
    limits = []
    for each in (0.0, 1e-3 * rate, rate):
        patch = Patch(tet, STEEL, form)
        patch.nodes.v[:] = each / 3.0 * patch.nodes.x
        patch.advance(0.0)
        limits.append(patch.limit)
    assert limits[0] == limits[1] < limits[2]
    assert limits[2] == pytest.approx(4.0 * abs(rate), rel=1e-12)


@pytest.mark.parametrize("poisson", [0.22, 0.49])
def test_free_tets_keep_their_energy_at_the_bound(poisson: float) -> None:
    """Two thousand free tets of one size oscillate for 3,000 steps at the full bound: no tet gains energy (H8)."""
    heap = free_tets(2000, 5)
    size = np.cbrt(heap.volumes())
    mesh = TetMesh(heap.points / np.repeat(size, 4)[:, None] * 1e-3, heap.tets)
    metal = STEEL.model_copy(update={"elastic": STEEL.elastic.model_copy(update={"poisson": poisson})})
    sim = build(scene(metal, dt_safety=1.0), [mesh])
    sim.model.nodes.v[:] = np.random.default_rng(6).normal(size=(8000, 3)) * 0.01
    start = 0.5 * (sim.model.nodes.mass[:, None] * sim.model.nodes.v**2).sum()
    accounts: list[float] = []

    def look(sim: Simulation, before: Floats) -> None:
        kinetic = 0.5 * (sim.model.nodes.mass[:, None] * before * sim.model.nodes.v).sum()
        accounts.append(float(kinetic + sim.model.blocks[0].row(WORK).sum()))

    run(sim, look, 3000)
    assert np.abs(np.array(accounts[2:]) / start - 1.0).max() < 1e-4
