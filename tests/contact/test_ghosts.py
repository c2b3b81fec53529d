"""Ghosts: messages contain every bit of a ghost, and all ranks with impulses on a common node have equal lists."""

from collections import defaultdict
from itertools import permutations

import numpy as np
import pytest

from conoid.worker.contact.scene import ghosts
from conoid.worker.contact.surface.records import Edges, Faces, SurfaceNodes, merged
from conoid.worker.model.state import Flags, Model
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.ownership import Neighbour
from conoid.worker.parallel.tags import Tag

from ..worker.meshes import block
from .bodies import meeting_of, moved, nodes_of, pieces_of
from .ranks import ThreadComm, on_ranks


def random_nodes(random: np.random.Generator, n: int) -> SurfaceNodes:
    surface_nodes = nodes_of(
        random.normal(size=(n, 3)), random.normal(size=(n, 3)), random.integers(0, 5, n).astype(np.int32)
    )
    surface_nodes.id = np.sort(random.choice(2**40, n, replace=False))
    surface_nodes.owner = random.integers(0, 9, n).astype(np.int32)
    surface_nodes.mobility = random.uniform(size=(n, 3)) * random.integers(0, 2, (n, 3))
    return surface_nodes


def same(one: SurfaceNodes, two: SurfaceNodes) -> bool:
    """Returns whether all columns except ``local`` are bit-identical."""
    names = ("id", "owner", "part", "mobility", "x", "v")
    return all(
        getattr(one, name).dtype == getattr(two, name).dtype
        and getattr(one, name).shape == getattr(two, name).shape
        and getattr(one, name).tobytes() == getattr(two, name).tobytes()
        for name in names
    )


@pytest.mark.parametrize(("f", "e", "n"), [(7, 5, 11), (0, 5, 3), (7, 0, 3), (0, 0, 3), (0, 0, 0)])
def test_packed_values_are_unpacked_to_the_bit(f: int, e: int, n: int) -> None:
    random = np.random.default_rng(1)

    def flags(*shape: int) -> Flags:
        return np.asarray(random.integers(0, 2, shape) > 0)

    faces = Faces(random.integers(0, 2**50, f), random.integers(0, 2**40, (f, 4)), random.normal(size=f), flags(f))
    ends, sides = random.integers(0, 2**40, (e, 6)), random.integers(0, 2**40, (e, 2))
    size, deep = random.normal(size=(2, e))
    edges = Edges(ends, sides, size, deep, random.integers(0, 3, (e, 2), dtype=np.uint8), flags(e))
    surface_nodes = random_nodes(random, n)
    got_faces, got_edges, got_nodes = ghosts.unpack(ghosts.pack(faces, edges, surface_nodes))
    assert (got_faces.id == faces.id).all()
    assert (got_faces.nodes == faces.nodes).all()
    assert (got_faces.size == faces.size).all()
    assert (got_faces.exposed == faces.exposed).all()
    assert (got_edges.opened == edges.opened).all()
    assert (got_edges.sharp == edges.sharp).all()
    assert (got_edges.nodes == edges.nodes).all()
    assert (got_edges.size == edges.size).all()
    assert (got_edges.deep == edges.deep).all()
    assert same(got_nodes, surface_nodes)
    assert (got_nodes.local == -1).all()


def test_merged_nodes_have_every_node_once_and_prefer_the_first() -> None:
    random = np.random.default_rng(2)
    whole = random_nodes(random, 50)
    here, there = whole.take(np.arange(0, 50, 2)), whole.take(np.arange(5, 45))
    there.x = there.x + 1.0
    both = merged([here, there])
    ids = np.union1d(here.id, there.id)
    assert (both.id == ids).all()
    from_here = np.isin(both.id, here.id)
    assert same(both.take(from_here), here)
    assert same(both.take(~from_here), there.take(~np.isin(there.id, here.id)))
    assert (both.id[both.places(ids[::-1])] == ids[::-1]).all()


def models_of(ranks: int) -> tuple[list[Model], list[list[Neighbour]]]:
    pieces = pieces_of(meeting_of([{}, {}]), [block((3, 3, 3)), moved(block((2, 2, 2)), (3.0, 0.0, 0.0))], ranks)
    return [model for _, model in pieces], [piece.neighbours for piece, _ in pieces]


def everything_of(model: Model) -> SurfaceNodes:
    nodes = model.nodes
    surface_nodes = nodes_of(nodes.x, nodes.v, nodes.part)
    surface_nodes.id, surface_nodes.owner = nodes.id, nodes.owner
    return surface_nodes


@pytest.mark.parametrize("ranks", [2, 3, 5, 8])
def test_a_fetched_node_is_its_owners(ranks: int) -> None:
    models, _ = models_of(ranks)
    rows = {
        int(i): (m.nodes.x[k], int(o))
        for m in models
        for k, (i, o) in enumerate(zip(m.nodes.id, m.nodes.owner, strict=True))
    }
    wanted = [np.random.default_rng([ranks, r]).choice(sorted(rows), 10 * r % 40, replace=False) for r in range(ranks)]

    def work(comm: ThreadComm) -> SurfaceNodes:
        ids = wanted[comm.rank].astype(np.int64)
        owners = np.array([rows[int(i)][1] for i in ids], np.int32)
        return ghosts.fetch(ids, owners, everything_of(models[comm.rank]), comm)

    for ids, got in zip(wanted, on_ranks(ranks, work), strict=True):
        assert sorted(got.id.tolist()) == sorted(ids.tolist())
        assert all((x == rows[int(i)][0]).all() for i, x in zip(got.id, got.x, strict=True))


@pytest.mark.parametrize("ranks", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.5])
def test_all_ranks_of_a_node_have_the_same_lists(ranks: int, share: float) -> None:
    """The lists of a node that has a contact on any rank are on its owner, on the ranks with the node and on the ranks
    with contacts. Each two of these ranks have lists with equal ids.
    """
    models, neighbours = models_of(ranks)
    random = np.random.default_rng([ranks, int(100 * share)])
    owner = {int(i): int(o) for m in models for i, o in zip(m.nodes.id, m.nodes.owner, strict=True)}
    pushed = [np.array(sorted(i for i in owner if random.uniform() < share), np.int64) for _ in range(ranks)]

    def work(comm: ThreadComm) -> "dict[int, np.ndarray]":
        used = pushed[comm.rank]
        owners = np.array([owner[int(i)] for i in used], np.int32)
        nodes = models[comm.rank].nodes
        return dict(ghosts.members(used, owners, neighbours[comm.rank], nodes, comm))

    found = on_ranks(ranks, work)
    company: dict[tuple[int, int], set[int]] = defaultdict(set)
    for node in {int(i) for ids in pushed for i in ids}:
        ranks_of = {r for r in range(ranks) if node in pushed[r] or node in models[r].nodes.id}
        for one, two in permutations(ranks_of | {owner[node]}, 2):
            company[one, two].add(node)
    for rank, lists in enumerate(found):
        assert {(rank, other) for other in lists} == {pair for pair in company if pair[0] == rank}
        for other, ids in lists.items():
            assert ids.tolist() == sorted(company[rank, other])
            assert (found[other][rank] == ids).all()
    assert bool(company) == (ranks > 1 and share > 0.0)


@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_copies_follow_their_owners_whenever_they_are_refreshed(ranks: int) -> None:
    models, _ = models_of(ranks)
    every = merged([everything_of(model) for model in models])

    def work(comm: ThreadComm) -> None:
        nodes = models[comm.rank].nodes
        random = np.random.default_rng([7, comm.rank])
        surface_nodes = every.take(np.sort(random.choice(every.n, 30, replace=False)))
        held = np.isin(surface_nodes.id, nodes.id)
        surface_nodes.local = np.where(held, np.searchsorted(nodes.id, surface_nodes.id), -1).astype(np.int32)
        order = ghosts.copies(surface_nodes, nodes, comm, Tag.GHOST)
        for turn in range(3):
            nodes.x[:] = 1000.0 * turn + nodes.id[:, None]
            nodes.v[:] = -nodes.x
            x, v, before = (np.full((surface_nodes.n, 3), np.nan) for _ in range(3))
            order.note(nodes)
            nodes.v[:] -= 1.0
            comm.barrier()
            order.begin(nodes)
            order.finish(x, v, before)
            assert (x[~held] == 1000.0 * turn + surface_nodes.id[~held, None]).all()
            assert (before[~held] == -x[~held]).all()
            assert (v[~held] == -x[~held] - 1.0).all()
            assert np.isnan(x[held]).all()
            comm.barrier()
        order.free()

    on_ranks(ranks, work)


def test_one_rank_shares_no_nodes() -> None:
    (model,), _ = models_of(1)
    ids = model.nodes.id[:5]
    assert ghosts.members(ids, np.zeros(5, np.int32), [], model.nodes, SerialComm()) == {}
