"""The contact domain: all faces and edges that touch the boxes of another rank are sent to this rank. Domains of cells
send at most as many faces and edges as bounding boxes.
"""

import numpy as np
import pytest

from conoid.worker.contact.broad_phase import domain
from conoid.worker.contact.broad_phase.boxes import Boxes
from conoid.worker.contact.scene import layout
from conoid.worker.contact.scene.near_surface import NearSurface, Rules

from ..worker.meshes import block
from .bodies import Flags, meeting_of, moved, nodes_of, pieces_of, rotation, surface_of
from .ranks import ThreadComm, on_ranks

KINDS = ("box", "arbitrary")


class Share:
    """Boxes of one rank: the box of its nodes and edges, the box of its faces, and the box of its edges. Some ranks
    lack one of these three boxes.
    """

    def __init__(self, rank: int, seed: int, ranks: int) -> None:
        random = np.random.default_rng([seed, rank])
        middle = random.uniform(0.0, 0.5, 3)
        counts = random.integers(1, 120, 3) * (random.uniform(size=3) > 0.1)
        self.askers, self.faces, self.edges = (self.boxes(int(n), middle, random) for n in counts)

    @staticmethod
    def boxes(n: int, middle: "np.ndarray", random: np.random.Generator) -> Boxes:
        low = middle + random.normal(size=(n, 3)) * np.array([0.5, 0.3, 0.1])
        return Boxes(low, low + 10.0 ** random.uniform(-2.0, -0.7, (n, 3)))


def chosen(kind: str, shares: list[Share], edge: float) -> list[dict[int, list[Flags]]]:
    def work(comm: ThreadComm) -> dict[int, list[Flags]]:
        mine = shares[comm.rank]
        return domain.choose(kind, mine.askers, [mine.faces, mine.edges], edge, comm)

    return on_ranks(len(shares), work)


def touched(things: Boxes, askers: Boxes) -> Flags:
    """Returns (things,) whether each thing touches a box of the requesting ranks, by a comparison of all pairs."""
    low, high = askers.low[None], askers.high[None]
    touch = np.asarray(((things.low[:, None] <= high) & (things.high[:, None] >= low)).all(axis=2))
    return np.asarray(touch.any(axis=1))


@pytest.mark.parametrize("edge", [0.02, 0.2, 2.0])
@pytest.mark.parametrize("ranks", [2, 3, 5])
@pytest.mark.parametrize("kind", KINDS)
def test_faces_that_touch_boxes_of_another_rank_are_sent_there(kind: str, ranks: int, edge: float) -> None:
    sent = 0
    for seed in range(5):
        shares = [Share(rank, seed, ranks) for rank in range(ranks)]
        for rank, found in enumerate(chosen(kind, shares, edge)):
            assert rank not in found
            for other in set(range(ranks)) - {rank}:
                for k, things in enumerate((shares[rank].faces, shares[rank].edges)):
                    needed = touched(things, shares[other].askers)
                    got = found[other][k] if other in found else np.zeros(len(things.low), bool)
                    assert not (needed & ~got).any()
                    sent += int(needed.sum())
    assert sent > 10 * ranks


@pytest.mark.parametrize("edge", [0.02, 0.2])
def test_cells_choose_no_more_than_boxes_and_less_in_all(edge: float) -> None:
    ranks, counts = 4, dict.fromkeys(KINDS, 0)
    for seed in range(5):
        shares = [Share(rank, seed, ranks) for rank in range(ranks)]
        by_box, by_cell = (chosen(kind, shares, edge) for kind in KINDS)
        for box, cell in zip(by_box, by_cell, strict=True):
            assert set(cell) <= set(box)
            for rank, flags in cell.items():
                assert not any((few & ~many).any() for few, many in zip(flags, box[rank], strict=True))
        for kind, found in zip(KINDS, (by_box, by_cell), strict=True):
            counts[kind] += sum(int(f.sum()) for ranks_of in found for flags in ranks_of.values() for f in flags)
    assert counts["arbitrary"] < 0.9 * counts["box"]


def test_a_rank_that_needs_no_ghosts_is_left_out() -> None:
    shares = [Share(0, 1, 1), Share(1, 1, 1)]
    for boxes in (shares[1].askers, shares[1].faces, shares[1].edges):
        boxes.low += 100.0
        boxes.high += 100.0
    for kind in KINDS:
        assert chosen(kind, shares, 0.2) == [{}, {}]


def faces_received(kind: str, drift: float, ranks: int = 3) -> int:
    """Returns the number of ghost faces of all ranks for two blocks that approach each other at 10 m/s, and move
    together in x, y and z, m/s.
    """
    meshes = [
        block((4, 4, 4), 1e-3),
        moved(block((3, 3, 3), 1e-3), (1e-3, 1e-3, 4.5e-3), rotation((1, 2, 0), 0.2)),
    ]
    velocity = [(drift, drift, drift), (drift, drift, drift - 10.0)]
    case = meeting_of([{"velocity": v} for v in velocity])
    pieces = pieces_of(case, meshes, ranks)

    def work(comm: ThreadComm) -> int:
        piece, model = pieces[comm.rank]
        found, nodes = surface_of(piece, model, comm, edges=False), model.nodes
        used = np.flatnonzero(found.flags | np.isin(nodes.id, found.faces.nodes))
        surface_nodes = nodes_of(nodes.x, nodes.v, nodes.part)
        surface_nodes.id, surface_nodes.owner = nodes.id, nodes.owner
        owned = nodes.id[found.flags & nodes.owned]
        sides = NearSurface(found.faces, found.edges, surface_nodes.take(used), owned)
        rules = Rules(kind, ~np.eye(2, dtype=bool), 2e-3, 1e-4, 4e-4, np.zeros(2, bool))
        return len(layout.build(sides, rules, 5e-6, np.full(3, drift), nodes, comm).faces.id) - sides.faces.n

    return sum(on_ranks(ranks, work))


@pytest.mark.parametrize("kind", KINDS)
def test_a_common_velocity_sends_no_more_ghosts(kind: str) -> None:
    assert faces_received(kind, 1000.0) == faces_received(kind, 0.0)
