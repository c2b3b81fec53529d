"""Contact across new cracks: no spurious impulses, closing cracks stop, and the times of the broad phase change no
contact.
"""

from collections.abc import Callable, Iterator
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.model import materials, schema
from conoid.worker import step
from conoid.worker.fracture.strength import Toughness
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows
from conoid.worker.model.state import Flags, Floats, Ints
from conoid.worker.parallel.fixed_point import exact_sums
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from ..worker.kernels import build
from ..worker.meshes import block
from ..worker.simulations import on
from .facets import plane

MM = 1e-3
SOFT = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=70e9, poisson=0.2),
    brittle=materials.Brittle(strength=1e6, energy=1e-3),
)  # fmt: skip
HEIGHT = 2.0 * MM


@pytest.fixture(autouse=True)
def only_the_plane_breaks() -> Iterator[None]:
    """Strengths: facets of the plane have a strength of 1 Pa, all other facets do not break."""
    weak = plane(mesh_of(), HEIGHT)[:, 0]

    def strengths(self: Toughness, ids: Ints, area: Floats) -> Floats:
        return np.where(np.isin(ids, weak), 1.0, 1e30)

    with patch.object(Toughness, "strengths", strengths):
        yield


def mesh_of() -> TetMesh:
    """Returns a block of 3 x 3 x 4 mm, with a plane of facets in the middle."""
    return block((3, 3, 4), MM, shake=0.0)


def case_of(friction: float = 0.0, **fracture: object) -> schema.Case:
    part = {"fracture": schema.Fracture(delay=0.0, **fracture)}  # type: ignore[arg-type]
    return meeting_of([part], {"friction": friction}, material=SOFT, end=1.0)


def sides(sim: Simulation) -> Flags:
    """Returns (nodes,) whether each node belongs to tets above the plane."""
    above = np.zeros(sim.model.nodes.n, bool)
    for b in sim.model.blocks:
        above[b.tets[sim.model.nodes.x0[b.tets].mean(axis=1)[:, 2] > HEIGHT]] = True
    return above


def at_rest(sim: Simulation) -> Simulation:
    """Returns the block just after the whole plane has broken at a stress of a few Pa: without stress, force and
    motion.
    """
    nodes = sim.model.nodes
    step.prepare(sim)
    first = sim.model.nodes_global
    nodes.v[:, 2] = np.where(nodes.x0[:, 2] > HEIGHT, 1e-6, np.where(nodes.x0[:, 2] < HEIGHT, -1e-6, 0.0))
    for _ in range(4):
        step.first_half(sim)
        step.second_half(sim)
        sim.count_nodes()
        if sim.model.nodes_global > first:
            break
    assert sim.model.nodes_global == first + 16
    nodes.x[:], nodes.v[:] = nodes.x0, 0.0
    step.prepare(sim)  # volumes that the loop over the tets stores
    nodes.force[:] = 0
    for b in sim.model.blocks:
        b.state[:, : rows.VISCOUS + 1, :] = 0.0
    return sim


def gaps(sim: Simulation) -> Floats:
    """Returns (16,) the distance across the crack, m, on one rank."""
    nodes, above = sim.model.nodes, sides(sim)
    plane_nodes = np.flatnonzero(np.abs(nodes.x0[:, 2] - HEIGHT) < 1e-9)
    order = plane_nodes[np.lexsort((above[plane_nodes], nodes.x0[plane_nodes, 1], nodes.x0[plane_nodes, 0]))]
    low, high = order[0::2], order[1::2]
    assert (nodes.x0[low] == nodes.x0[high]).all()
    assert (above[high] & ~above[low]).all()
    return np.asarray(nodes.x[high, 2] - nodes.x[low, 2])


def cracked(**keys: object) -> Simulation:
    return at_rest(build(case_of(**keys), [mesh_of()]))  # type: ignore[arg-type]


def ticks(sim: Simulation, steps: int, look: Callable[[], None] = lambda: None) -> None:
    for _ in range(steps):
        step.first_half(sim)
        look()
        step.second_half(sim)


@pytest.mark.parametrize("searched", [False, True])
def test_a_new_crack_makes_no_impulse(searched: bool) -> None:
    """The gap of the crack is exactly zero, and a body at rest stays at rest."""
    sim = cracked()
    assert sim.contact is not None
    assert (gaps(sim) == 0.0).all()
    sim.contact.searches.due = searched
    ticks(sim, 5)
    assert (gaps(sim) == 0.0).all()
    assert not sim.model.nodes.v.any()
    assert (sim.model.nodes.x == sim.model.nodes.x0).all()


@pytest.mark.parametrize("searched", [False, True])
def test_sides_that_close_stop(searched: bool) -> None:
    """The two sides of the crack stop in the same step, with conserved momentum; the gap is never negative."""
    sim = cracked()
    assert sim.contact is not None
    nodes, above = sim.model.nodes, sides(sim)
    nodes.v[:, 2] = np.where(above, -3.0, 1.0)
    momentum = float((nodes.mass * nodes.v[:, 2]).sum())
    sim.contact.searches.due = searched
    depth = []
    ticks(sim, 40, lambda: depth.append(float(gaps(sim).min())))
    assert min(depth) > -1e-6 * MM
    assert float((nodes.mass * nodes.v[:, 2]).sum()) == pytest.approx(momentum, rel=1e-12)
    assert sim.contact.last_push > 0.0


def test_a_crack_that_closes_acts_as_two_bodies_do() -> None:
    """The reference has the same two halves as separate parts, in contact by nodes and faces from the start. The motion
    while the halves touch, and the momentum of each half, are equal to those of the crack.
    """
    sim = cracked()
    above = sides(sim)
    half = block((3, 3, 2), MM, shake=0.0)
    motions = [{"velocity": (0.0, 0.0, 1.0)}, {"velocity": (0.0, 0.0, -3.0)}]
    apart = moved(half, (0.0, 0.0, HEIGHT))
    two = build(meeting_of(motions, {"friction": 0.0}, material=SOFT, end=1.0), [half, apart])
    step.prepare(two)
    sim.model.nodes.v[:, 2] = np.where(above, -3.0, 1.0)
    for _ in range(30):
        for each in (sim, two):
            step.first_half(each)
            step.second_half(each)
    upper = two.model.nodes.part == 1
    one, other = (
        float((s.model.nodes.mass * s.model.nodes.v[:, 2])[chosen].sum()) for s, chosen in ((sim, above), (two, upper))
    )
    mass = float(two.model.nodes.mass[upper].sum())
    assert abs(one - other) < 1e-4 * mass * 4.0
    assert abs(other + 3.0 * mass) > 0.5 * mass


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_sides_that_slide_rub(friction: float) -> None:
    """Pressed and sheared sides of a crack lose mu times the normal impulse. Without friction the sides of a crack lose
    only the part that is caused by the rotation of faces by the strain, v / c = 2e-4.
    """
    sim = cracked(friction=friction)
    assert sim.contact is not None
    nodes, above = sim.model.nodes, sides(sim)
    nodes.v[:] = np.where(above[:, None], [4.0, 0.0, -1.0], 0.0)
    before = (nodes.mass[above, None] * nodes.v[above]).sum(axis=0)
    ticks(sim, 6)
    change = (nodes.mass[above, None] * nodes.v[above]).sum(axis=0) - before
    assert change[2] > 0.0
    assert -change[0] == pytest.approx(friction * change[2], rel=0.02, abs=2e-4 * change[2])
    books = sim.contact.books
    assert (books.friction_work(books.friction.total(sim.comm)) > 0.0) == (friction > 0.0)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_cracks_close_equally_on_any_number_of_ranks(friction: float) -> None:
    """The cracks close and slide, with broad phases in between; the results are bit-identical."""

    def work(sim: Simulation) -> tuple[list[float], int]:
        at_rest(sim)
        assert sim.contact is not None
        nodes = sim.model.nodes
        nodes.v[:] = np.where(sides(sim)[:, None], [5.0, 2.0, -3.0], [0.0, 0.0, 1.0])
        spread = np.array([nodes.id * 0.37 % 1.0, nodes.id * 0.61 % 1.0]).T
        nodes.v[:, :2] += spread
        for n in range(40):
            sim.contact.searches.due |= n in (10, 11, 25)
            step.first_half(sim)
            step.second_half(sim)
        moments = np.concatenate([nodes.x, nodes.v], axis=1) * (1.0 + nodes.id[:, None])
        return exact_sums(sim.comm, moments[nodes.owned]).tolist(), sim.contact.searches.many

    runs = [on(ranks, case_of(friction=friction), [mesh_of()], work) for ranks in (1, 2, 3)]
    assert runs[0][0][1] > 3
    assert all(one == runs[0][0] for found in runs for one in found)


def test_an_open_crack_carries_nothing_and_is_surface_after_a_search() -> None:
    """Halves that separate move freely; the broad phase adds the new faces when the crack is wide enough for other
    contacts.
    """
    sim = cracked()
    assert sim.contact is not None
    nodes, above = sim.model.nodes, sides(sim)
    nodes.v[:, 2] = np.where(above, 200.0, 0.0)
    searches = sim.contact.searches.many
    ticks(sim, 60)
    assert gaps(sim).min() > 0.3 * MM
    assert (nodes.v[above, 2] == 200.0).all()
    assert not nodes.v[~above].any()
    assert sim.contact.searches.many > searches
    faces = sum(int(b.exposed().sum()) for b in sim.model.blocks)
    assert faces == 2 * (2 * 9 + 4 * 3 * 4 + 18)
