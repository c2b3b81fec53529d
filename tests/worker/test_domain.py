"""The cut of the mesh: each tet is on one rank, each shared node is listed on all its ranks and owned by one rank, and
shared sums are complete."""

import contextlib
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import parse_toml
from conoid.worker.errors import InputError
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.state import CHUNK, Ints
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.ownership import SharedSum
from conoid.worker.parallel.tags import Tag
from conoid.worker.scene import domain
from conoid.worker.scene.assembly import Whole
from conoid.worker.scene.domain import Piece

from .kernels import pieces_of, whole_of
from .meshes import block, free_tets

TWO_BOXES = """
name = "boxes"
run = { end_time = "1 us" }
[[parts]]
name = "left"
material = "steel"
mesh = { shape = "box", low = [0, 0, 0], high = [1e-3, 2e-3, 2e-3], element_size = 5e-4, generator = "structured" }
[[parts]]
name = "right"
material = "steel"
mesh = { shape = "box", low = [2e-3, 0, 0], high = [4e-3, 2e-3, 1e-3], element_size = 5e-4, generator = "structured" }
"""

RANKS = [1, 2, 3, 4, 5, 7, 16]
MESH = block((7, 4, 4), 1e-3, seed=3)


def cut(ranks: int) -> tuple[Whole, list[Piece]]:
    whole = whole_of(MESH)
    return whole, domain.cut(whole, ranks)


@pytest.mark.parametrize("ranks", RANKS)
def test_every_tet_belongs_to_one_rank(ranks: int) -> None:
    whole, pieces = cut(ranks)
    assert np.concatenate([p.tet_ids for p in pieces]).tolist() != list(range(len(whole.tets))) or ranks == 1
    assert sorted(np.concatenate([p.tet_ids for p in pieces])) == list(range(len(whole.tets)))
    for piece in pieces:
        assert (piece.node_ids[piece.tets] == whole.tets[piece.tet_ids]).all()
        assert (np.diff(piece.node_ids) > 0).all()
        assert set(piece.tets.ravel()) == set(range(len(piece.node_ids)))


@pytest.mark.parametrize("ranks", RANKS)
def test_every_node_is_owned_once_by_the_rank_of_its_first_tet(ranks: int) -> None:
    whole, pieces = cut(ranks)
    owners = np.concatenate([p.node_ids[p.owned] for p in pieces])
    assert sorted(owners) == list(range(len(whole.points)))
    first = {int(node): tet for tet in range(len(whole.tets) - 1, -1, -1) for node in whole.tets[tet]}
    for piece in pieces:
        mine = set(piece.tet_ids.tolist())
        assert all(first[int(node)] in mine for node in piece.node_ids[piece.owned])


@pytest.mark.parametrize("ranks", RANKS)
def test_holders_of_a_node_have_the_list_of_holders(ranks: int) -> None:
    """Each pair of ranks lists their common nodes in the same order; masses and positions are those of the whole
    mesh."""
    whole, pieces = cut(ranks)
    for (a, one), (b, other) in product(enumerate(pieces), repeat=2):
        if a == b:
            continue
        common = np.intersect1d(one.node_ids, other.node_ids)
        listed = [n for n in one.neighbours if n.rank == b]
        assert [n.rank for n in one.neighbours] == sorted({n.rank for n in one.neighbours})
        assert len(listed) == (len(common) > 0)
        if listed:
            assert (one.node_ids[listed[0].nodes] == common).all()
    for piece in pieces:
        assert (piece.mass == whole.mass[piece.node_ids]).all()
        assert (piece.points == whole.points[piece.node_ids]).all()
        assert piece.totals[2] == sum(
            (np.concatenate([p.node_ids for p in pieces]) == n).sum() > 1 for n in range(len(whole.points))
        )


@pytest.mark.parametrize("ranks", RANKS)
def test_border_chunks_hold_every_tet_of_a_shared_node(ranks: int) -> None:
    _, pieces = cut(ranks)
    for piece, model in pieces_of(pieces):
        shared = {int(node) for neighbour in piece.neighbours for node in neighbour.nodes}
        for block_ in model.blocks:
            inside = block_.tets[block_.border_chunks * CHUNK :]
            assert not shared & set(inside.ravel().tolist())
            assert block_.border_chunks <= -(-len(block_.tets) // CHUNK)
            assert (block_.border_chunks == 0) == (not piece.border.any())


def test_mass_is_shared_by_quarters() -> None:
    whole = whole_of(MESH)
    assert whole.volumes.sum() == pytest.approx(7e-3 * 4e-3 * 4e-3, rel=1e-13)
    assert whole.mass.sum() == pytest.approx(7850.0 * 112e-9, rel=1e-13)
    corner = int(np.flatnonzero((whole.points == 0.0).all(axis=1))[0])
    round_it = (whole.tets == corner).any(axis=1)
    assert whole.mass[corner] == pytest.approx(7850.0 / 4.0 * whole.volumes[round_it].sum(), rel=1e-14)


class Postbox:
    """A communicator whose ranks run one after the other in one process: ``begin`` of all ranks comes before
    ``finish`` of any rank."""

    def __init__(self) -> None:
        self.letters: dict[tuple[int, int, int], Ints] = {}

    def of(self, rank: int) -> "Desk":
        return Desk(self, rank)


class Desk(SerialComm):
    def __init__(self, box: Postbox, rank: int) -> None:
        self.box, self.rank = box, rank

    def exchange(self, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: int) -> "Round":
        return Round(self, sends, receives, tag)


class Round:
    def __init__(self, desk: Desk, sends: list[tuple[int, Ints]], receives: list[tuple[int, Ints]], tag: int) -> None:
        self.desk, self.sends, self.receives, self.tag = desk, sends, receives, tag

    def begin(self) -> None:
        for target, buffer in self.sends:
            self.desk.box.letters[self.desk.rank, target, self.tag] = buffer.copy()

    def finish(self) -> None:
        for source, buffer in self.receives:
            buffer[:] = self.desk.box.letters.pop((source, self.desk.rank, self.tag))

    def free(self) -> None:
        pass


@pytest.mark.parametrize("ranks", RANKS)
def test_shared_sums_are_those_of_one_rank(ranks: int) -> None:
    """The nodal sums of the test are random integers of each tet. After the sums of the neighbour ranks were added,
    every rank has the sum of the whole mesh."""
    whole, pieces = cut(ranks)
    words = np.random.default_rng(7).integers(-(2**52), 2**52, (len(whole.tets), 4, 3))
    total = np.zeros((len(whole.points), 3), np.int64)
    np.add.at(total, whole.tets, words)
    box, sums, shared = Postbox(), [], []
    for rank, piece in enumerate(pieces):
        own = np.zeros((len(piece.node_ids), 3), np.int64)
        sums.append(own)
        shared.append(SharedSum(box.of(rank), piece.neighbours, 3, Tag.FORCE))
    for _ in range(2):
        for piece, own, exchange in zip(pieces, sums, shared, strict=True):
            own[:] = 0
            np.add.at(own, piece.tets, words[piece.tet_ids])
            exchange.begin(own)
        for own, exchange in zip(sums, shared, strict=True):
            exchange.finish(own)
        for piece, own in zip(pieces, sums, strict=True):
            assert (own == total[piece.node_ids]).all()
    assert not box.letters


def test_tets_without_common_nodes_need_no_neighbours() -> None:
    heap = free_tets(40, 8)
    for piece in domain.cut(whole_of(TetMesh(heap.points, heap.tets)), 4):
        assert not piece.neighbours
        assert piece.owned.all()
        assert not piece.border.any()


TWO_TETS = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
5, 0, 0, -1
6, 0, 0, 0
7, 1, 0, 0
8, 0, 1, 0
*ELEMENT, TYPE=C3D4
1, 1, 2, 3, 4
"""
"""Nodes 6 to 8 have the positions of nodes 1 to 3."""


@pytest.mark.parametrize(
    ("second", "more", "warned"),
    [
        ("2, 1, 3, 2, 5", "", False),
        ("2, 6, 8, 7, 5", "", True),
        ("2, 6, 8, 7, 5", "contact = { self_contact = ['body'] }", False),
    ],
)
def test_separate_pieces_of_a_part_are_reported(second: str, more: str, warned: bool, tmp_path: Path) -> None:
    (tmp_path / "two.inp").write_text(TWO_TETS + second)
    mesh = "mesh = { shape = 'file', path = 'two.inp', unit = '1 mm' }"
    case = parse_toml(f"name='two'\n{more}\nrun={{end_time='1 us'}}\n[[parts]]\nname='body'\nmaterial='steel'\n{mesh}")
    _, piece = domain.build(case, tmp_path, SerialComm())
    unjoined = "parts[0].mesh: about 0.5 mm^2 of its faces lie on other faces of the part"
    assert [re.split(", without contact| without the same", text)[0] for text in piece.warnings] == [
        *["parts[0].mesh: 2 pieces that share no node"] * warned, *[unjoined] * ("6, 8" in second)
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("overlap", "message"),
    [
        ("refuse", r"^parts: a piece of 'body' overlaps another of its pieces by 0\.0001\d* m at \(.*\) m; move them"),
        ("push", None),
    ],
)
def test_pieces_of_a_part_that_meets_itself_may_not_overlap(overlap: str, message: str | None, tmp_path: Path) -> None:
    """The upper tet is on top of the lower tet and penetrates it by 0.1 mm."""
    deeper = TWO_TETS.replace("5, 0, 0, -1", "5, 0, 0, -1.1")
    for node in ("6, 0, 0", "7, 1, 0", "8, 0, 1"):
        deeper = deeper.replace(f"{node}, 0", f"{node}, 0.1")
    (tmp_path / "two.inp").write_text(deeper + "2, 6, 8, 7, 5")
    mesh = "mesh = { shape = 'file', path = 'two.inp', unit = '1 mm' }"
    meets = f"contact = {{ self_contact = ['body'], overlap = '{overlap}' }}"
    case = parse_toml(f"name='two'\n{meets}\nrun={{end_time='1 us'}}\n[[parts]]\nname='body'\nmaterial='steel'\n{mesh}")
    with pytest.raises(InputError, match=message) if message else contextlib.nullcontext():
        domain.build(case, tmp_path, SerialComm())


def test_the_start_reports_its_progress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cached meshes are read without a progress message."""
    monkeypatch.setenv("CONOID_CACHE_DIR", str(tmp_path))
    case = parse_toml(TWO_BOXES)
    received: list[list[str]] = []
    for _ in range(2):
        received.append([])
        domain.build(case, tmp_path, SerialComm(), received[-1].append)
    assert received[0] == ["meshing left, part 1 of 2", "meshing right, part 2 of 2", "cutting 384 tets for 1 rank"]
    assert received[1] == received[0][-1:]
