"""Bonds by shared nodes: two parts of one file are one body of two materials."""

import math
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.model.schema import Case
from conoid.cases.reading.library import library
from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.errors import InputError, MeshError
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.loads import Load
from conoid.worker.model.rows import PRESSURE, S_ZZ, VISCOUS
from conoid.worker.scene import assembly
from conoid.worker.simulation import Simulation

from .joints import bar, halves, joint, one_part
from .kernels import FORMS, Form
from .meshes import block
from .simulations import kept_again, on, tick

Floats = np.ndarray
PULLED = [
    {"kind": "velocity", "z": "-5 m/s", "low": [-1, -1, -1], "high": [1, 1, "0.1 mm"]},
    {"kind": "velocity", "z": "5 m/s", "low": [-1, -1, "11.9 mm"], "high": [1, 1, 1]},
]
"""Prescribed motion of the ends of a bar of 12 mm."""
WHOLE, PARTS = bar((3, 3, 12), 1e-3, 6e-3)
STEPS = 60


def state(sim: Simulation) -> tuple[str | None, Any, float]:
    """Returns digest, energies of the parts and worst residual after some steps."""
    step.prepare(sim)
    residual = max(tick(sim) for _ in range(STEPS))
    return digest.digest(sim.model, sim.comm, sim.elements.nodal), sim.ledger.parts, residual


def motion(sim: Simulation) -> tuple[Floats, Floats, Floats]:
    step.prepare(sim)
    for _ in range(STEPS):
        tick(sim)
    return sim.model.nodes.x, sim.model.nodes.v, np.concatenate([block.row(S_ZZ) for block in sim.model.blocks])


@pytest.mark.parametrize("form", FORMS)
def test_a_bonded_body_of_one_material_is_that_of_one_part_to_the_bit(form: Form) -> None:
    keys: dict[str, Any] = {"numerics": {"pressure": form}, "boundaries": PULLED}
    (two,) = on(1, joint(("steel", "steel"), **keys), PARTS, motion)
    (one,) = on(1, one_part("steel", **keys), [WHOLE], motion)
    for mine, theirs in zip(two, one, strict=True):
        assert np.array_equal(mine, theirs)


@pytest.mark.parametrize("form", FORMS)
def test_ranks_and_a_restart_change_no_bit_of_a_body_of_two_materials(form: Form, tmp_path: Path) -> None:
    case = joint(("alumina", "steel"), numerics={"pressure": form}, boundaries=PULLED)
    ((known, parts, residual),) = on(1, case, PARTS, state)
    assert residual < 2e-5
    for ranks in (2, 3, 7):
        assert on(ranks, case, PARTS, state)[0] == (known, parts, residual)

    def gone_on(sim: Simulation) -> tuple[str | None, Any]:
        step.prepare(sim)
        for number in range(STEPS):
            if number == STEPS // 2:
                sim = kept_again(sim, case, tmp_path)
            tick(sim)
        return digest.digest(sim.model, sim.comm, sim.elements.nodal), sim.ledger.parts

    assert on(3, case, PARTS, gone_on)[0] == (known, parts)


@pytest.mark.parametrize("form", FORMS)
def test_a_stress_that_two_materials_have_in_common_is_uniform_in_both(form: Form) -> None:
    """The strain of each material is the strain that gives the same uniaxial stress: the mean over a node of the
    interface does not mix the two materials."""
    stress, (low, high) = 1e6, (_confined(library()[name]) for name in ("alumina", "steel"))

    def stretched(sim: Simulation) -> list[Floats]:
        nodes, dt = sim.model.nodes, 1e-12
        step.prepare(sim)
        z = nodes.x[:, 2] - 6e-3
        nodes.v[:, 2] = stress / dt * np.where(z < 0.0, z / low, z / high)
        nodes.x[:, 2] += dt * nodes.v[:, 2]
        sim.elements.advance(dt, 1.0)
        sim.elements.finish()
        return [block.row(S_ZZ) - block.row(PRESSURE) for block in sim.model.blocks]

    case = joint(("alumina", "steel"), numerics={"pressure": form, "viscosity": "none"})
    (found,) = on(1, case, PARTS, stretched)
    for each in found:
        assert each == pytest.approx(stress, rel=1e-5)  # the error is of second order in the strain, 4e-6
        assert np.ptp(each) < 1e-8 * stress


def _confined(material: Any) -> float:
    return float(material.elastic.bulk + 4.0 / 3.0 * material.elastic.shear)


@pytest.mark.parametrize("form", FORMS)
def test_a_wave_is_reflected_and_goes_through_as_the_impedances_have_it(form: Form) -> None:
    """The end of a confined bar moves at v: the stress is z1 v in the first part, and from the interface on 2 z1 z2 /
    (z1 + z2) v (Kolsky 1953)."""
    mesh = block((1, 1, 160), 0.1e-3, 0.0)
    second = mesh.points[mesh.tets, 2].mean(axis=1) > 8e-3
    materials = [library()[name] for name in ("aluminium_2024", "steel")]
    elastic = {
        name: {"density": made.density, "elastic": made.elastic.model_dump()}
        for name, made in zip(("soft", "stiff"), materials, strict=True)
    }
    speeds = [math.sqrt(_confined(made) / made.density) for made in materials]
    z1, z2 = (made.density * speed for made, speed in zip(materials, speeds, strict=True))
    sides = [{"kind": "symmetry", "axis": axis, "at": at} for axis in "xy" for at in (0, "0.1 mm")]
    ends = [{"kind": "velocity", "z": "-1 m/s", "low": [-1, -1, -1], "high": [1, 1, "0.05 mm"]}]
    case = joint(
        ("soft", "stiff"), own=elastic, boundaries=[*sides, *ends], contact="none",
        numerics={"pressure": form, "viscosity": {"linear": 0.2}},
    )  # fmt: skip
    arrival, end = 8e-3 / speeds[0], 8e-3 / speeds[0] + 6e-3 / max(speeds)

    def plateaus(sim: Simulation) -> tuple[float, float, float, float]:
        step.prepare(sim)
        incident = 0.0
        while sim.clock.t < end:
            if incident == 0.0 and sim.clock.t > 0.9 * arrival:
                incident = _mean(sim, 0, 2e-3, 4e-3)
            tick(sim)
        speed = sim.model.nodes.v[np.abs(sim.model.nodes.x0[:, 2] - 8e-3) < 1e-3, 2].mean()
        return incident, _mean(sim, 0, 6e-3, 7.5e-3), _mean(sim, 1, 8.5e-3, 10e-3), float(speed)

    ((incident, reflected, through, speed),) = on(1, case, halves(mesh, second), plateaus)
    assert incident == pytest.approx(z1, rel=2e-3)
    for stress in (reflected, through):
        assert stress == pytest.approx(2.0 * z1 * z2 / (z1 + z2), rel=2e-3)
    assert speed == pytest.approx(-2.0 * z1 / (z1 + z2), rel=2e-3)


def _mean(sim: Simulation, part: int, low: float, high: float) -> float:
    """Returns the mean axial stress of the tets of a part between two heights."""
    of = sim.model.blocks[part]
    z = sim.model.nodes.x0[of.tets, 2].mean(axis=1)
    stress = of.row(S_ZZ) - of.row(PRESSURE) - of.row(VISCOUS)
    return float(stress[(z > low) & (z < high)].mean())


def refusal(case: Case, meshes: list[TetMesh]) -> str:
    with pytest.raises((InputError, MeshError)) as caught:
        on(1, case, meshes, lambda sim: None)
    return str(caught.value)


def test_what_cannot_be_joined_is_refused_in_one_line() -> None:
    case = joint(("steel", "steel"))
    alone = [PARTS[0], TetMesh(PARTS[1].points, PARTS[1].tets, PARTS[1].origin and type(PARTS[1].origin)(
        "other", PARTS[1].origin.nodes))]  # fmt: skip
    assert refusal(case, alone).startswith(
        "bond[0].parts = 'lower, upper': the meshes of the two parts have no face in comm"
    )
    mesh = block((2, 2, 2), 1e-3, 0.0)
    corner = (mesh.points[mesh.tets].mean(axis=1) > 1e-3).all(axis=1)
    other = (mesh.points[mesh.tets].mean(axis=1) < 1e-3).all(axis=1)
    chosen = corner | other
    touching = halves(TetMesh(mesh.points, mesh.tets[chosen]), corner[chosen])
    assert "no face in common" in refusal(case, touching)
    bare = joint(("steel", "steel")).model_copy(update={"bond": ()})
    assert "share 16 nodes of 'joint.inp'" in refusal(bare, PARTS)
    assert "give them a [[bond]] with parts = ['lower', 'upper'] and kind = 'shared'" in refusal(bare, PARTS)


def test_pressure_on_all_sides_of_two_parts_leaves_their_interface_alone() -> None:
    load = [{"kind": "traction", "pressure": "1 MPa", "low": [-1, -1, -1], "high": [1, 1, 1]}]
    case = joint(("alumina", "steel"), boundaries=load)
    with patch.object(assembly, "build_mesh", side_effect=PARTS):
        (made,) = assembly.assemble(case, Path()).loads
    assert isinstance(made, Load)
    assert len(made.force) == 3 * (2 * 9 * 2 + 4 * 36 * 2)
    assert np.abs(made.force.sum(axis=0)).max() < 1e-9


def test_nodes_of_two_parts_are_of_both() -> None:
    """Selections by part find the common nodes in both parts; mass, momentum and energy of each part are those of the
    tets of the part."""
    moved = {"kind": "velocity", "parts": ["upper"], "z": "7 m/s", "low": [-1, -1, -1], "high": [1, 1, 1]}
    case = joint(("alumina", "steel"), boundaries=[moved], lower={"velocity": [0, 0, "3 m/s"]},
                 upper={"velocity": [0, 0, "3 m/s"]})  # fmt: skip

    def looked(sim: Simulation) -> tuple[Any, ...]:
        nodes = sim.model.nodes
        driven = sim.boundaries[0].nodes
        return nodes.mass_of(0).sum(), nodes.mass_of(1).sum(), len(driven), nodes.v[driven, 2], len(nodes.shares.node)

    ((lower, upper, many, v, rows),) = on(1, case, PARTS, looked)
    densities = [library()[name].density for name in ("alumina", "steel")]
    assert [lower, upper] == pytest.approx([density * 54e-9 for density in densities])
    assert many == 16 * 7
    assert (v == 7.0).all()
    assert rows == 2 * 16
    (_, parts, _) = on(3, case, PARTS, state)[0]
    assert set(parts) == {"lower", "upper"}


def test_parts_that_start_at_two_speeds_share_them_at_their_nodes() -> None:
    case = joint(("alumina", "steel"), upper={"velocity": [0, 0, "4 m/s"]})
    ((warnings, v),) = on(1, case, PARTS, lambda sim: (sim.warnings, np.unique(sim.model.nodes.v[:, 2]).tolist()))
    assert any("16 nodes of 'lower' and 'upper' have two different initial velocities" in line for line in warnings)
    assert len(v) > 2
    assert all(0.0 <= each <= 4.0 for each in v)
