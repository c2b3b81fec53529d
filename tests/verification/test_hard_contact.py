"""H12, H14, H15, H16: difficult contacts, and the shock of an impact."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from conoid.cases.load import apply_overrides, parse_case, read_data, shipped
from conoid.cases.model import materials
from conoid.cases.model.schema import Case
from conoid.cases.reading.library import library
from conoid.worker import simulation, step
from conoid.worker.contact.checks import common_volume
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..bench import dust
from ..contact.bodies import meeting_of, moved, rotation, sheet
from ..contact.distances import point_triangle
from ..contact.kernels import Solver, every_pair, node_face
from ..worker.kernels import Floats, build, run, scene
from ..worker.meshes import REGULAR, block

SIZE = 1e-3


def depth(sim: Simulation) -> float:
    """Returns the depth of the deepest node inside another part below the surface of this part, m, for two parts on one
    rank.
    """
    assert sim.contact is not None
    x, part = sim.model.nodes.x, sim.model.nodes.part
    faces = sim.contact.exterior.motion.sides.faces.nodes[:, :3]
    deepest = 0.0
    for body in sim.model.blocks:
        others, mine = x[np.unique(faces[part[faces[:, 0]] != body.part])], x[part == body.part]
        near = others[((others > mine.min(axis=0)) & (others < mine.max(axis=0))).all(axis=1)]
        corners = x[body.tets]
        shares = (near[:, None, None] - corners[None, :, :1]) @ np.linalg.inv(corners[:, 1:] - corners[:, :1])
        inside = near[((shares[:, :, 0].min(axis=2) > 0.0) & (shares[:, :, 0].sum(axis=2) < 1.0)).any(axis=1)]
        if len(inside):
            away = point_triangle(inside, x[faces[part[faces[:, 0]] == body.part]])
            deepest = max(deepest, float(away.min(axis=1).max()))
    return deepest


# H12, V19: a node slides from facet to facet --------------------------------------------------------------------------

CELLS = 8


def facets(shake: float, fold: float = 0.0) -> tuple[Floats, "np.ndarray"]:
    """Returns a sheet of irregular facets of 1 m, and their faces; beyond its middle the sheet rises with the slope
    ``fold``."""
    x, faces = sheet(CELLS, 1.0)
    inner = ((x[:, :2] > 0.0) & (x[:, :2] < CELLS)).all(axis=1) & (x[:, 0] != CELLS / 2)
    x[inner, :2] += np.random.default_rng(5).uniform(-shake, shake, (int(inner.sum()), 2))
    x[:, 2] += fold * np.maximum(x[:, 0] - CELLS / 2, 0.0)
    return x, np.column_stack([faces, np.full(len(faces), len(x))]).astype(np.int32)


class Slide:
    """Nodes of 1 kg on a rigid sheet under a load of 1 m/s^2, in steps of 1 s."""

    def __init__(self, ground: Floats, faces: "np.ndarray", start: Floats, v: Floats) -> None:
        self.x = np.concatenate([ground, [[0.0, 0.0, -5.0]], start])
        self.v = np.concatenate([np.zeros((len(ground) + 1, 3)), v])
        self.faces, self.first = faces, len(ground) + 1
        self.mobility = np.zeros_like(self.x)
        self.mobility[self.first :] = 1.0

    @property
    def nodes(self) -> tuple[Floats, Floats]:
        """Positions and velocities of the nodes."""
        return self.x[self.first :], self.v[self.first :]

    def step(self, load: float, friction: float = 0.0) -> Floats:
        """Returns (n, 3) the impulses of contact, N s."""
        self.v[self.first :, 2] -= load
        before = self.v.copy()
        tested = np.arange(self.first, len(self.x))
        met = node_face(
            self.x, self.v, self.faces, every_pair(tested, len(self.faces)), 1.0, mu=np.full((2, 2), friction)
        )
        self.v = Solver(met, self.v, self.mobility, 2.0**50).sweep(5)
        self.x += self.v
        return np.asarray(self.v - before)[self.first :]


def travellers(n: int, speed: float) -> tuple[Floats, Floats]:
    """Returns start positions on the sheet and velocities; some nodes move along edges and through the nodes of the
    sheet.
    """
    random = np.random.default_rng(2)
    start, angle = random.uniform(2.5, CELLS - 2.5, (n, 2)), random.uniform(0.0, 2.0 * np.pi, n)
    start[: n // 2] = np.round(start[: n // 2])
    angle[: n // 3] = np.round(angle[: n // 3] / (np.pi / 4)) * (np.pi / 4)
    way = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])
    return np.column_stack([start, np.zeros(n)]), speed * way


@pytest.mark.parametrize("shake", [0.0, 0.2])
@pytest.mark.parametrize("speed", [0.037, 0.41])
def test_a_node_slides_over_edges_and_vertices_as_on_a_plane(speed: float, shake: float) -> None:
    """The node always has exactly one contact: every step returns the load, to round-off, and no force along the
    plane.
    """
    load = 1e-3 * speed
    slide = Slide(*facets(shake), *travellers(120, speed))
    v = slide.nodes[1].copy()
    for _ in range(int(2.0 / speed)):
        pushed = slide.step(load)
        assert np.abs(pushed - [0.0, 0.0, load]).max() < 1e-9 * load + 1e-14
    assert np.abs(slide.nodes[0][:, 2]).max() < 1e-12
    assert np.abs(slide.nodes[1] - v).max() < 1e-12 * speed


def test_friction_slows_it_down_evenly() -> None:
    """The deceleration is mu N / m in every step, for all facets that the node passes; the velocity never changes
    its sign."""
    speed, load, mu = 0.1, 1e-2, 0.3
    slide = Slide(*facets(0.2), *travellers(120, speed))
    way = slide.nodes[1] / speed
    for _ in range(20):
        pushed = slide.step(load, mu)
        assert np.abs(pushed + mu * load * way - [0.0, 0.0, load]).max() < 1e-9 * load
    assert np.abs(slide.nodes[1] - (speed - 20 * mu * load) * way).max() < 1e-9 * speed
    for _ in range(20):
        slide.step(load, mu)
    assert np.abs(slide.nodes[1]).max() < 1e-9 * speed


@pytest.mark.parametrize("slope", [0.3, -0.3])
def test_where_the_ground_rises_only_the_normal_part_is_lost_and_where_it_falls_nothing(slope: float) -> None:
    """In a fold without a load the node loses v . n, except the tenth that contact may give back for a penetration.
    Over a ridge the node continues along a straight line, without a contact force."""
    start, v = travellers(120, 0.2)
    start[:, 0], v[:, 0] = CELLS / 2 - 0.5, np.abs(v[:, 0]) + 0.05
    slide = Slide(*facets(0.0, slope), start, v)
    pushes = np.zeros(120)
    for _ in range(12):
        pushes += np.abs(slide.step(0.0)).max(axis=1) > 1e-12
    normal = np.array([-slope, 0.0, 1.0]) / np.hypot(slope, 1.0)
    lost = np.minimum(v @ normal, 0.0)[:, None] * normal
    done = slide.nodes[0][:, 0] > CELLS / 2 + 0.3
    assert done.sum() > 50
    assert (np.abs(slide.nodes[1] - (v - lost)).max(axis=1) <= 0.1 * np.abs(lost).max(axis=1))[done].all()
    assert (slide.nodes[0] @ normal)[done].min() > CELLS / 2 * normal[0] - 1e-3
    assert pushes.max() == 0.0 or slope > 0.0


# H14: heavy on light bodies, fine on coarse meshes --------------------------------------------------------------------

HEAVY = materials.Material(density=17300.0, elastic=materials.Elastic(young=360e9, poisson=0.28))
LIGHT = materials.Material(density=2500.0, elastic=materials.Elastic(young=72e9, poisson=0.22))


@pytest.mark.parametrize("tilt", [0.0, 0.2])
@pytest.mark.parametrize("heavy_is_fine", [True, False])
def test_nothing_sinks_in_where_masses_differ_by_a_factor_of_fifty(heavy_is_fine: bool, tilt: float) -> None:
    """Tungsten alloy hits glass at 100 m/s, flat and with a corner, with element sizes 1:2. The penetration is below 1
    % of the smaller element."""
    coarse = block((5, 5, 4), SIZE, seed=2)
    fine = moved(block((6, 6, 6), SIZE / 2, seed=1), (0.0, 0.0, 0.0), rotation((1, 2, 0), tilt))
    fine = moved(fine, (0.9 * SIZE, 1.1 * SIZE, 4.001 * SIZE - fine.points[:, 2].min()))
    case = meeting_of([{"velocity": (0.0, 0.0, -100.0)}, {}], {}, end=2e-6, viscosity={})
    parts = (case.parts[0], case.parts[1].model_copy(update={"material": "other"}))
    metals = (HEAVY, LIGHT) if heavy_is_fine else (LIGHT, HEAVY)
    materials = dict(zip(("metal", "other"), metals, strict=True))
    sim = build(case.model_copy(update={"materials": materials, "parts": parts}), [fine, coarse])
    deepest = [0.0]

    def look(sim: Simulation, before: Floats) -> None:
        sim.ledger.close(before)
        if sim.clock.step % 4 == 0:
            deepest.append(depth(sim))

    run(sim, look)
    assert sim.contact is not None
    assert sim.contact.impulses()[1, 2] < 0.0
    assert max(deepest) < 0.01 * SIZE / 2
    assert sim.ledger.worst < 1e-3


# H15: fast bodies -----------------------------------------------------------------------------------------------------


def test_a_fragment_of_five_kilometres_a_second_sinks_in_little() -> None:
    """The shipped case is checked step by step: impulse and momentum agree, and no node is deeper than 1 % of an
    element."""
    case = parse_case(apply_overrides(read_data(shipped()["fast_fragment"]), ["run.frames=0"]))
    sim = simulation.build(case, Path(), SerialComm())
    assert sim.contact is not None
    nodes, deepest = sim.model.nodes, [0.0]
    plate, fragment = (nodes.part == part for part in (0, 1))
    start = (nodes.mass * nodes.v[:, 2])[fragment].sum()

    def look(sim: Simulation, before: Floats) -> None:
        sim.ledger.close(before)
        deepest.append(depth(sim))

    run(sim, look)
    pushed = sim.contact.impulses()
    assert np.abs(pushed.sum(axis=0)).max() < 1e-9 * -start
    assert (nodes.mass * nodes.v[:, 2])[plate].sum() == pytest.approx(pushed[0, 2], rel=1e-6)
    assert 1.0 < pushed[0, 2] / start < 2.0
    assert sim.ledger.worst < 0.01
    assert max(deepest) < 0.01 * 0.3e-3


PLATE = np.array([4.0, 4.0, 1.0]) * SIZE


class Shot:
    """A tet of any size and direction moves at 1 to 50 km/s past or into a plate of one layer of tets."""

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.speed = 10.0 ** random.uniform(3.0, 4.7)
        self.way = random.normal(size=3)
        self.way /= np.linalg.norm(self.way)
        turn = rotation(tuple(random.normal(size=3)), random.uniform(0.0, np.pi))
        corners = (REGULAR - REGULAR.mean(axis=0)) @ turn.T * SIZE * 10.0 ** random.uniform(-0.5, 0.5)
        start = random.uniform(-0.6, 1.6, 3) * PLATE - random.uniform(11.0, 13.0) * SIZE * self.way
        self.drift = 300.0 * random.normal(size=3)
        self.meshes = [block((4, 4, 1), SIZE, seed=seed), TetMesh(corners + start, np.array([[0, 1, 2, 3]], np.int32))]

    def way_in(self, larger: float = 1.0) -> float | None:
        """Returns the exact distance, m, that the tet moves until it touches the plate, with both bodies scaled by
        ``larger``. The two bodies touch where the ray from the origin enters the hull of all differences of their
        corners.
        """
        box = np.stack(np.meshgrid(*np.column_stack([np.zeros(3), PLATE]), indexing="ij"), axis=-1).reshape(-1, 3)
        middle, centre = PLATE / 2, self.meshes[1].points.mean(axis=0)
        box, tet = middle + larger * (box - middle), centre + larger * (self.meshes[1].points - centre)
        planes = ConvexHull((box[:, None] - tet[None]).reshape(-1, 3) / SIZE).equations
        rate, off = planes[:, :3] @ self.way, planes[:, 3]
        begin = np.max(-off[rate < 0.0] / rate[rate < 0.0], initial=0.0)
        end = np.min(-off[rate > 0.0] / rate[rate > 0.0], initial=np.inf)
        return float(begin) * SIZE if begin < end else None

    def fly(self) -> tuple[float, float] | None:
        """Returns the distance that the tet has moved, m, before and after the step in which it first gets an impulse;
        None without an impulse."""
        motions: list[dict[str, Any]] = [
            {"velocity": tuple(self.drift + v)} for v in (0.0 * self.way, self.way * self.speed)
        ]
        sim = build(meeting_of(motions), self.meshes)
        assert sim.contact is not None
        step.prepare(sim)
        while sim.clock.t * self.speed < 25.0 * SIZE:
            step.first_half(sim)
            if np.abs(sim.contact.impulses()).max() > 0.0:
                return sim.clock.t * self.speed, (sim.clock.t + sim.clock.dt) * self.speed
            step.second_half(sim)
        return None


def misjudged(seeds: range) -> tuple[int, list[int]]:
    """Returns the number of shots that hit, and the seeds of shots that got an impulse too early, too late or wrongly;
    grazing shots are excluded. A shot is grazing if half a per cent more or less of the size of a body decides whether
    it hits; an error of a hundredth of a face is allowed.
    """
    hits, wrong = 0, []
    for seed in seeds:
        shot = Shot(seed)
        sure, possible = shot.way_in(0.995), shot.way_in(1.005)
        seen = shot.fly()
        hits += sure is not None
        if seen is None:
            ok = sure is None
        else:
            ok = possible is not None and possible - 0.01 * SIZE < seen[1]
            ok &= sure is None or seen[0] < sure + 0.01 * SIZE
        wrong += [] if ok else [seed]
    return hits, wrong


def test_no_shot_misses_what_its_ray_hits() -> None:
    assert misjudged(range(40)) == (23, [])


@pytest.mark.slow
def test_no_shot_of_a_thousand_misses_what_its_ray_hits() -> None:
    hits, wrong = misjudged(range(40, 1040))
    assert hits > 400
    assert wrong == []


def test_a_fast_fragment_makes_no_searches_for_others() -> None:
    """Two bodies collide slowly, with one search in 200 steps; if a tet passes at 5 km/s there is at most one search in
    50 steps."""
    lower, upper = block((12, 12, 12), SIZE, seed=1), block((11, 11, 11), SIZE, seed=2)
    away = TetMesh(REGULAR * SIZE + np.array([-20.0, 16.0, 3.0]) * SIZE, np.array([[0, 1, 2, 3]], np.int32))
    meshes = [lower, moved(upper, (0.4 * SIZE, 0.3 * SIZE, 12.001 * SIZE)), away]
    searches = []
    for speed in (0.0, 5000.0):
        motions: list[dict[str, Any]] = [{"velocity": (0.0, 0.0, v)} for v in (10.0, -10.0)]
        sim = run(build(meeting_of([*motions, {"velocity": (speed, 0.0, 0.0)}], end=4e-6), meshes))
        assert sim.contact is not None
        assert sim.contact.last_push > 0.0
        searches.append(sim.contact.searches.many * 50.0 / sim.clock.step)
    assert searches[0] <= 0.25
    assert searches[1] <= 1.0


def volume_in_common(case: Case) -> common_volume.CommonVolume:
    """Returns the common volume of the bodies at the end, after contact."""
    sim = run(simulation.build(case, Path(), SerialComm()))
    assert sim.contact is not None
    return common_volume.measure(sim.contact, sim.model, None, sim.comm)


@pytest.mark.slow
def test_crossed_blades_do_not_cut_into_each_other() -> None:
    """The blades of this test are one tet thick and collide edge on edge. If contacts of edges between two tets ended
    at 0.05 of their length, 34 tets would end with more than a tenth of their volume in the other blade, 4.9e-3 of the
    volume of all surface tets.
    """
    blade = {"shape": "box", "element_size": 0.5e-3, "generator": "structured"}
    upper = {"low": [-4.8e-3, -0.15e-3, 0.05e-3], "high": [5.2e-3, 0.35e-3, 5.05e-3]}
    lower = {"low": [-5e-3, -0.25e-3, -5e-3], "high": [5e-3, 0.25e-3, 0]}
    case = parse_case(
        {
            "name": "blades", "run": {"end_time": 20e-6, "frames": 0}, "numerics": {"pressure": "standard"},
            "parts": [
                {"name": name, "material": "steel_1006", "velocity": [0, 0, speed], "mesh": {**blade, **box}, **turn}
                for name, speed, box, turn in (
                    ("upper", -600, upper, {}), ("lower", 0, lower, {"turn": {"axis": "z", "angle": "60 deg"}}),
                )
            ],
        }
    )  # fmt: skip
    common = volume_in_common(case)
    assert common.share < 1e-4
    assert common.large == 0


def test_a_fine_plate_does_not_fold_into_the_rim_of_a_coarse_punch() -> None:
    """The only sharp edges in front of the rim are the edges of the plate that the rim bends by 5 to 25 degrees.
    Without contact of the sharp edges in front of the rim, 54 tets ended with more than a tenth of their volume in the
    punch, 4.8e-4 of the volume of all surface tets, and 7 nodes were 0.22 of a face deep.
    """
    round_ = {"shape": "cylinder", "axis": "z", "sector": "quarter"}
    punch = {"base": [0, 0, 0.01e-3], "radius": 2e-3, "length": 6e-3, "element_size": 0.6e-3}
    plate = {"base": [0, 0, -1.5e-3], "radius": 8e-3, "length": 1.5e-3, "element_size": 0.22e-3}
    graded = {"grading": {"axis": "z", "near": 2.6e-3, "far": 8e-3, "far_size": 0.9e-3}}
    plate_steel = library()["weldox_460e"].model_dump()
    plate_steel["strength"]["damage"]["softening"] = 0.0  # the rim presses on the plate with full strength
    case = parse_case(
        {
            "name": "rim", "run": {"end_time": 1.7e-6, "frames": 0},
            "boundaries": [{"kind": "symmetry", "axis": axis, "at": 0} for axis in "xy"],
            "parts": [
                {"name": name, "material": metal, "velocity": [0, 0, speed], "mesh": {**round_, **mesh}}
                for name, metal, speed, mesh in (
                    ("punch", "steel_4340", -400, punch), ("plate", "plate", 0, {**plate, **graded}),
                )
            ],
            "materials": {"plate": plate_steel},
        }
    )  # fmt: skip
    common = volume_in_common(case)
    assert common.share < 1e-4
    assert common.large == 0


@pytest.mark.parametrize(
    ("metal", "speed"),
    [
        ("steel_4340", 1500.0),
        ("aluminium_2024", 2000.0),
        ("tungsten_alloy", 1500.0),
        ("aluminium_2024", 4000.0),
        ("copper_ofhc", 4000.0),
    ],
)
def test_columns_of_metal_hold_each_other_under_a_shock(metal: str, speed: float) -> None:
    """The columns are between planes of symmetry, with irregular tets and averaged pressure: behind the shock no node
    is faster than before the impact. In an earlier version nodes of the interface became faster than the columns, and
    tets were crushed, at ridges of faces that were flat at the start. At 4 km/s tets were crushed also with five
    sweeps.
    """
    cube = {"shape": "box", "element_size": 0.5e-3, "generator": "gmsh"}
    case = parse_case(
        {
            "name": "columns", "run": {"end_time": 1.5e-6, "frames": 0},
            "parts": [
                {
                    "name": name, "material": metal, "velocity": [0, 0, sign * speed / 2],
                    "mesh": {**cube, "low": [0, 0, low], "high": [1e-3, 1e-3, low + 4e-3]},
                }
                for name, sign, low in (("below", 1, -4e-3), ("above", -1, 0.0))
            ],
            "boundaries": [{"kind": "symmetry", "axis": axis, "at": at} for axis in "xy" for at in (0.0, 1e-3)],
        }
    )  # fmt: skip
    fastest: list[float] = []

    def watch(sim: Simulation, before: Floats) -> None:
        if sim.clock.t < 0.6e-6:
            fastest.append(float(np.linalg.norm(before, axis=1).max()))

    sim = run(simulation.build(case, Path(), SerialComm()), watch)
    assert max(fastest) < 1.02 * speed / 2
    assert sim.ledger.worst < 1e-3


def test_irregular_plates_keep_the_pressure_of_their_impact() -> None:
    """Copper hits copper at 1 km/s: the pressure is rho0 (c0 + S u) u with u = 500 m/s, behind the shock and at the
    interface. In an earlier version ridges of faces that were flat at the start penetrated each other; overlapping
    material has no pressure, and the interface lost a quarter of its pressure.
    """
    copper = library()["copper_ofhc"]
    assert copper.eos is not None
    pressure = copper.density * (copper.eos.c0 + copper.eos.S * 500.0) * 500.0
    square = {"shape": "box", "element_size": 0.1e-3, "generator": "gmsh"}
    case = parse_case(
        {
            "name": "plates", "run": {"end_time": 0.35e-6, "frames": 0},
            "parts": [
                {
                    "name": name, "material": "copper_ofhc", "velocity": [0, 0, speed],
                    "mesh": {**square, "low": [0, 0, low], "high": [0.2e-3, 0.2e-3, high]},
                }
                for name, speed, low, high in (("flyer", 1000.0, -2e-3, 0.0), ("target", 0.0, 0.0, 3e-3))
            ],
            "boundaries": [{"kind": "symmetry", "axis": axis, "at": at} for axis in "xy" for at in (0.0, 0.2e-3)],
        }
    )  # fmt: skip
    sim = run(simulation.build(case, Path(), SerialComm()))
    height = np.concatenate([sim.model.nodes.x0[part.tets].mean(axis=1)[:, 2] for part in sim.model.blocks])
    found, mass = (np.concatenate([part.row(k) for part in sim.model.blocks]) for k in (rows.PRESSURE, rows.MASS))
    for low, high in ((-0.6e-3, -0.1e-3), (-0.1e-3, 0.1e-3), (0.1e-3, 0.6e-3)):
        inside = (height > low) & (height < high)
        assert np.average(found[inside], weights=mass[inside]) == pytest.approx(pressure, rel=0.015)


@pytest.mark.parametrize(
    ("name", "speed", "sweeps", "share"),
    [
        ("alumina", 1100.0, None, (0.95, 1.2)), ("alumina", 1100.0, 2, (0.0, 0.9)),
        ("alumina", 200.0, None, (0.95, 1.38)), ("soda_lime", 1200.0, None, (0.95, 1.2)),
    ],
)  # fmt: skip
def test_brittle_parts_keep_the_pressure_of_the_impact(
    name: str, speed: float, sweeps: int | None, share: tuple[float, float]
) -> None:
    """The pressure is between that of broken and of intact bodies (1.38 times as large), and near that of broken bodies
    if all material has broken. Above a tenth of the wave speed only 0.44 of the pressure is left with two sweeps, so
    the test can fail. At 200 m/s 0.6 of the lower pressure is left if contacts at cracks start from zero in every step.
    In glass 0.72 of the pressure is left if edges with one face at a closed crack have no contact with other edges.
    """
    low, high = share
    found = dust.measure(dust.flyer(name, speed, sweeps, wide=0.3e-3, long=(1.5e-3, 1.5e-3), end=0.15e-6), 0.07e-6)
    broken, _ = dust.expected(name, speed)
    assert low < found.pressure / broken < high


# H16: the shock of an impact ------------------------------------------------------------------------------------------


def shocked(name: str, viscosity: dict[str, float]) -> Floats:
    """Returns the pressure over that of theory in the layers of a row of 100 cubes, when the shock has passed seventy
    layers."""
    shipped_case = parse_case(read_data(shipped()[name]))
    (metal,), speed = shipped_case.materials.values(), -shipped_case.parts[0].velocity[2]
    assert metal.eos is not None
    front, cells, size = metal.eos.c0 + metal.eos.S * speed, 100, 0.1e-3
    rollers = tuple({"kind": "symmetry", "axis": axis, "at": at} for axis in "xy" for at in (0.0, size))
    wall = {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}
    case = scene(
        metal, end=0.7 * cells * size / front, velocity=(0.0, 0.0, -speed), boundaries=(*rollers, wall),
        viscosity=viscosity,
    )  # fmt: skip
    sim = run(build(case, [block((1, 1, cells), size, 0.0)]))
    (row,) = sim.model.blocks
    layer = (sim.model.nodes.x0[row.tets].mean(axis=1)[:, 2] / size).astype(int)
    total = row.row(rows.MASS) * (row.row(rows.PRESSURE) + row.row(rows.VISCOUS))
    return np.asarray(
        np.bincount(layer, total) / np.bincount(layer, row.row(rows.MASS)) / (metal.density * front * speed)
    )


def where(profile: Floats, level: float) -> float:
    """Returns the interpolated layer at which the front has the given level of pressure."""
    k = int(np.flatnonzero(profile > level)[-1])
    return k + float((profile[k] - level) / (profile[k] - profile[k + 1]))


@pytest.mark.parametrize("name", ["shock_copper", "shock_tungsten"])
def test_a_shock_of_few_elements_does_not_overshoot(name: str) -> None:
    """With the default viscosity (standard form) the overshoot is below 5 % of the jump, and at most five layers lie
    between 5 and 95 % of the jump. A tet of a cube that is cut into six tets has half the length of the cube, so that
    the coefficients 0.06 and 1.5 correspond to 0.03 and 0.4 of a layer.
    """
    profile = shocked(name, {})
    assert profile[5:].max() < 1.05
    assert where(profile, 0.05) - where(profile, 0.95) <= 5.0
    assert profile[20:60].mean() == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("name", ["shock_copper", "shock_tungsten"])
def test_with_the_usual_two_terms_it_overshoots(name: str) -> None:
    """Control of the test: the check of the overshoot fails with only the coefficients 0.06 and 1.5."""
    assert shocked(name, {"shock": 0.0})[5:].max() > 1.15
