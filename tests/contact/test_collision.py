"""Bodies that collide: momentum, energy, and equal answers for any broad phase, decomposition and frame of
reference.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.messages import Energy
from conoid.cases.model import schema
from conoid.worker import simulation, step
from conoid.worker.accounts.digest import digest
from conoid.worker.contact.narrow_phase.detection import Detection
from conoid.worker.contact.scene.scene import Scene
from conoid.worker.contact.solver.shared_sums import ActiveSum
from conoid.worker.contact.solver.solver import ActiveSet
from conoid.worker.contact.solver.step import SolverStep
from conoid.worker.errors import InputError
from conoid.worker.mesh.model import TetMesh
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.scene import assembly
from conoid.worker.simulation import Simulation

from ..worker.kernels import Watch, build, run
from ..worker.meshes import Floats, block
from .bodies import meeting_of, moved, pieces_of, rotation
from .ranks import on_ranks

SIZE = 1e-3
MESHES = [
    block((3, 3, 3), SIZE, seed=1),
    moved(block((2, 3, 2), 1.2 * SIZE, seed=2), (3.89 * SIZE, 0.4 * SIZE, 0.6 * SIZE), rotation((1, 2, 3), 0.5)),
]
"""Scene: two blocks whose meshes do not match; the second block is turned, and one of its corners is nearly on the face
of the first block."""
MOTIONS: list[dict[str, Any]] = [
    {"velocity": (60.0, 5.0, 0.0), "spin": {"centre": (1.5 * SIZE,) * 3, "rate": (3e3, 0.0, 1e4)}},
    {"velocity": (-70.0, 0.0, 10.0)},
]
END = 6e-6


def case_of(**contact: Any) -> schema.Case:
    return meeting_of(MOTIONS, contact, end=END)


def state_of(sim: Simulation) -> tuple[str | None, int]:
    """Returns the digest of a run, and the number of broad phases."""
    assert sim.contact is not None
    return digest(sim.model, sim.comm, []), sim.contact.searches.many


def answer(case: schema.Case, watch: Watch | None = None) -> tuple[str | None, int]:
    return state_of(run(build(case, MESHES), watch))


def momenta(sim: Simulation) -> tuple[Floats, Floats]:
    """Returns linear and angular momentum as correctly rounded sums; the leapfrog conserves x(n) x m v(n+1/2)."""
    nodes = sim.model.nodes
    p = nodes.mass[:, None] * nodes.v
    columns = np.column_stack([p, np.cross(nodes.x, p)])
    total = np.array([math.fsum(column) for column in columns.T])
    return total[:3], total[3:]


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_collision_keeps_the_momentum(friction: float) -> None:
    """Linear momentum is conserved to round-off. Angular momentum is conserved up to the moment of the impulses across
    the gaps of contacts, which is zero along the normal.
    """
    sim = build(case_of(friction=friction), MESHES)
    assert sim.contact is not None
    linear, angular = momenta(sim)
    size = sum(np.linalg.norm(np.cross(n.x, n.mass[:, None] * n.v), axis=1).sum() for n in [sim.model.nodes])
    pushed = np.abs(sim.model.nodes.mass[:, None] * sim.model.nodes.v).sum()
    run(sim)
    assert sim.contact.last_push > 0.0
    end_linear, end_angular = momenta(sim)
    assert np.abs(end_linear - linear).max() < 1e-12 * pushed
    assert np.abs(end_angular - angular).max() < (1e-6 if friction == 0.0 else 1e-4) * size


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_step_without_impulses_needs_no_solver(friction: float) -> None:
    """In steps that are found to rest the solver changes no velocity: the answers are equal."""
    case, solve, found = case_of(friction=friction), ActiveSet.solve, list[tuple[bool, bool]]()

    def noted(active: ActiveSet, step: SolverStep, shared: ActiveSum) -> bool:
        pushed = solve(active, step, shared)
        found.append((not len(active.places), step.rows.n > 0))
        return pushed

    def tested(active: ActiveSet, step: SolverStep, shared: ActiveSum) -> bool:
        active.tests_rest = False
        return solve(active, step, shared)

    with patch.object(ActiveSet, "solve", noted):
        one = answer(case)
    with patch.object(ActiveSet, "solve", tested):
        assert answer(case) == one
    assert {(True, False), (True, True), (False, True)} <= set(found)


def test_pairs_are_not_tested_before_they_can_be_active() -> None:
    """Two blocks that approach each other have an equal answer if all pairs are tested in every step."""
    meshes, holds, far = [MESHES[0], moved(MESHES[1], (SIZE, 0.0, 0.0))], Detection._far, list[bool]()

    def noted(of: Detection, now: Scene, together: bool) -> bool:
        far.append(holds(of, now, together))
        return far[-1]

    case = meeting_of(MOTIONS, {}, end=3.0 * END)
    with patch.object(Detection, "_far", noted):
        sim = run(build(case, meshes))
    with patch.object(Detection, "_far", lambda *_: False):
        assert state_of(run(build(case, meshes))) == state_of(sim)
    assert sim.contact is not None
    assert sim.contact.last_push > 0.0
    assert sum(far) > 10


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_the_ledger_closes_and_contact_only_loses(friction: float) -> None:
    lines: list[Energy] = []
    sim = run(build(case_of(friction=friction), MESHES), lambda sim, before: lines.append(sim.ledger.close(before)))
    assert sim.ledger.worst < 1e-3
    assert all(line.contact >= -1e-9 * line.initial for line in lines)
    assert 0.0 < lines[-1].contact < 0.2 * lines[0].initial
    assert [line.friction > 0.0 for line in (lines[0], lines[-1])] == [False, friction > 0.0]
    assert all(line.friction >= 0.0 for line in lines)


FLAT = [block((3, 3, 3), SIZE, seed=1), moved(block((2, 2, 2), 1.3 * SIZE, seed=2), (3.02 * SIZE, 0.0, 0.0))]
"""Scene: two blocks a small distance apart along x, with two sides in common planes."""
BOUNDARIES: dict[str, Any] = {
    "pusher": ({"kind": "velocity", "parts": ("body0",), "x": 50.0, "y": 0.0, "z": 0.0},),
    "guide": ({"kind": "velocity", "parts": ("body0",), "x": 50.0},),
    "planes": ({"kind": "symmetry", "axis": "y"}, {"kind": "symmetry", "axis": "z"}),
    "wall": ({"kind": "wall", "point": (5.7 * SIZE, 0.0, 0.0), "normal": (-1.0, 0.0, 0.0)},),
    "turn": ({"kind": "rotation", "parts": ("body0",), "spin": {"centre": (0.0, 0.0, 0.0), "rate": (0.0, 0.0, -1e4)}},),
}


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("kind", BOUNDARIES)
def test_the_ledger_closes_where_boundaries_hold_what_contact_pushes(kind: str, friction: float) -> None:
    """The supports of held nodes take the impulse; a node on a symmetry plane stays exactly on the plane."""
    motions: list[dict[str, Any]] = [{"velocity": (50.0, 0.0, 0.0)}, {}]
    sim = build(meeting_of(motions, {"friction": friction}, end=3e-6, boundaries=BOUNDARIES[kind]), FLAT)
    lines: list[Energy] = []
    run(sim, lambda sim, before: lines.append(sim.ledger.close(before)))
    assert sim.contact is not None
    assert sim.contact.last_push > 0.0
    assert sim.ledger.worst < 1e-3
    nodes = sim.model.nodes
    if kind == "planes":
        assert (nodes.x[nodes.x0[:, 1] == 0.0, 1] == 0.0).all()
        assert (nodes.x[nodes.x0[:, 2] == 0.0, 2] == 0.0).all()


def test_bodies_that_collide_have_bounced_in_the_end() -> None:
    sim = run(build(meeting_of(MOTIONS, end=3.0 * END), MESHES))
    nodes = sim.model.nodes
    speed = [float(np.average(nodes.v[nodes.part == i, 0], weights=nodes.mass[nodes.part == i])) for i in (0, 1)]
    assert speed[0] < speed[1]
    assert (nodes.x[nodes.part == 0, 0]).mean() < (nodes.x[nodes.part == 1, 0]).mean()


def test_equal_runs_have_equal_digests() -> None:
    assert answer(case_of(friction=0.3)) == answer(case_of(friction=0.3))


def test_a_search_in_every_step_changes_no_bit() -> None:
    """The results are bit-identical, because the candidate list contains every pair that becomes active before the next
    broad phase.
    """

    def search(sim: Simulation, before: Floats) -> None:
        assert sim.contact is not None
        sim.contact.searches.due = sim.clock.t + 1.5 * sim.clock.dt < END

    often, seldom = answer(case_of(friction=0.3), search), answer(case_of(friction=0.3))
    assert often[0] == seldom[0]
    assert often[1] > 5 * seldom[1]


def test_a_search_at_the_end_of_a_run_changes_no_bit() -> None:
    def search(sim: Simulation, before: Floats) -> None:
        assert sim.contact is not None
        sim.contact.searches.due = sim.clock.t + 1.5 * sim.clock.dt > END

    assert answer(case_of(), search)[0] == answer(case_of())[0]


@pytest.mark.parametrize("skin", [0.05, 1.0])
def test_the_skin_changes_no_bit(skin: float) -> None:
    assert answer(case_of(skin=skin))[0] == answer(case_of())[0]


def on_threads(ranks: int, case: schema.Case, work: Callable[[Simulation], Any], meshes: list[TetMesh]) -> list[Any]:
    """Returns the result of ``work`` on each of some ranks."""
    ready = iter(meshes)

    def one(comm: Comm) -> Any:
        sim = simulation.build(case, Path(), comm)
        found = work(sim)
        sim.free()
        return found

    with patch.object(assembly, "build_mesh", lambda *_, **__: next(ready)):
        return on_ranks(ranks, one)


@pytest.mark.parametrize("kind", ["arbitrary", "box"])
@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_any_number_of_ranks_gives_the_same_bits(ranks: int, kind: str) -> None:
    """The scene has friction and edges; the result does not depend on the faces that the ranks send each other. All
    ranks repeat the broad phase together; a rank alone needs fewer broad phases.
    """
    whole = answer(case_of(friction=0.3))
    case = case_of(friction=0.3, domain=kind)
    parts = on_threads(ranks, case, lambda sim: state_of(run(sim)), MESHES)
    assert parts[0][0] == whole[0]
    assert len({searches for _, searches in parts}) == 1


def test_ranks_inside_of_a_body_take_part_without_a_surface() -> None:
    meshes = [block((9, 9, 9), SIZE), moved(block((1, 1, 1), SIZE), (9.05 * SIZE, 4 * SIZE, 4 * SIZE))]
    case, ranks = meeting_of([{}, {"velocity": (-50.0, 0.0, 0.0)}], end=1e-6), 40
    inner = [not ((m.nodes.x0 == 0.0) | (m.nodes.x0 >= 9 * SIZE)).any() for _, m in pieces_of(case, meshes, ranks)]
    assert any(inner)
    parts = on_threads(ranks, case, lambda sim: state_of(run(sim, steps=3)), meshes)
    assert parts[0] == state_of(run(build(case, meshes), steps=3))


@pytest.mark.parametrize("ranks", [1, 3])
def test_self_contact_gives_the_same_bits(ranks: int) -> None:
    case = case_of(self_contact=("body0", "body1"))
    parts = on_threads(ranks, case, lambda sim: state_of(run(sim, steps=40)), MESHES)
    assert parts[0] == on_threads(2, case, lambda sim: state_of(run(sim, steps=40)), MESHES)[0]


def test_bodies_that_never_meet_move_as_if_there_were_no_contact() -> None:
    away = [MESHES[0], moved(MESHES[1], (10 * SIZE, 0.0, 0.0))]
    apart = [MOTIONS[0], {"velocity": (70.0, 0.0, 0.0)}]
    with_contact, without = (
        meeting_of(apart, end=1e-6),
        meeting_of(apart, end=1e-6).model_copy(update={"contact": None}),
    )
    one, two = (run(build(case, away)) for case in (with_contact, without))
    assert one.contact is not None
    assert two.contact is None
    assert digest(one.model, SerialComm(), []) == digest(two.model, SerialComm(), [])


def test_a_common_velocity_does_not_change_a_collision() -> None:
    """A common velocity of all bodies has no effect, except the round-off of positions."""
    results = []
    drift = np.array([200.0, -300.0, 100.0])
    for flight in (0.0 * drift, drift):
        motions = [motion | {"velocity": tuple(motion["velocity"] + flight)} for motion in MOTIONS]
        sim = run(build(meeting_of(motions, end=2e-6), MESHES))
        results.append(sim.model.nodes.v - flight)
    assert np.abs(results[1] - results[0]).max() < 1e-6 * 70.0


def crossed(edges: bool) -> float:
    """Returns the mean velocity along z, m/s, of the upper of two crossed bars, 1e-5 s after the bars collide with one
    edge each.
    """
    bar = block((6, 2, 2), SIZE, 0.0)
    meshes = [moved(bar, (0.0, 0.0, 0.0), rotation((1, 0, 0), np.pi / 4))]
    turn = rotation((0, 0, 1), np.pi / 2) @ rotation((1, 0, 0), np.pi / 4)
    meshes.append(moved(bar, (0.33 * SIZE, 0.21 * SIZE, 2.0 * 2**0.5 * SIZE + 1e-5), turn))
    motions: list[dict[str, Any]] = [{"velocity": (0.0, 0.0, 10.0)}, {"velocity": (0.0, 0.0, -10.0)}]
    sim = run(build(meeting_of(motions, {"edges": edges}, end=5e-6), meshes))
    nodes = sim.model.nodes
    return float(np.average(nodes.v[nodes.part == 1, 2], weights=nodes.mass[nodes.part == 1]))


def test_crossed_edges_bounce_and_pass_where_edges_are_off() -> None:
    assert crossed(edges=True) > 2.0
    assert crossed(edges=False) == pytest.approx(-10.0, abs=1e-6)


SLABS = [block((3, 2, 1), SIZE, seed=1), moved(block((2, 3, 1), SIZE, seed=2), (3.01 * SIZE, -0.4 * SIZE, 0.0))]
"""Scene: two plates that are one tet thick, whose ends are opposite to each other along x."""
THIN = tuple({"kind": "symmetry", "axis": "z", "at": at} for at in (0.0, SIZE))
"""Plane strain: every node of the plates is on one of the two planes."""


@pytest.mark.parametrize("ranks", [1, 3])
def test_bodies_one_tet_thick_between_two_symmetry_planes_do_not_pass_each_other(ranks: int) -> None:
    """At 20 m/s each, the plates are in contact after 0.25 us; without contact the plates would overlap by 0.3 mm 8 us
    later.
    """
    case = meeting_of([{"velocity": (20.0, 0.0, 0.0)}, {"velocity": (-20.0, 0.0, 0.0)}], end=8e-6, boundaries=THIN)

    def ended(sim: Simulation) -> tuple[float, float, str | None]:
        run(sim)
        nodes = sim.model.nodes
        right, left = nodes.x[nodes.part == 0, 0], -nodes.x[nodes.part == 1, 0]
        ends = np.array([right.max(initial=-1.0), left.max(initial=-1.0)])
        overlap = float(sim.comm.maximum(ends).sum())
        return overlap, float(np.abs(nodes.v[:, 2]).max(initial=0.0)), digest(sim.model, sim.comm, [])

    overlap, across, answer = on_threads(ranks, case, ended, SLABS)[0]
    assert overlap < 1e-3 * SIZE
    assert across == 0.0
    assert answer == ended(build(case, SLABS))[-1]


def test_only_a_face_in_one_symmetry_plane_is_no_surface() -> None:
    """The surface of a plate one tet thick includes its sides, two faces for each cell; the surface of a plate between
    planes normal to two axes includes its ends.
    """
    walls = (*THIN, *({"kind": "symmetry", "axis": "y", "at": at, "parts": ("body0",)} for at in (0.0, 2.0 * SIZE)))
    case = meeting_of([{}, {}], end=END, boundaries=walls)
    sim = build(case, SLABS)
    assert sim.contact is not None
    faces = sim.contact.exterior.surface.faces.nodes[:, :3]
    of = np.bincount(sim.model.nodes.part[faces[:, 0]])
    assert of.tolist() == [2 * 2 * 2, 2 * 2 * (2 + 3)]


@pytest.mark.parametrize(("parts", "named"), [(("body1",), "body1"), ((), "body0")])
def test_a_part_whose_faces_all_lie_on_symmetry_planes_is_named(parts: tuple[str, ...], named: str) -> None:
    """The error names the first part if no part has a face."""
    cube = block((2, 2, 2), SIZE, shake=0.0)
    planes = tuple(
        schema.Symmetry(kind="symmetry", axis=axis, at=at, parts=parts)
        for axis in ("x", "y", "z")
        for at in ((0.0, 2.0 * SIZE) if parts or axis != "z" else (0.0, 2.0 * SIZE, 4.0 * SIZE))
    )
    case = meeting_of([{}, {}], end=END).model_copy(update={"boundaries": planes})
    with pytest.raises(InputError, match=rf"part '{named}' has no exposed face.*leave it out of contact.parts"):
        build(case, [moved(cube, (0.0, 0.0, (2.5 if parts else 2.0) * SIZE)), cube])


def collided(share: float) -> tuple[Simulation, list[Energy], Floats]:
    """Returns the energies and the drift of the momentum of two colliding blocks whose meshes do not match."""
    sim, lines = build(case_of(restitution=share), MESHES), []
    start = np.concatenate(momenta(sim))
    run(sim, lambda sim, before: lines.append(sim.ledger.close(before)))
    return sim, lines, np.concatenate(momenta(sim)) - start


def test_an_impact_with_restitution_1_takes_no_energy() -> None:
    """Many nodes and edges are in contact at once; momentum is conserved, and the energy balance closes."""
    taken = []
    for share in (0.0, 0.5, 1.0):
        sim, lines, drift = collided(share)
        taken.append(lines[-1].contact / lines[0].initial)
        assert sim.ledger.worst < 1e-3
        assert np.abs(drift[:3]).max() < 1e-12
    assert taken[0] > 0.01
    assert taken[1] > 0.01
    assert abs(taken[2]) < 1e-10


@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_the_force_of_contact_is_what_changes_the_momentum(gap: float) -> None:
    """The sum of force times time over all history lines is the change of momentum, for blocks that touch from the
    start and for blocks that do not.
    """
    case = meeting_of(
        [{}, {"velocity": (-80.0, 10.0, 0.0)}], end=1e-6,
        probes=tuple(
            schema.Probe.model_validate({"name": f"{a}{i}", "part": f"body{i}", "field": f"contact_force_{a}"})
            for i in range(2)
            for a in "xyz"
        ),
    )  # fmt: skip
    striker = moved(block((2, 2, 2), SIZE, seed=2), ((3.0 + gap) * SIZE, 0.4 * SIZE, 0.6 * SIZE))
    sim = build(case, [block((3, 3, 3), SIZE, seed=1), striker])
    first, given, change, last = _momenta_of_parts(sim), np.zeros(6), np.zeros(6), 0.0

    def look(sim: Simulation, _: Floats) -> None:
        nonlocal last
        if sim.clock.step % 7 == 0 or sim.clock.done:
            given[:] += sim.probes.measure() * (sim.clock.t - last)
            change[:] = _momenta_of_parts(sim) - first
            last = sim.clock.t

    run(sim, look)
    assert given == pytest.approx(change, rel=1e-9, abs=1e-9 * np.abs(change).max())


def _momenta_of_parts(sim: Simulation) -> Floats:
    """Returns (6,) the momentum from v(n+1/2) of body0 and body1, kg m/s."""
    nodes = sim.model.nodes
    p = nodes.mass[:, None] * nodes.v
    return np.array([math.fsum(column) for part in range(2) for column in p[nodes.part == part].T])


def test_the_answer_with_restitution_is_the_same_on_three_ranks() -> None:
    case = case_of(restitution=0.8)
    alone = answer(case)[0]
    assert alone is not None
    found = on_threads(3, case, lambda sim: state_of(run(sim))[0], MESHES)
    assert [digest for digest in found if digest is not None] == [alone]


@pytest.mark.parametrize(("gap", "restitution"), [(0.0, 0.0), (0.1, 0.0), (0.1, 1.0), (2.5, 0.0), (2.5, 1.0)])
def test_the_step_in_which_fast_bodies_meet_first_is_short(gap: float, restitution: float) -> None:
    """The bodies move at 10 km/s from a ``gap`` in edge lengths: the impulse of contact moves a node by at most half of
    a tet.
    """
    striker = moved(block((2, 2, 2), SIZE, seed=2), ((3.0 + gap) * SIZE, 0.4 * SIZE, 0.6 * SIZE))
    case = meeting_of([{}, {"velocity": (-1e4, 0.0, 0.0)}], {"restitution": restitution}, end=1e-6)
    sim = build(case, [block((3, 3, 3), SIZE, seed=1), striker])
    assert sim.contact is not None
    step.prepare(sim)
    step.first_half(sim)
    while not np.abs(sim.contact.impulses()).max() > 0.0:
        step.second_half(sim)
        step.first_half(sim)
    assert sim.clock.t * 1e4 <= (gap + 0.5) * SIZE
    assert (1.0 + restitution) * 1e4 * sim.clock.dt < 0.4 * SIZE
