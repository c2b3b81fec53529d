"""Node separation: connected pieces of the tets at a node compared with scipy, and equal numbers of copies for any
number of ranks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from conoid.cases.model import materials, schema
from conoid.worker import simulation, step
from conoid.worker.fracture import stars
from conoid.worker.fracture.facets import mesh_of
from conoid.worker.fracture.separation import Separation
from conoid.worker.mesh.faces import FACES, across
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import MASS
from conoid.worker.model.state import BROKEN, INTACT, Floats, Ints, Model
from conoid.worker.parallel.comm import Comm
from conoid.worker.parallel.fixed_point import exact_sums
from conoid.worker.parallel.team import team
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved, pieces_of
from ..contact.ranks import on_ranks
from ..worker.meshes import block, positive
from ..worker.simulations import on
from .facets import corners_of, inner, plane

BRITTLE = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=70e9, poisson=0.2),
    brittle=materials.Brittle(strength=50e6, energy=20.0, scatter=materials.Scatter(modulus=5.0)),
)  # fmt: skip
RANKS = (1, 2, 3, 5)
STEPS = 40


# Pieces


@pytest.mark.parametrize("seed", range(4))
def test_pieces_are_those_of_scipy(seed: int) -> None:
    """Checks every node of a block with randomly broken facets, in three parts."""
    random = np.random.default_rng(seed)
    mesh = block((4, 3, 3), seed=seed)
    facets = inner(mesh)
    whole = facets[random.uniform(size=len(facets)) > (0.2, 0.5, 0.7, 0.9)[seed]]
    behind = np.full(4 * len(mesh.tets), -1, np.int64)
    behind[whole], behind[whole[:, ::-1]] = whole[:, ::-1] // 4, whole // 4
    tet, corner = np.divmod(np.arange(4 * len(mesh.tets)), 4)
    rows = np.full((len(tet), stars.COLUMNS), -1, np.int64)
    rows[:, stars.NODE], rows[:, stars.TET] = mesh.tets[tet, corner], tet
    rows[:, stars.BEHIND :] = behind[4 * tet[:, None] + FACES[corner]]
    rows = np.ascontiguousarray(rows[np.lexsort((rows[:, stars.TET], rows[:, stars.NODE]))])
    quarters = random.uniform(1.0, 2.0, len(rows))
    rows[:, stars.MASS], rows[:, stars.RANK] = quarters.view(np.int64), rows[:, stars.TET] % 7
    many = 0
    of, labels, nodes, ranks, mass = stars.Pieces(team(2)).of(rows, stars.node_begins(rows))
    assert mass == pytest.approx([0.25 * quarters[of == k].sum() for k in range(len(mass))])
    assert (np.unique(rows[:, stars.NODE])[nodes] == labels[:, 0]).all()
    assert (ranks == labels[:, 1] % 7).all()
    smallest = np.searchsorted(rows[:, stars.NODE], rows[:, stars.NODE])
    label, leaves = np.where(of < 0, rows[smallest, stars.TET], labels[of, 1]), of >= 0
    for node in range(len(mesh.points)):
        star = np.flatnonzero(rows[:, stars.NODE] == node)
        ids = rows[star, stars.TET]
        pairs = whole[(corners_of(mesh, whole) == node).any(axis=1)] // 4
        place = np.searchsorted(ids, pairs)
        graph = coo_array((np.ones(len(pairs)), tuple(place.T)), shape=(len(ids), len(ids)))
        count, component = connected_components(graph, directed=False)
        expected = [ids[component == component[i]].min() for i in range(len(ids))]
        assert label[star].tolist() == expected
        assert leaves[star].tolist() == [piece != ids.min() for piece in expected]
        many += count > 1
    assert many > 3


# Separation on several ranks


@dataclass
class Cracked:
    """The whole mesh after some events, combined from the ranks."""

    tets: Ints
    """(n, 4) global nodes of the tets."""
    bond: Ints
    """(n, 4) state of the facets of the tets."""
    x: Floats
    v: Floats
    mass: Floats
    owner: Ints


def expected_tets(mesh: TetMesh, events: Sequence[Ints]) -> tuple[Ints, list[int]]:
    """Returns the connectivity after some events, found by a plain search through sets, and how often each final node
    was a copy.
    """
    tets, broken, n = mesh.tets.astype(np.int64), set[int](), len(mesh.points)
    depth = [0] * n
    behind = across(mesh.tets)
    for facets in events:
        broken |= set(facets.reshape(-1).tolist())
        touched = sorted({int(a) for side in facets.reshape(-1) for a in tets[side // 4, FACES[side % 4]]})
        changes = []
        for node in touched:
            left, pieces = set(np.flatnonzero((tets == node).any(axis=1)).tolist()), []
            while left:
                piece, waiting = set(), [min(left)]
                while waiting:
                    tet = waiting.pop()
                    if tet in piece:
                        continue
                    piece.add(tet)
                    corner = tets[tet].tolist().index(node)
                    faces = [f for f in range(4) if f != corner and 4 * tet + f not in broken and behind[tet, f] >= 0]
                    waiting += [int(behind[tet, f]) // 4 for f in faces]
                pieces.append(piece)
                left -= piece
            changes += [(node, piece) for piece in pieces[1:]]
        for node, piece in changes:
            for tet in piece:
                tets[tet, tets[tet].tolist().index(node)] = n
            depth.append(depth[node] + 1)
            n += 1
    return tets, depth


def case_of(**fracture: object) -> schema.Case:
    case = meeting_of([{"fracture": schema.Fracture(**fracture)}], material=BRITTLE)  # type: ignore[arg-type]
    return case.model_copy(update={"contact": None})


def arranged(model: Model) -> None:
    """Sets velocities that distinguish nodes, and bonds."""
    model.nodes.v[:] = np.sin(model.nodes.id[:, None] + np.arange(3.0))
    for b in model.blocks:
        b.bond = np.full((b.n, 4), INTACT, np.uint8)


def break_on(model: Model, separation: Separation, facets: Ints, comm: Comm) -> None:
    sides, before = np.full((*facets.shape, 3), -1, np.int32), separation.broken
    for b, part in enumerate(model.blocks):
        here = np.isin(facets // 4, part.id)
        order = np.argsort(part.id)
        places = order[np.searchsorted(part.id[order], facets[here] // 4)]
        sides[here] = np.column_stack([np.full(len(places), b), places, facets[here] % 4])
    own, touched = np.zeros((2, comm.size), np.int64)
    separation.survey([sides], int((sides[:, 0, 1] >= 0).sum()), own)
    comm.begin_maximum(own, touched).finish()
    split = separation.separate(touched)
    assert separation.broken == before + len(facets)
    nodes = model.nodes
    assert (np.diff(nodes.id) > 0).all()
    assert all(
        len(column) == nodes.n for column in (nodes.x, nodes.v, nodes.mass, nodes.owner, nodes.part, nodes.force)
    )
    assert (nodes.id[split.first :] == split.copies.id).all()
    model.nodes_global = int(comm.maximum(np.array([float(model.nodes_global)]))[0])  # as the next reduction does


def cracked(mesh: TetMesh, events: Sequence[Ints], ranks: int) -> Cracked:
    """Returns the mesh after some events, combined from the ranks; all ranks must agree about the copies of a node."""
    pieces = pieces_of(case_of(), [mesh], ranks)

    def work(comm: Comm) -> tuple[Model, list[Ints]]:
        piece, model = pieces[comm.rank]
        arranged(model)
        meshes = {b: mesh_of(block) for b, block in enumerate(model.blocks)}
        separation = Separation(model, piece.neighbours, meshes, comm, team(1))
        for facets in events:
            break_on(model, separation, facets, comm)
        return model, [model.nodes.id[other.nodes] for other in piece.neighbours]

    done = on_ranks(ranks, work)
    total = done[0][0].nodes_global
    assert all(model.nodes_global == total for model, _ in done)
    out = Cracked(
        np.zeros(mesh.tets.shape, np.int64), np.zeros(mesh.tets.shape, np.int64), np.zeros((total, 3)),
        np.zeros((total, 3)), np.zeros(total), np.full(total, -1),
    )  # fmt: skip
    for rank, (model, _) in enumerate(done):
        nodes = model.nodes
        out.x[nodes.id], out.v[nodes.id], out.mass[nodes.id] = nodes.x, nodes.v, nodes.mass
        assert (out.owner[nodes.id[nodes.owned]] == -1).all()
        out.owner[nodes.id[nodes.owned]] = rank
        for b in model.blocks:
            out.tets[b.id], out.bond[b.id] = nodes.id[b.tets], b.bond
    assert (out.owner >= 0).all()
    for rank, (model, lists) in enumerate(done):
        nodes = model.nodes
        for mine, whole in ((nodes.x, out.x), (nodes.v, out.v), (nodes.mass, out.mass), (nodes.owner, out.owner)):
            assert (mine == whole[nodes.id]).all()
        for other, ids in zip(pieces[rank][0].neighbours, lists, strict=True):
            back = next(n for n in pieces[other.rank][0].neighbours if n.rank == rank)
            assert (done[other.rank][0].nodes.id[back.nodes] == ids).all()
    return out


def random_events(mesh: TetMesh, seed: int, shares: Sequence[float]) -> list[Ints]:
    """Returns the fractions of all facets that break in one event after the other."""
    facets = np.random.default_rng(seed).permutation(inner(mesh))
    ends = np.cumsum([0, *(int(share * len(facets)) for share in shares)])
    return [facets[a:b] for a, b in pairwise(ends)]


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("seed", [1, 2])
def test_nodes_separate_as_in_a_plain_search_on_any_number_of_ranks(seed: int, ranks: int) -> None:
    """The five events include nodes that separate again, copies that separate, and at the end a mesh without intact
    facets.
    """
    mesh = block((3, 2, 2), seed=seed)
    events = random_events(mesh, seed, (0.35, 0.2, 0.15, 0.1, 0.1))
    events.append(inner(mesh)[~np.isin(inner(mesh)[:, 0], np.concatenate(events)[:, 0])])
    tets, depth = expected_tets(mesh, events)
    found = cracked(mesh, events, ranks)
    assert (found.tets == tets).all()
    assert max(depth) > 2
    assert len(found.mass) == len(depth) == 4 * len(mesh.tets)
    assert (found.bond[across(mesh.tets) >= 0] == BROKEN).all()


@pytest.mark.parametrize("ranks", RANKS)
def test_mass_and_momentum_stay(ranks: int) -> None:
    """Checks every node with its copies: a copy has the position of its parent, and the mass of its own tets."""
    mesh = block((3, 2, 2), seed=3)
    events = random_events(mesh, 3, (0.5, 0.2))
    found, before = cracked(mesh, events, ranks), cracked(mesh, [], 1)
    family = np.zeros(len(found.mass), np.int64)
    family[found.tets] = mesh.tets
    assert (found.x == before.x[family]).all()
    assert (found.v == before.v[family]).all()
    assert np.bincount(family, found.mass) == pytest.approx(before.mass, rel=4e-16)
    (_, model), = pieces_of(case_of(), [mesh])  # fmt: skip
    quarters = np.repeat(0.25 * model.blocks[0].row(MASS)[np.argsort(model.blocks[0].id)], 4)
    assert found.mass == pytest.approx(np.bincount(found.tets.reshape(-1), quarters), rel=1e-14)
    assert found.mass.min() > 0.0
    assert len(found.mass) > 2 * len(before.mass)


@pytest.mark.parametrize("ranks", RANKS)
def test_a_facet_inside_separates_nothing(ranks: int) -> None:
    mesh = block((3, 3, 3), shake=0.0)
    facets = plane(mesh, 1.0)
    inside = facets[((mesh.points[corners_of(mesh, facets)] % 3.0)[:, :, :2] > 0.0).all(axis=(1, 2))][:1]
    found = cracked(mesh, [inside], ranks)
    assert (found.tets == mesh.tets).all()
    assert np.flatnonzero(found.bond.reshape(-1)).tolist() == inside[0].tolist()
    assert (found.bond.reshape(-1)[inside] == BROKEN).all()


@pytest.mark.parametrize("ranks", RANKS)
def test_a_closed_sheet_round_a_node_separates_that_node_alone(ranks: int) -> None:
    mesh = block((4, 4, 4), shake=0.0)
    facets = plane(mesh, 2.0)
    centre = int(np.flatnonzero((mesh.points == 2.0).all(axis=1))[0])
    disc = facets[(corners_of(mesh, facets) == centre).any(axis=1)]
    but_one = cracked(mesh, [disc[1:]], ranks)
    assert (but_one.tets == mesh.tets).all()
    found = cracked(mesh, [disc[1:], disc[:1]], ranks)
    assert len(found.mass) == len(mesh.points) + 1
    assert set(mesh.tets[found.tets != mesh.tets].tolist()) == {centre}
    assert (found.bond.reshape(-1)[disc] == BROKEN).all()
    assert (found.bond == BROKEN).sum() == disc.size


@pytest.mark.parametrize("ranks", RANKS)
def test_a_sheet_through_the_body_cuts_it_in_two(ranks: int) -> None:
    mesh = block((3, 3, 3), shake=0.0)
    found = cracked(mesh, [plane(mesh, 1.0)], ranks)
    above = mesh.points[mesh.tets].mean(axis=1)[:, 2] > 1.0
    assert len(found.mass) == len(mesh.points) + 16
    assert not np.intersect1d(found.tets[above], found.tets[~above]).size


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_hinges_separate(ranks: int) -> None:
    """Two tets have a common facet; two more tets are connected to the first two only by a node and by an edge."""
    points = np.array(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1),
         (-1, 0, 0), (-1, -1, 0), (-1, 0, 1), (2, 1, 0), (2, 0, 1)], float,
    )  # fmt: skip
    tets = positive(points, np.array([[0, 1, 2, 3], [0, 1, 2, 4], [0, 5, 6, 7], [1, 3, 8, 9]]))
    mesh = TetMesh(points, tets)
    (facet,) = inner(mesh)
    found = cracked(mesh, [facet[None]], ranks)
    assert found.tets[0].tolist() == tets[0].tolist()
    assert len(found.mass) == len(points) + 5
    at_0, at_1 = (set(found.tets[mesh.tets == node].tolist()) for node in (0, 1))
    assert (at_0, at_1) == ({0, 10, 11}, {1, 12, 13})
    assert (found.tets[3] == mesh.tets[3]).sum() == 3


def test_a_rank_without_touched_nodes_does_not_communicate() -> None:
    """A facet breaks at one end of a bar: the rank at the other end sends and receives nothing. The maximum of three
    words before the break, and of one word after the break, are part of the reductions of this step and of the next
    step.
    """
    mesh, ranks = block((2, 2, 12), shake=0.0), 3
    pieces, facets = pieces_of(case_of(), [mesh], ranks), plane(mesh, 1.0)

    def work(comm: Comm) -> tuple[float, dict[str, int]]:
        piece, model = pieces[comm.rank]
        arranged(model)
        meshes = {b: mesh_of(block) for b, block in enumerate(model.blocks)}
        separation = Separation(model, piece.neighbours, meshes, comm, team(1))
        comm.sent.since_last()
        break_on(model, separation, facets, comm)
        return float(model.nodes.x0[:, 2].min()), comm.sent.since_last()

    low, sent = max(on_ranks(ranks, work), key=lambda found: found[0])
    assert low > 2.0
    assert sent == {"messages": 0, "bytes": 0, "collectives": 2, "collective_bytes": 8 * ranks + 8}


# Separation in the time step


def pulled(**fracture: object) -> schema.Case:
    """Returns a bar that is stretched and sheared by its own inertia until it breaks."""
    part = {"stretch": schema.Stretch(rate=(0.0, 0.0, 3e4), centre=(0.0, 0.0, 2e-3)), "jitter": 3.0,
            "fracture": schema.Fracture(**fracture)}  # type: ignore[arg-type]  # fmt: skip
    return meeting_of([part], material=BRITTLE, end=1.0)


@pytest.mark.parametrize("model", ["instant", "cohesive"])
@pytest.mark.parametrize("form", ["standard", "split"])
def test_a_step_in_which_nothing_breaks_costs_no_collective_of_its_own(model: str, form: str) -> None:
    """Faces are overstressed and their delays run; the reduction of the step contains that no facet breaks."""
    mesh = block((2, 2, 4), 1e-3, seed=5)
    case = pulled(model=model, delay=1e3)
    case = case.model_copy(update={"contact": None})
    case = case.model_copy(update={"numerics": case.numerics.model_copy(update={"pressure": form})})

    def work(sim: Simulation) -> tuple[list[int], int]:
        assert sim.fracture is not None
        step.prepare(sim)
        agreed, counts = list[int](), list[int]()
        for _ in range(STEPS):
            step.first_half(sim)
            sim.comm.sent.since_last()
            step.second_half(sim)
            agreed.append(sim.reduction.breaking)
            counts.append(sim.comm.sent.since_last()["collectives"])
        quiet = [
            count for before, now, count in zip(agreed, agreed[1:], counts[1:], strict=False) if before == now == 1
        ]
        return quiet, sim.fracture.broken

    for quiet, broken in on(3, case, [mesh], work):
        assert broken == 0
        assert len(quiet) > 10
        assert set(quiet) == {1}


def test_a_break_costs_no_collective_of_its_own() -> None:
    """Facets break in most steps, on different ranks, and fragments collide: only the ranks that have broken facets, or
    ghosts of their surface, communicate.
    """
    case = pulled(delay=0.2)

    def work(sim: Simulation) -> tuple[list[int], int, int]:
        assert sim.fracture is not None
        advance, rank, counts, elsewhere = sim.fracture.advance, sim.comm.rank, list[int](), 0

        def watched(agreed: int, touched: Ints) -> None:
            nonlocal elsewhere
            sim.comm.sent.since_last()
            advance(agreed, touched)
            if touched.any():
                counts.append(sim.comm.sent.since_last()["collectives"])
                elsewhere += not touched[rank]

        sim.fracture.advance = watched  # type: ignore[method-assign]
        step.prepare(sim)
        for _ in range(STEPS):
            step.first_half(sim)
            step.second_half(sim)
        return counts, elsewhere, sim.fracture.broken

    found = on(3, case, [block((2, 2, 9), 1e-3, seed=5)], work)
    assert max(elsewhere for _, elsewhere, _ in found) > 5
    for counts, _, broken in found:
        assert broken > 100
        assert set(counts) == {0}


def test_a_parcel_between_two_steps_has_all_nodes() -> None:
    """The parcel of a tet that is sent includes nodes that separated far from rank 0 in the last step, which no
    reduction has contained yet.
    """
    case = pulled(delay=0.2).model_copy(update={"contact": None})

    def work(sim: Simulation) -> tuple[bool, int]:
        step.prepare(sim)
        behind = False
        for _ in range(STEPS):
            step.first_half(sim)
            step.second_half(sim)
            nodes, known = sim.model.nodes, sim.model.nodes_global
            every = int(sim.comm.sum(np.array([nodes.owned.sum()]))[0])
            assert simulation.keep(sim).known["nodes_global"] == every
            behind |= known < every
        return behind, sim.model.nodes_global

    found = on(3, case, [block((2, 2, 9), 1e-3, seed=5)], work)
    assert found[0][0]
    assert len({nodes for _, nodes in found}) == 1


@pytest.mark.parametrize("model", ["instant", "cohesive"])
@pytest.mark.parametrize("form", ["standard", "split"])
def test_forces_are_those_of_the_tets_after_every_event(model: str, form: str) -> None:
    """Forces are equal in integers on one, two and three ranks, momentum is equal to round-off, and all ranks break the
    same facets.
    """
    mesh = block((2, 2, 4), 1e-3, seed=5)
    case = pulled(model=model, delay=0.2)
    case = case.model_copy(update={"numerics": case.numerics.model_copy(update={"pressure": form})})

    def momentum(sim: Simulation) -> Floats:
        nodes = sim.model.nodes
        return exact_sums(sim.comm, (nodes.mass[:, None] * nodes.v)[nodes.owned])

    def work(sim: Simulation) -> tuple[int, int, list[float]]:
        assert sim.fracture is not None
        nodes = sim.model.nodes
        step.prepare(sim)
        before, grown = momentum(sim), sim.model.nodes_global
        for _ in range(STEPS):
            step.first_half(sim)
            step.second_half(sim)
            sim.count_nodes()
            if sim.model.nodes_global == grown:
                continue
            grown = sim.model.nodes_global
            handed = nodes.force.copy()
            sim.elements.again(nodes.scale)
            sim.elements.finish()
            assert (handed == nodes.force).all()
            assert len(sim.elements.pressure) == (nodes.n if sim.elements.split else 1)
        size = float(np.abs(exact_sums(sim.comm, np.abs(nodes.mass[:, None] * nodes.v)[nodes.owned])).max())
        assert np.abs(momentum(sim) - before).max() < 1e-13 * size
        return sim.model.nodes_global, sim.fracture.broken, momentum(sim).tolist()

    runs = [on(ranks, case, [mesh], work) for ranks in (1, 2, 3)]
    assert runs[0][0][0] > 1.5 * len(mesh.points)
    assert runs[0][0][1] > 100
    assert all(one == runs[0][0] for found in runs for one in found)


def test_ranks_without_a_part_of_nodal_tractions_take_part_in_them() -> None:
    """Two adjacent bars, one of them with nodal tractions: with five ranks some ranks have only the other bar."""
    motion = {"stretch": schema.Stretch(rate=(0.0, 0.0, 3e4), centre=(0.0, 0.0, 2e-3)), "jitter": 3.0}
    specs = [schema.Fracture(delay=0.2, traction=traction) for traction in ("nodes", "tets")]
    case = meeting_of([{**motion, "fracture": spec} for spec in specs], material=BRITTLE, end=1.0)
    case = case.model_copy(update={"contact": None})
    meshes = [block((2, 2, 4), 1e-3, seed=5), moved(block((2, 2, 4), 1e-3, seed=6), (1e-2, 0.0, 0.0))]

    def work(sim: Simulation) -> tuple[int, int, int]:
        assert sim.fracture is not None
        step.prepare(sim)
        for _ in range(STEPS):
            step.first_half(sim)
            step.second_half(sim)
        sim.count_nodes()
        return sim.model.nodes_global, sim.fracture.broken, len({b.part for b in sim.model.blocks})

    (one,) = on(1, case, meshes, work)
    many = on(5, case, meshes, work)
    assert one[1] > 100
    assert {found[:2] for found in many} == {one[:2]}
    assert min(parts for *_, parts in many) == 1
