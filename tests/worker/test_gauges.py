"""Gauges compared with plain numpy, with the same bit patterns on any number of ranks: sums, contact forces of parts,
fragments, holes, cones."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.gauges import rays
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import COPPER, STEEL, Floats, build, run, scene
from .meshes import block, ring
from .simulations import kept_again, on, tick

SIZE = 1e-3
MESH = block((4, 3, 3), SIZE, seed=4)
PLANE = {"axis": "x", "at": 2.1e-3, "side": "below"}


def probe(field: str, name: str = "", part: str = "body", **keys: Any) -> schema.Probe:
    return schema.Probe.model_validate({"name": name or field, "part": part, "field": field, **keys})


FIELDS = [
    "mass", "momentum_x", "momentum_y", "momentum_z", "kinetic_energy", "centre_x", "centre_y", "centre_z",
    "centre_velocity_x", "centre_velocity_y", "centre_velocity_z",
]  # fmt: skip


def totals(m: Floats, x: Floats, v: Floats) -> list[float]:
    p = m[:, None] * v
    centre, momentum = (m[:, None] * x).sum(axis=0), p.sum(axis=0)
    return [
        m.sum(), *momentum, 0.5 * (p * v).sum(), *(centre / m.sum()), *(momentum / m.sum()),
    ]  # fmt: skip


def bits(values: Floats) -> bytes:
    return np.asarray(values).tobytes()


@pytest.mark.parametrize("ranks", [1, 3])
def test_sums_are_those_of_the_nodes(ranks: int) -> None:
    """The sums include the whole part, the nodes that start in a box, and the nodes that are beyond a plane at
    present; the body spins and moves."""
    box: dict[str, Any] = {"low": (-1.0, -1.0, -1.0), "high": (1.0, 1.5e-3, 1.0)}
    probes = [probe(field) for field in FIELDS]
    probes += [probe(field, f"box_{field}", **box) for field in FIELDS]
    probes += [probe(field, f"beyond_{field}", beyond=PLANE) for field in FIELDS]
    probes += [probe(field, beyond=PLANE) for field in ("residual_velocity", "residual_mass")]
    nowhere = {**PLANE, "at": -1.0}
    probes += [probe(field, f"no_{field}", beyond=nowhere) for field in ("residual_velocity", "residual_mass")]
    spin = {"rate": (3e4, 2e4, -5e4), "centre": (1e-3, 1e-3, 1e-3)}
    case = scene(STEEL, end=1e-6, velocity=(-300.0, 40.0, 90.0), spin=spin, probes=tuple(probes))

    def work(sim: Simulation) -> tuple[bytes, Floats, "np.ndarray", Floats, Floats, Floats]:
        step.prepare(sim)
        for _ in range(8):
            tick(sim)
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        v, nodes = step.between(sim, before), sim.model.nodes
        own = nodes.owned
        found = sim.probes.measure(v)
        sim.free()
        return bits(found), found, nodes.id[own], nodes.mass[own], nodes.x[own], v[own]

    measured = on(ranks, case, [MESH], work)
    assert len({each[0] for each in measured}) == 1
    found = measured[0][1]
    ids = np.argsort(np.concatenate([each[2] for each in measured]))
    m, x, v = (np.concatenate([each[k] for each in measured])[ids] for k in (3, 4, 5))
    flags = [np.ones(len(m), bool), MESH.points[:, 1] <= 1.501e-3, x[:, 0] < PLANE["at"]]
    assert 10 < flags[2].sum() < len(m) - 10
    expected = np.concatenate([totals(m[some], x[some], v[some]) for some in flags])
    assert found[: len(expected)] == pytest.approx(expected, rel=1e-12)
    beyond = flags[2]
    assert found[-4:] == pytest.approx(
        [-(m * v[:, 0])[beyond].sum() / m[beyond].sum(), m[beyond].sum(), 0.0, 0.0], rel=1e-12
    )


def test_sums_of_any_ranks_are_the_same_bits() -> None:
    fields = ("kinetic_energy", "momentum_x", "centre_y")
    case = scene(STEEL, velocity=(3.0, 1.0, 2.0), jitter=5.0, probes=tuple(probe(field) for field in fields))
    found = [on(n, case, [MESH], lambda sim: bits(sim.probes.measure()))[0] for n in (1, 2, 4)]
    assert len(set(found)) == 1


@pytest.mark.parametrize("ranks", [1, 3])
def test_peaks_are_the_largest_values_of_the_tets(ranks: int) -> None:
    """The measured tets are all tets of the part, or the tets that start in a box. The body starts with random
    velocities that exceed the speed at which it yields."""
    fields = ("pressure_max", "pressure_min", "mises_max", "plastic_strain_max", "temperature_max", "damage_max")
    box: dict[str, Any] = {"low": (-1.0, 1.5e-3, -1.0), "high": (1.0, 1.0, 1.0)}
    probes = [probe(field) for field in fields] + [probe(field, f"box_{field}", **box) for field in fields]
    case = scene(COPPER, end=1e-5, jitter=300.0, temperature=350.0, probes=tuple(probes))

    def work(sim: Simulation) -> tuple[bytes, Floats, "np.ndarray", Floats]:
        step.prepare(sim)
        for _ in range(20):
            tick(sim)
        found, tets = sim.probes.measure(), sim.model.blocks[0]
        pressure = tets.row(rows.PRESSURE) + tets.row(rows.VISCOUS)
        s = np.array([tets.row(row) for row in range(rows.S_XX, rows.S_XY + 1)])
        mises = np.sqrt(1.5 * ((s[:3] ** 2).sum(axis=0) + 2.0 * (s[3:] ** 2).sum(axis=0)))
        values = np.array([pressure, -pressure, mises, tets.row(rows.PLASTIC_STRAIN)])
        inside = sim.model.nodes.x0[tets.tets].mean(axis=1)[:, 1] >= 1.499e-3
        sim.free()
        return bits(found), found, inside, values

    measured = on(ranks, case, [MESH], work)
    assert len({each[0] for each in measured}) == 1
    values, inside = (
        np.concatenate([each[3] for each in measured], axis=1),
        np.concatenate([each[2] for each in measured]),
    )
    assert (values.max(axis=1) > values[:, inside].max(axis=1)).any()
    assert values[3].min() > 0.0
    for found, some in ((measured[0][1][:6], values), (measured[0][1][6:], values[:, inside])):
        expected = [*(some.max(axis=1) * (1.0, -1.0, 1.0, 1.0)), 350.0, 0.0]
        assert found.tolist() == pytest.approx(expected, rel=1e-12)


def _pushes(parts: int) -> tuple[schema.Probe, ...]:
    names = [f"body{i}" for i in range(parts)]
    pairs = [
        probe(f"contact_{kind}_{a}", f"{kind}_{one}_{other}_{a}", one, by=other)
        for kind in ("force", "impulse") for one in names for other in names if one != other for a in "xyz"
    ]  # fmt: skip
    return (*pairs, *(probe(f"contact_impulse_{a}", f"all_{one}_{a}", one) for one in names for a in "xyz"))


def _three() -> tuple[schema.Case, list[TetMesh]]:
    case = meeting_of(
        [{}, {"velocity": (-80.0, 10.0, 0.0)}, {"velocity": (5.0, -90.0, 0.0)}], {"friction": 0.3}, end=2e-6,
        probes=_pushes(3),
    )  # fmt: skip
    second = moved(block((2, 2, 2), SIZE, seed=2), (3.0 * SIZE, 0.4 * SIZE, 0.6 * SIZE))
    third = moved(block((2, 2, 2), SIZE, seed=3), (1.5 * SIZE, 3.0 * SIZE, 0.6 * SIZE))
    return case, [block((3, 3, 3), SIZE, seed=1), second, third]


@pytest.mark.parametrize("ranks", [1, 3])
def test_the_impulse_between_parts_is_the_change_of_momentum(ranks: int, tmp_path: Path) -> None:
    """The impulses of two parts on each other are equal and opposite to the bit. The sum over all partners is the
    change of momentum, also after a checkpoint."""
    case, meshes = _three()

    def momenta(sim: Simulation) -> Floats:
        nodes = sim.model.nodes
        p = (nodes.mass * nodes.owned)[:, None] * nodes.v
        return np.asarray([p[nodes.part == part].sum(axis=0) for part in range(3)])

    def work(sim: Simulation) -> tuple[Floats, Floats, Floats, float]:
        step.prepare(sim)
        first, forces, last = momenta(sim), np.zeros(18), 0.0
        for k in range(40):
            if k == 20:
                sim = kept_again(sim, case, tmp_path / str(ranks))
            step.first_half(sim)
            if k % 6 == 5 or k == 39:
                values, t = sim.probes.measure(), sim.clock.t
                forces, last = forces + values[:18] * (t - last), t
            step.second_half(sim)
        changed = momenta(sim) - first
        sim.free()
        return values, forces, changed, last

    measured = on(ranks, case, meshes, work)
    values, forces, _, _ = measured[0]
    assert len({bits(each[0]) for each in measured}) == 1
    changed = np.sum([each[2] for each in measured], axis=0)
    impulses = np.zeros((3, 3, 3))
    order = [(one, other) for one in range(3) for other in range(3) if one != other]
    for (one, other), impulse in zip(order, values[18:36].reshape(6, 3), strict=True):
        impulses[one, other] = impulse
    assert (impulses == -impulses.transpose(1, 0, 2)).all()
    largest = np.abs(impulses).max()
    assert all(np.abs(impulses[one, other]).max() > 1e-3 * largest for one, other in ((0, 1), (0, 2)))
    assert np.abs(impulses.sum(axis=1) - values[36:].reshape(3, 3)).max() < 1e-10 * largest
    assert np.abs(impulses.sum(axis=1) - changed).max() < 1e-9 * largest
    assert np.abs(forces - values[18:36]).max() < 1e-12 * largest


def test_pushes_of_parts_are_the_same_bits_on_any_ranks() -> None:
    case, meshes = _three()

    def work(sim: Simulation) -> bytes:
        step.prepare(sim)
        for _ in range(25):
            tick(sim)
        found = bits(sim.probes.measure())
        sim.free()
        return found

    assert len({each for n in (1, 2, 4) for each in on(n, case, meshes, work)}) == 1


def test_no_pairs_are_booked_without_a_probe_of_them() -> None:
    case, meshes = _three()
    sim = build(case.model_copy(update={"probes": ()}), meshes)
    assert sim.contact is not None
    assert sim.contact.books.pairs.size == 0
    assert sim.probes._gauges == []


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_hole_is_as_wide_as_what_the_rays_are_free_to_go(ranks: int) -> None:
    """The hole is a quarter of a ring that is stretched to an ellipse; rays in the other three quarters are omitted."""
    line: dict[str, Any] = {"axis": "z", "at": 0.4e-3}
    case = scene(COPPER, probes=(probe("hole_width", **line), probe("hole_diameter", **line)))
    mesh = ring(2, 24, 10e-3, 14e-3, 1e-3)

    def work(sim: Simulation) -> Floats:
        found = [sim.probes.measure()]
        sim.model.nodes.x[:, 0] *= 1.4
        found.append(sim.probes.measure())
        sim.free()
        return np.array(found)

    measured = on(ranks, case, [mesh], work)
    assert len({bits(each) for each in measured}) == 1
    flat = np.cos(np.pi / 96.0)
    area = 24.0 * 0.5 * np.sin(np.pi / 48.0)  # area of the polygon that replaces a quarter circle of radius 1
    width, diameter = 20e-3, 20e-3 * math.sqrt(area / (np.pi / 4.0))
    assert measured[0][0] == pytest.approx([width * flat, diameter], rel=1e-3)
    assert measured[0][1] == pytest.approx([width, diameter * math.sqrt(1.4)], rel=2e-3)
    assert measured[0][1][0] == pytest.approx(20e-3, rel=1e-3)


def test_rays_are_as_long_as_the_way_to_the_first_tet() -> None:
    """The lengths are compared with points on each ray that lie in a tet, for a rotated block and for lines that
    pass it."""
    mesh = moved(block((4, 4, 2), SIZE, seed=7), (1e-3, -2e-3, 0.0))
    for origin in (np.array([0.0, 0.0, 0.7e-3]), np.array([3e-3, 0.1e-3, 1.0e-3]), np.array([2e-3, 0.0, 5e-3])):
        found = rays.reach(mesh.points, mesh.tets.astype(np.uint32), origin, 2)
        for k, way in list(enumerate(rays.directions(2)))[::20]:
            steps = np.linspace(0.0, 8e-3, 4001)
            at = origin + steps[:, None] * way
            inside = ((at > [1e-3, -2e-3, 0.0]) & (at < [5e-3, 2e-3, 2e-3])).all(axis=1)
            if not inside.any():
                assert found[k] > 7.9e-3
            else:
                assert found[k] == pytest.approx(steps[inside][0], abs=4e-6)


@pytest.mark.parametrize("ranks", [1, 3])
def test_a_cone_has_the_angle_of_the_areas_that_have_left(ranks: int) -> None:
    plate = block((16, 16, 4), 0.5e-3, shake=0.0)
    centre = plate.points[plate.tets].mean(axis=1)
    far = np.hypot(centre[:, 0] - 4e-3, centre[:, 1] - 4e-3)
    gone = np.flatnonzero(far < 1e-3 + centre[:, 2] * math.tan(math.radians(35.0)))
    case = scene(
        COPPER, end=1e-6, erosion=schema.Erosion(plastic_strain=5.0),
        probes=(probe("cone_angle", axis="z", centre=(4e-3, 4e-3, 0.0)),),
    )  # fmt: skip

    def work(sim: Simulation) -> Floats:
        step.prepare(sim)
        found = [sim.probes.measure()[0]]
        tick(sim)
        tick(sim, gone)
        found.append(sim.probes.measure()[0])
        sim.free()
        return np.array(found)

    measured = on(ranks, case, [plate], work)
    assert len({bits(each) for each in measured}) == 1
    assert measured[0][0] == 0.0
    radii = []
    for height in (0.0, 2e-3):
        on_face = (np.abs(plate.points[plate.tets][:, :, 2] - height) < 1e-9).sum(axis=1) == 3
        radii.append(math.sqrt(np.isin(np.flatnonzero(on_face), gone).sum() * 0.125e-6 / math.pi))
    assert measured[0][1] == pytest.approx(2.0 * math.atan((radii[1] - radii[0]) / 2e-3), rel=1e-12)
    assert math.degrees(measured[0][1]) == pytest.approx(
        70.0, abs=8.0
    )  # the hole takes half a cube, and four cubes are through the plate


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_heaviest_fragment_beyond_a_plane_is_found(ranks: int) -> None:
    """A bar that loses two layers consists of three pieces; the last two pieces are beyond the plane."""
    bar = block((12, 2, 2), SIZE, shake=0.0)
    centre = bar.points[bar.tets].mean(axis=1)[:, 0] / SIZE
    gone = np.flatnonzero(((centre > 4.0) & (centre < 5.0)) | ((centre > 6.0) & (centre < 7.0)))
    beyond = {"axis": "x", "at": 4.5e-3}
    probes = tuple(probe(field, beyond=beyond) for field in ("fragment_velocity", "fragment_mass"))
    case = scene(COPPER, erosion=schema.Erosion(plastic_strain=5.0), contact=schema.Contact(), probes=probes)

    def work(sim: Simulation) -> Floats:
        step.prepare(sim)
        found = [sim.probes.measure()]
        tick(sim)
        tick(sim, gone)
        nodes = sim.model.nodes
        nodes.v[:] = 0.0
        nodes.v[:, 0] = np.where(nodes.x[:, 0] > 6.5e-3, 7.0, 3.0)
        found.append(sim.probes.measure())
        sim.free()
        return np.array(found)

    measured = on(ranks, case, [bar], work)
    assert len({bits(each) for each in measured}) == 1
    whole, pieces = measured[0]
    assert whole.tolist() == [0.0, pytest.approx(8930.0 * 48e-9)]
    assert pieces == pytest.approx([7.0, 8930.0 * 20e-9], rel=1e-12)


@pytest.mark.parametrize(
    ("keys", "key", "says"),
    [
        ({"field": "mass", "axis": "z"}, "probes[0].axis", "mass does not use this key"),
        ({"field": "hole_width", "axis": "z"}, "probes[0].at", "hole_width needs it"),
        ({"field": "residual_velocity"}, "probes[0].beyond", "residual_velocity needs it"),
        ({"field": "contact_force_x", "by": "bar"}, "probes[0].by", "is the part itself"),
        ({"field": "contact_force_x", "by": "bat"}, "probes[0].by", "no part of this name"),
        ({"field": "momentum_x", "by": "bar"}, "probes[0].by", "momentum does not use this key"),
        ({"field": "cone_angle", "axis": "z"}, "probes[0].field", "the case has neither damage, fracture nor erosion"),
        ({"field": "penetration", "axis": "z", "low": [0, 0, 0], "high": [1, 1, 1]}, "probes[0]", "whole part"),
        ({"field": "wall_impulse_x"}, "probes[0].field", "the case has no wall"),
        ({"field": "wall_position_x", "part": None, "wall": "w"}, "probes[0].field", "the case has no wall"),
        ({"field": "wall_velocity_x", "part": None}, "probes[0].wall", "wall_velocity needs it"),
        ({"field": "wall_velocity_x", "wall": "w"}, "probes[0].part", "is that of a wall; remove part"),
        ({"field": "mass", "part": None}, "probes[0].part", "this key is missing; mass needs it"),
    ],
)
def test_keys_of_probes_are_checked(keys: dict[str, Any], key: str, says: str) -> None:
    bar = {"shape": "box", "low": [0, 0, 0], "high": [1, 1, 1], "element_size": 0.5}
    stone = {"density": 2700, "elastic": {"young": 60e9, "poisson": 0.2}}
    data = {
        "name": "x", "run": {"end_time": 1e-6}, "parts": [{"name": "bar", "material": "stone", "mesh": bar}],
        "materials": {"stone": stone},
        "probes": [{key: value for key, value in {"name": "p", "part": "bar", **keys}.items() if value is not None}],
    }  # fmt: skip
    with pytest.raises(CaseError) as error:
        parse_case(data)
    assert any(each.key == key and says in each.message for each in error.value.problems)


def test_walls_report_their_impulses() -> None:
    floor = {"kind": "wall", "point": (-1e-6, 0, 0), "normal": (1, 0, 0)}
    probes = (probe("wall_impulse_x"), probe("momentum_x"))
    sim = build(scene(STEEL, end=1e-6, velocity=(-60.0, 0.0, 0.0), boundaries=(floor,), probes=probes), [MESH])
    start = float(sim.model.nodes.mass.sum()) * -60.0
    found = []
    run(sim, lambda sim, _: found.append(sim.probes.measure(sim.model.nodes.v)))
    for impulse, momentum in found:
        assert impulse == pytest.approx(momentum - start, rel=1e-9, abs=1e-12)
    assert found[-1][0] > 0.1 * -start
