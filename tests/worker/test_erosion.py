"""Erosion: energy, mass and momentum balances, update of the surface, particles, and parts and ranks without tets."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest

from conoid.cases.model import materials, schema
from conoid.cases.model.materials import Material
from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.boundaries.mirrors import Mirrors
from conoid.worker.gauges import reference
from conoid.worker.gauges.fields import tet_volumes
from conoid.worker.mesh.faces import across, boundary_faces
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows, state
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import COPPER, COPPER_GAS, FORMS, GLASS, STEEL, STEEL_42CRMO4, Form, build, run
from .meshes import Floats, block, positive
from .simulations import on, tick, wear_out

T = TypeVar("T")
Ints = state.Ints
MM = 1e-3
EROSION = schema.Erosion()
REMOVE = schema.Erosion(nodes="remove")


def alone(
    mesh: TetMesh, erosion: schema.Erosion = EROSION, velocity: Sequence[float] = (0, 0, 0), **keys: Any
) -> Simulation:
    """Returns a case of a single copper body with erosion and without contact."""
    case = meeting_of([{"erosion": erosion, "velocity": velocity}], **{"material": COPPER, **keys})
    return build(case.model_copy(update={"contact": None}), [mesh])


# Balances of energy, mass and momentum


def crash(erosion: schema.Erosion, form: Form, speed: float = 600.0) -> Simulation:
    """Returns two copper blocks that collide and erode at the impact."""
    meshes = [block((4, 4, 4), MM, seed=3), moved(block((5, 5, 3), MM, seed=4), (-0.5 * MM, -0.5 * MM, 4.01 * MM))]
    motions: list[dict[str, Any]] = [{"velocity": (0.0, 0.0, speed), "erosion": erosion}, {"erosion": erosion}]
    return build(meeting_of(motions, material=COPPER, form=form, end=1.5e-6, viscosity={}), meshes)


def nodes_of_tets(sim: Simulation) -> "np.ndarray":
    """Returns flags (nodes,): True if a node has tets."""
    has = np.zeros(sim.model.nodes.n, bool)
    for part in sim.model.blocks:
        has[part.tets] = True
    return has


@pytest.mark.parametrize("nodes", ["strike", "particles", "remove"])
@pytest.mark.parametrize("form", FORMS)
def test_the_accounts_close_while_tets_leave(form: Form, nodes: Any) -> None:
    """The energy balance closes as well as without erosion, momentum is conserved to round-off and mass to the last
    bits (H11).
    """
    sim = crash(schema.Erosion(plastic_strain=0.3, nodes=nodes), form)
    mass, first, elements = sim.model.nodes.mass.copy(), sim.model.nodes.v.copy(), sim.model.elements_global
    momentum = (mass[:, None] * first).sum(axis=0)
    assert sim.erosion is not None
    bare: list[Any] = []

    def look(sim: Simulation, before: Floats) -> None:
        bare.append(~nodes_of_tets(sim))
        line = sim.ledger.close(before)
        assert line.residual < 1e-4
        assert np.abs(sim.ledger.momentum - momentum).max() < 1e-12 * np.abs(momentum).max()
        assert sim.model.elements_global == sum(part.n for part in sim.model.blocks)

    run(sim, look)
    here = ~nodes_of_tets(sim)
    removed = sim.erosion.removed
    assert elements - sim.model.elements_global > 50
    assert here.sum() > 5
    assert not (removed & ~here).any()
    assert sim.ledger.eroded_mass + mass[~removed].sum() == pytest.approx(mass.sum(), rel=1e-15)
    assert not removed.any() if nodes == "particles" else (removed == here).all() or nodes == "strike"
    assert sim.erosion.particles == (here & ~removed).sum()
    assert not sim.model.nodes.v[removed].any()
    assert not sim.model.nodes.force[bare[-2]].any()  # new faces have the time of the last step


def pulled(sim: Simulation, rounds: int = 4) -> tuple[list[float], Simulation]:
    """Returns the residuals of a run in which tets are removed one after the other, from the top."""
    step.prepare(sim)
    found = []
    for k in range(4 * rounds):
        part = sim.model.blocks[0]
        top = sim.model.nodes.x0[part.tets].mean(axis=1)[:, 2] > (3.0 - 0.5 * (k // 4)) * MM
        found.append(tick(sim, part.id[top] if k % 4 == 3 else None))
    return found, sim


SPIN = {"centre": (1.5 * MM, 1.5 * MM, 1.5 * MM), "rate": (4e4, 0.0, 5e4)}


@pytest.mark.parametrize("nodes", ["particles", "remove"])
@pytest.mark.parametrize("form", FORMS)
def test_the_accounts_close_for_a_spinning_body_without_contact(form: Form, nodes: Any) -> None:
    """Test body is a copper cube that spins at its elastic limit: the work, kinetic energy and momentum of removed tets
    leave the model."""
    case = meeting_of([{"erosion": schema.Erosion(nodes=nodes), "spin": SPIN}], material=COPPER, form=form)
    sim = build(case.model_copy(update={"contact": None}), [block((3, 3, 3), MM)])
    momentum = (sim.model.nodes.mass[:, None] * sim.model.nodes.v).sum(axis=0)
    turning = (sim.model.nodes.mass[:, None] * np.cross(sim.model.nodes.x, sim.model.nodes.v)).sum(axis=0)
    largest = (sim.model.nodes.mass[:, None] * np.abs(sim.model.nodes.v)).sum()
    residuals, sim = pulled(sim)
    assert sim.model.elements_global < 120
    assert max(residuals) < 1e-4
    assert np.abs(sim.ledger.momentum - momentum).max() < 1e-12 * largest
    assert sim.ledger.angular_momentum == pytest.approx(turning, rel=1e-12)
    assert (sim.ledger.eroded_mass > 0.0) == (nodes == "remove")


@pytest.mark.parametrize("material", [COPPER_GAS, COPPER, STEEL_42CRMO4])
def test_the_heat_of_eroded_tets_is_counted_if_their_pressure_depends_on_heat(material: Material) -> None:
    """The lower bound of the term ``eroded`` is minus 2 J of viscous heat for each tet, and zero for a pressure without
    heat."""
    sim = alone(block((2, 2, 2), MM), material=material)
    part = sim.model.blocks[0]
    part.state[:, rows.WORK_VISCOUS] = 2.0
    step.prepare(sim)
    tick(sim, part.id[:5].copy())
    assert sim.erosion is not None
    heat = sim.erosion.account.work.total(sim.comm)[-1]
    assert heat == pytest.approx(10.0 if material is COPPER_GAS else 0.0, rel=1e-6)


GRAVITY = {"kind": "gravity", "acceleration": (0.0, 0.0, -1e7)}
DRIVEN = {"kind": "velocity", "z": 100.0, "low": (0.0, 0.0, 2.9 * MM), "high": (1.0, 1.0, 1.0)}
MIRROR = {"kind": "symmetry", "axis": "x"}
WALL = {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}


@pytest.mark.parametrize(
    "bounds",
    [(GRAVITY,), (DRIVEN,), (MIRROR,), (WALL,)],
    ids=["gravity", "driven", "mirror", "wall"],
)
def test_removed_nodes_are_not_moved(bounds: tuple[Any, ...]) -> None:
    """Neither gravity nor a prescribed motion moves removed nodes, and the momentum and the energy of these nodes stay
    as at the time of removal."""
    residuals, sim = pulled(alone(block((3, 3, 3), MM), REMOVE, (0, 0, 100), boundaries=bounds))
    assert sim.erosion is not None
    assert sim.erosion.removed.any()
    assert not sim.model.nodes.v[sim.erosion.removed].any()
    assert max(residuals) < 1e-4


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("far", [1.0, 3.0])
@pytest.mark.parametrize("material", [COPPER, STEEL_42CRMO4, GLASS], ids=["copper", "johnson_cook", "crumbling"])
def test_a_tet_that_turns_inside_out_books_no_work_that_it_has_not_done(
    material: Material, far: float, form: Form
) -> None:
    """A node passes the adjacent tets in one step; the stress of these tets at the end of the step has never acted on a
    node."""
    sim = alone(block((3, 3, 3), MM), form=form, material=material)
    nodes = sim.model.nodes
    node = np.argmin(np.abs(nodes.x0 - 0.9 * MM).sum(axis=1))
    step.prepare(sim)
    nodes.v[node] = far * MM * sim.reduction.limit / 0.9 * np.array([1.0, 0.2, 0.0])
    sim.ledger.initial = float((0.5 * nodes.mass * (nodes.v**2).sum(axis=1)).sum())
    tick(sim)
    volumes = tet_volumes(sim.model.blocks[0].tets, nodes.x)
    assert (volumes < 0.0).sum() > 3
    assert max(tick(sim) for _ in range(3)) < 0.006  # other tets have strains above one in this step


@pytest.mark.parametrize("form", ["standard", "nodal"])
@pytest.mark.parametrize("material", [STEEL, COPPER, COPPER_GAS], ids=["elastic", "copper", "gas"])
def test_the_first_step_has_the_speeds_of_approaching_nodes(material: Material, form: Form) -> None:
    """In this test one node of a cube starts at 10 km/s. Without a limit of the step by the motion of the node, the
    error of the energy was 20 to 209 %."""
    sim = alone(block((3, 3, 3), MM), form=form, material=material, viscosity={})
    nodes = sim.model.nodes
    node = np.argmin(np.abs(nodes.x0 - 0.9 * MM).sum(axis=1))
    nodes.v[node] = 1e4 * np.array([1.0, 0.2, 0.0])
    sim.ledger.initial = 0.5 * float(nodes.mass[node] * (nodes.v[node] ** 2).sum())
    step.prepare(sim)
    assert max(tick(sim) for _ in range(20)) < 0.01


# Surface of the eroding body


def scene_of_two() -> tuple[schema.Case, list[TetMesh]]:
    case = meeting_of(
        [{"erosion": REMOVE}, {"erosion": EROSION, "velocity": (0.0, 0.0, -300.0)}], {"self_contact": ["body0"]}
    )
    return case, [block((3, 3, 3), MM, seed=1), moved(block((2, 2, 3), MM, seed=2), (0.4 * MM, 0.5 * MM, 3.01 * MM))]


def wearing(case: schema.Case, erosion: schema.Erosion) -> schema.Case:
    """Returns the scene with erosion in all parts."""
    parts = tuple(part.model_copy(update={"erosion": erosion}) for part in case.parts)
    return case.model_copy(update={"parts": parts})


def plan(meshes: Sequence[TetMesh], seed: int, rounds: int) -> list[Ints]:
    """Returns the ids of the tets that are removed in each round: single tets, and a whole corner."""
    random = np.random.default_rng(seed)
    tets = sum(len(mesh.tets) for mesh in meshes)
    left, rows = np.arange(tets), []
    for _ in range(rounds):
        first = random.integers(0, len(left))
        here = np.isin(left, np.r_[random.choice(left, len(left) // 12, replace=False), left[first : first + 12]])
        rows.append(left[here])
        left = left[~here]
    return rows


@pytest.mark.parametrize("ranks", [1, 3, 4])
def test_the_surface_follows_what_is_left(ranks: int) -> None:
    """After each of many removals the surface is equal to the surface computed from the remaining tets."""
    case, meshes = scene_of_two()
    offset = len(meshes[0].points)
    tets = np.concatenate([meshes[0].tets, meshes[1].tets + np.int32(offset)])
    rounds = plan(meshes, ranks, 8)

    def work(sim: Simulation) -> list[tuple[Ints, Ints, Ints]]:
        step.prepare(sim)
        found = []
        for gone in rounds:
            tick(sim, gone)
            assert sim.contact is not None
            surface, nodes = sim.contact.exterior.surface, sim.model.nodes
            found.append((surface.faces.nodes[:, :3], nodes.id[surface.flags], surface.edges.nodes))
        sim.free()
        return found

    found = on(ranks, case, meshes, work)
    left, removed = np.ones(len(tets), bool), np.zeros(offset + len(meshes[1].points), bool)
    whole = boundary_faces(tets)
    for k, gone in enumerate(rounds):
        left[gone] = False
        exposed = boundary_faces(tets[left])
        faces = np.concatenate([rank[k][0] for rank in found])
        assert sorted(map(tuple, faces.tolist())) == sorted(map(tuple, exposed.tolist()))
        without = np.setdiff1d(np.arange(len(removed)), tets[left])
        removed[without[without < offset]] = True
        flags = np.unique(np.concatenate([rank[k][1] for rank in found]))
        assert not removed[flags].any()
        assert set(np.unique(exposed).tolist()) <= set(flags.tolist())
        assert {int(i) for i in np.unique(whole) if not removed[i]} <= set(flags.tolist())
        named = {frozenset(row) for row in exposed.tolist()}
        edges = np.concatenate([rank[k][2] for rank in found])
        assert all({frozenset((a, b, c)), frozenset((a, b, d))} <= named for a, b, c, d in edges[:, :4].tolist())


def test_a_node_that_loses_all_its_tets_at_once_meets_others() -> None:
    """A node from the inside of the body, which was never on the surface, also meets other nodes."""
    case, meshes = scene_of_two()
    sim = build(wearing(case, EROSION), meshes)
    step.prepare(sim)
    part = sim.model.blocks[0]
    inner = int(np.argmin(np.abs(sim.model.nodes.x0 - 1.1 * MM).sum(axis=1)))
    tick(sim, part.id[(part.tets == inner).any(axis=1)])
    assert sim.contact is not None
    particles = ~nodes_of_tets(sim)
    assert particles[inner]
    assert sim.contact.exterior.surface.flags[particles].all()


def test_exposed_faces_have_contact_in_the_same_step() -> None:
    """The search in the step of the removal includes the inner faces of the removed tet as candidates of the nodes
    above this tet."""
    case, meshes = scene_of_two()
    sim = build(case, meshes)
    step.prepare(sim)
    tick(sim)
    assert sim.contact is not None
    part, behind = sim.model.blocks[0], across(meshes[0].tets)
    centres = sim.model.nodes.x0[part.tets].mean(axis=1)
    worn = int(part.id[np.abs(centres - np.array([1.5, 1.5, 2.7]) * MM).sum(axis=1).argmin()])
    bare = {int(other) for other in behind[worn] if other >= 0}
    assert len(bare) == 3

    def candidates() -> set[tuple[int, ...]]:
        now = sim.contact.searches.scene if sim.contact is not None else None
        assert now is not None
        return {tuple(sorted(row)) for row in now.surface_nodes.id[now.faces.corners[:, :3]].tolist()}

    wanted = {tuple(sorted(int(n) for n in np.delete(meshes[0].tets[face // 4], face % 4))) for face in bare}
    assert not wanted & candidates()
    wear_out(sim, np.array([worn]))
    searches = sim.contact.searches.many
    step.first_half(sim)
    assert sim.contact.searches.many == searches + 1
    assert wanted <= candidates()


def test_faces_covered_by_a_worn_tet_become_surface_without_a_search() -> None:
    case, meshes = scene_of_two()
    copper = case.model_copy(update={"materials": {"metal": COPPER}})
    sim = build(wearing(copper, schema.Erosion(plastic_strain=1.0)), meshes)
    step.prepare(sim)
    assert sim.contact is not None
    searches, part, behind = sim.contact.searches, sim.model.blocks[0], across(meshes[0].tets)
    tick(sim, part.id[:1])
    inner = np.flatnonzero((behind[part.id] >= 0).all(axis=1))[0]
    tired, covers = int(part.id[inner]), behind[part.id[inner]]
    part.state[inner // state.CHUNK, rows.PLASTIC_STRAIN, inner % state.CHUNK] = 0.6
    searches.due = True
    tick(sim)
    many, scene = searches.many, searches.scene
    assert scene is not None
    at = scene.rows_of(covers)
    assert len(at) == 4
    assert not scene.faces.exposed[at].any()
    tick(sim, np.array([tired]))
    assert searches.many == many
    assert searches.scene is scene
    assert scene.faces.exposed[at].all()
    assert not scene.faces.exposed[scene.rows_of(4 * tired + np.arange(4))].any()
    corners = scene.faces.corners[at, :3]
    assert scene.slots.on_surface[corners].all()
    assert scene.slots.live[corners].all()
    assert (part.across[np.isin(part.id, covers // 4)] == state.LAID_BARE).sum() >= 4


def test_a_body_without_its_support_is_held_by_the_one_below() -> None:
    """A driven tip is about to touch a tet when this tet is removed: in the same step the tip is in contact with the
    slope behind the removed tet."""
    speed, aside = 1000.0, 3e-3
    points = np.array([[2.0 - aside, 1.5, 2.14], [1.5, 1.0, 3.0], [2.5, 1.0, 3.0], [2.0, 2.2, 3.0]]) * MM
    ground, tip = block((3, 3, 2), MM, shake=0.0), TetMesh(points, positive(points, np.arange(4)[None, :]))
    drive = {"kind": "velocity", "parts": ("body1",), "x": 0.0, "y": 0.0, "z": -speed}
    sim = build(meeting_of([{"erosion": EROSION}, {}], boundaries=(drive,)), [ground, tip])
    step.prepare(sim)
    nodes, part, end = sim.model.nodes, sim.model.blocks[0], len(ground.points)
    slope = [node_at(sim, place) for place in ((1, 1, 1), (2, 1, 2), (2, 2, 2))]
    while sim.clock.step == 0 or nodes.x[end, 2] - 2.0 * MM > speed * sim.clock.dt:
        tick(sim)
    gap = nodes.x[end, 2] - 2.0 * MM
    tick(sim, part.id[np.isin(part.tets, [*slope, node_at(sim, (1, 1, 2))]).all(axis=1)])
    sunk = gap - speed * sim.clock.last_dt
    a, b, c = nodes.x[slope]
    normal = np.cross(b - a, c - a)
    height = (nodes.x[end] - a) @ normal / np.linalg.norm(normal) * np.sign(normal[2])
    assert sunk + aside * MM < -2e-5
    assert height > 0.05 * (sunk + aside * MM) / np.sqrt(2.0)
    assert nodes.x[end, 2] - b[2] < 0.25 * sunk


def node_at(sim: Simulation, place: Sequence[float]) -> int:
    """Returns the node that started at the given position, mm."""
    return int(np.abs(sim.model.nodes.x0 - np.array(place) * MM).sum(axis=1).argmin())


# Parts and ranks that lose all their tets


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("ranks", [2, 3])
def test_a_rank_that_has_lost_all_its_tets_goes_on(ranks: int, form: Form) -> None:
    """The result is equal to that of one rank."""
    case, meshes = scene_of_two()
    case = case.model_copy(update={"numerics": case.numerics.model_copy(update={"pressure": form})})
    lost = on(ranks, case, meshes, lambda sim: np.concatenate([part.id for part in sim.model.blocks]))[1]

    def work(sim: Simulation) -> str | None:
        step.prepare(sim)
        for k in range(12):
            tick(sim, lost if k == 3 else None)
        sim.free()
        return digest.digest(sim.model, sim.comm, [sim.elements.pressure] if sim.elements.split else [])

    assert on(ranks, case, meshes, work)[0] == on(1, case, meshes, work)[0]


@pytest.mark.parametrize("erosion", [EROSION, REMOVE], ids=["particles", "remove"])
@pytest.mark.parametrize("left", [1, 0], ids=["one part", "all parts"])
def test_a_run_outlives_its_tets(left: int, erosion: schema.Erosion) -> None:
    """The balances close to better than first order in the step, although a loaded face loses its load at once."""
    worst = []
    for safety in (0.8, 0.2):
        case, meshes = scene_of_two()
        numerics = case.numerics.model_copy(update={"dt_safety": safety})
        sim = build(wearing(case, erosion).model_copy(update={"numerics": numerics}), meshes)
        step.prepare(sim)
        residuals, ids = [], np.arange(len(meshes[0].tets) + (0 if left else len(meshes[1].tets)))
        while sim.clock.t < 0.3e-6:
            first = sim.clock.t >= 0.1e-6 and sim.model.elements_global > left * len(meshes[1].tets)
            residuals.append(tick(sim, ids if first else None))
        assert sim.model.elements_global == left * len(meshes[1].tets)
        assert sim.erosion is not None
        gone = ["body0"] if left else ["body0", "body1"]
        assert [text.split("'")[1] for text in sim.erosion.warnings(len(ids))] == gone
        worst.append(max(residuals))
    assert worst[0] < 1e-3
    assert worst[1] < 0.25 * worst[0]


def test_probes_of_what_has_left_are_no_number() -> None:
    low, high = (0.0, 0.0, 2.0 * MM), (1.0, 1.0, 1.0)
    probes = (
        schema.Probe(name="top", part="body0", field="velocity_z", low=low, high=high),
        schema.Probe(name="all", part="body0", field="density"),
        schema.Probe(name="peak", part="body0", field="temperature_max", low=low, high=high),
    )
    sim = alone(block((3, 3, 3), MM, shake=0.0), EROSION, (0, 0, 100), probes=probes)
    step.prepare(sim)
    part = sim.model.blocks[0]
    top = part.id[sim.model.nodes.x0[part.tets].mean(axis=1)[:, 2] > 2.0 * MM]
    for gone, *expected in ((None, 100.0, 293.15), (top[::2], 100.0, 293.15), (top, np.nan, np.nan)):
        tick(sim, gone)
        assert sim.probes.measure() == pytest.approx([expected[0], 8930.0, expected[1]], rel=1e-9, nan_ok=True)
    tick(sim, part.id.copy())
    assert np.isnan(sim.probes.measure()).all()


@pytest.mark.parametrize("erosion", [EROSION, REMOVE], ids=["particles", "remove"])
def test_no_reference_of_what_has_left_is_met(erosion: schema.Erosion) -> None:
    """No reference of a part without tets passes, for any tolerance; the particles of the part still have a speed."""
    quantities: tuple[Any, ...] = ("plastic_strain_max", "stress_max", "extent", "radius", "speed_mean")
    wide: dict[str, Any] = {"part": "body0", "value": 0.0, "tolerance": 1e9, "source": "-"}
    specs = [schema.Reference(quantity=q, axis="z" if q in quantities[2:] else None, **wide) for q in quantities]
    sim = alone(block((2, 2, 2), MM), erosion, (0, 0, 100))
    sim.case = sim.case.model_copy(update={"reference": tuple(specs)})
    step.prepare(sim)
    thick = reference.thicknesses(sim)
    assert all(check.passed for check in reference.measure(sim, Path(), thick))
    tick(sim, sim.model.blocks[0].id.copy())
    tick(sim)
    met = [check.passed for check in reference.measure(sim, Path(), thick)]
    assert met == [False, False, False, False, erosion is EROSION]


# Planes of symmetry


def flying(velocity: float, side: float) -> Simulation:
    """Returns a cube on one side of the plane x = 0, and a second body at rest far away that determines the time
    step."""
    plane = {"kind": "symmetry", "axis": "x", "parts": ["body0"]}
    motions = [{"velocity": (velocity, 0.0, 0.0), "erosion": EROSION}, {}]
    case = meeting_of(motions, material=STEEL, boundaries=(plane,))
    cube = moved(block((2, 2, 2), MM), ((0.0 if side > 0.0 else -2.0) * MM, 0.0, 0.0))
    sim = build(case, [cube, moved(block((2, 2, 2), MM), (20 * MM, 0.0, 0.0))])
    step.prepare(sim)
    return sim


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_particle_turns_round_at_a_symmetry_plane(side: float) -> None:
    """The particle keeps all of its energy. A node that starts on the plane is held on the plane before its tets are
    removed, and has no energy across the plane."""
    sim = flying(-side * 2000.0, side)
    nodes, part = sim.model.nodes, sim.model.blocks[0]
    mine, kinetic = nodes.part == 0, sim.ledger.initial
    residuals = [tick(sim, part.id.copy())]
    residuals += [tick(sim) for _ in range(25)]
    assert sim.clock.t * 2000.0 > 2.0 * MM
    assert (side * nodes.x[mine, 0] >= -1e-15).all()
    assert side * nodes.v[mine & (nodes.x0[:, 0] != 0.0), 0] == pytest.approx(2000.0, rel=1e-9)
    assert max(residuals) < 1e-12
    loss = sum(bound.contact_loss.sum() for bound in sim.boundaries if isinstance(bound, Mirrors))
    assert abs(loss) < 1e-12 * kinetic


def test_mirrors_hold_what_starts_off_the_plane_or_may_leave_it() -> None:
    sim = flying(0.0, 1.0)
    assert sum(len(bound.nodes) for bound in sim.boundaries if isinstance(bound, Mirrors)) == 27


@pytest.mark.parametrize("ranks", [1, 2])
def test_an_erosion_limit_that_removes_no_tet_is_reported(ranks: int) -> None:
    """The damage in this test is in a band narrower than a tet. A small damage gives no warning, and after a removal of
    tets there is no warning."""
    damaged = materials.JohnsonCookDamage(D1=0.05, D2=3.44, D3=-2.12, D4=0.002, D5=0.61)
    assert STEEL_42CRMO4.strength is not None
    law = STEEL_42CRMO4.strength.model_copy(update={"damage": damaged})
    steel = STEEL_42CRMO4.model_copy(update={"strength": law})
    wears = {"erosion": schema.Erosion(damage=1.0)}
    case = meeting_of([wears, wears, {}], material=steel).model_copy(update={"contact": None})
    meshes = [moved(block((3, 3, 3), MM, seed=k), (0.0, 0.0, 10.0 * k * MM)) for k in range(3)]

    def work(sim: Simulation) -> list[list[str]]:
        assert sim.erosion is not None
        step.prepare(sim)
        for part in sim.model.blocks:
            part.state[0, rows.DAMAGE, 0] = (0.2, 0.4, 0.4)[part.part]
        sim.free()
        return [sim.erosion.warnings(eroded) for eroded in (0, 1)]

    for before, after in on(ranks, case, meshes, work):
        assert [text.partition(":")[0] for text in before] == [
            "part 'body1' is damaged to 0.4 of erosion.damage 1 and no tet was removed"
        ]
        assert after == []
