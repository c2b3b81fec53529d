"""The surface: every exposed face once, directed outward; every edge; and the sharp edges, at which two faces enclose
an angle.
"""

from collections import Counter
from typing import NamedTuple

import numpy as np
import pytest

from conoid.worker.contact.surface.records import Edges
from conoid.worker.contact.surface.surface import Surface
from conoid.worker.mesh.faces import FACES, across
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.state import Model

from ..worker.meshes import Floats, block, positive
from .bodies import meeting_of, moved, pieces_of, rotation, surface_of
from .ranks import on_ranks

CELLS = (2, 3, 4)
SIZE = 1e-3
BOX = SIZE * np.array(CELLS)
CUBES = {1: [(0, 0, 0)], 2: [(0, 0, 0), (1, 1, 0)], 3: [(0, 0, 0), (1, 0, 0), (0, 1, 0)]}
"""Corners of unit cubes: one cube; two cubes with only a common edge; three cubes in the form of an L."""


class Cut(NamedTuple):
    """The surface of a rank, and the model of the rank."""

    found: Surface
    model: Model


def shuffled(mesh: TetMesh, seed: int) -> TetMesh:
    """Returns the same body with its nodes and tets in another order."""
    random = np.random.default_rng(seed)
    place = random.permutation(len(mesh.points))
    tets = np.argsort(place)[mesh.tets[random.permutation(len(mesh.tets))]]
    return TetMesh(mesh.points[place], positive(mesh.points[place], tets))


def whole(mesh: TetMesh, planes: list[int] | None = None, edges: bool = True) -> Cut:
    """Returns the surface of a body on one rank; ``planes``: axes whose plane at zero is a symmetry plane."""
    ((piece, model),) = pieces_of(meeting_of([{}], {"self_contact": ("body0",)}), [mesh])
    on_plane = np.zeros((model.nodes.n, 3), bool)
    for axis in planes or []:
        on_plane[:, axis] = np.abs(model.nodes.x0[:, axis]) < 1e-12
    return Cut(surface_of(piece, model, planes=on_plane, edges=edges), model)


def cubes(corners: list[tuple[int, int, int]]) -> TetMesh:
    """Returns unit cubes at the given corners, with common nodes where the cubes touch."""
    unit = block((1, 1, 1), 1.0, 0.0)
    points = np.concatenate([unit.points + np.array(corner) for corner in corners])
    tets = np.concatenate([unit.tets + i * len(unit.points) for i in range(len(corners))])
    kept, place = np.unique(points, axis=0, return_inverse=True)
    return TetMesh(kept, positive(kept, place.reshape(-1)[tets]))


def table(edges: Edges) -> "np.ndarray":
    """Returns (n, 8) words of edges: ids of the two faces, nodes, the bit pattern of the length, and whether the edge
    is sharp.
    """
    return np.column_stack([edges.sides, edges.nodes, edges.size.view(np.int64), edges.sharp])


def sharp_ones(found: Surface) -> Edges:
    return found.edges.take(found.edges.sharp)


def normals(x: Floats, a: "np.ndarray", b: "np.ndarray", c: "np.ndarray") -> Floats:
    return np.asarray(np.cross(x[b] - x[a], x[c] - x[a]))


@pytest.mark.parametrize("seed", range(5))
def test_the_tet_across_a_face_is_the_other_one_with_its_three_nodes(seed: int) -> None:
    mesh = shuffled(block((2, 3, 2), seed=seed), seed)
    behind = across(mesh.tets)
    for tet, nodes in enumerate(mesh.tets):
        for face in range(4):
            three = set(nodes[FACES[face]].tolist())
            others = [i for i, four in enumerate(mesh.tets) if i != tet and three <= set(four.tolist())]
            assert behind[tet, face] // 4 == (others[0] if others else -1)
            if others:
                assert set(mesh.tets[others[0]][FACES[behind[tet, face] % 4]].tolist()) == three


def test_parts_that_touch_but_share_no_node_are_exposed_to_each_other() -> None:
    mesh = block((2, 2, 2), shake=0.0)
    both = np.concatenate([mesh.tets, mesh.tets + len(mesh.points)])
    assert (across(both) < 0).sum() == 2 * (across(mesh.tets) < 0).sum()
    ((piece, _),) = pieces_of(meeting_of([{}, {}]), [mesh, moved(mesh, (2.0, 0.0, 0.0))])
    assert (piece.across < 0).sum() == 2 * 6 * 4 * 2


def test_faces_are_oriented_outward_and_enclose_the_volume() -> None:
    found, model = whole(shuffled(block(CELLS, SIZE), 3))
    x, (a, b, c, d) = model.nodes.x0, found.faces.nodes.T
    normal = normals(x, a, b, c)
    assert (((x[d] - x[a]) * normal).sum(axis=1) < 0.0).all()
    assert np.abs(normal.sum(axis=0)).max() < 1e-12 * np.abs(normal).sum()
    assert (x[a] * normal).sum() / 6.0 == pytest.approx(BOX.prod(), rel=1e-12)
    assert found.faces.size == pytest.approx(np.sqrt(np.linalg.norm(normal, axis=1)), rel=1e-12)


def test_faces_are_named_by_tet_and_local_face_in_ascending_order() -> None:
    mesh = shuffled(block(CELLS, SIZE), 3)
    found, _ = whole(mesh)
    assert (np.diff(found.faces.id) > 0).all()
    tet, face = found.faces.id // 4, found.faces.id % 4
    assert (found.faces.nodes[:, :3] == np.take_along_axis(mesh.tets[tet], FACES[face], axis=1)).all()
    assert (found.faces.nodes[:, 3] == mesh.tets[tet, face]).all()
    assert set(found.faces.id.tolist()) == set(np.flatnonzero(across(mesh.tets).reshape(-1) < 0).tolist())


def test_nodes_of_the_skin_and_no_others_are_flagged() -> None:
    found, model = whole(block(CELLS, SIZE))
    x = model.nodes.x0
    assert (found.flags == ((x == 0.0) | (np.abs(x - BOX) < 1e-15)).any(axis=1)).all()


def test_sharp_edges_of_a_box_are_its_twelve_edges() -> None:
    """The mesh divides the twelve edges of the cube; diagonals of the flat faces are not sharp."""
    found, model = whole(shuffled(block(CELLS, SIZE), 4))
    x, edges = model.nodes.x0, sharp_ones(found)
    assert found.edges.n == 1.5 * found.faces.n
    assert edges.n == 4 * sum(CELLS)
    ends = x[edges.nodes[:, :2]]
    on_planes = (np.abs(ends) < 1e-15) | (np.abs(ends - BOX) < 1e-15)
    assert (on_planes.all(axis=1).sum(axis=1) == 2).all()
    assert edges.size == pytest.approx(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), rel=1e-12)
    assert edges.size.sum() == pytest.approx(4.0 * BOX.sum(), rel=1e-12)


def test_the_two_faces_of_an_edge_are_oriented_outward() -> None:
    found, model = whole(shuffled(block(CELLS, SIZE), 5))
    x, (a, b, c, d) = model.nodes.x0, found.edges.nodes[:, :4].T
    assert (found.edges.sides[:, 0] < found.edges.sides[:, 1]).all()
    for normal in (normals(x, a, b, c), normals(x, b, a, d)):
        assert (((x[a] - 0.5 * BOX) * normal).sum(axis=1) > 0.0).all()
    named = {tuple(sorted(row[:3])) for row in found.faces.nodes.tolist()}
    assert all(
        {tuple(sorted((a, b, c))), tuple(sorted((a, b, d)))} <= named
        for a, b, c, d in found.edges.nodes[:, :4].tolist()
    )


@pytest.mark.parametrize(("angle", "sharp"), [(20.0, False), (30.0, True)])
def test_an_edge_is_sharp_when_its_faces_turn_by_more_than_25_degrees(angle: float, sharp: bool) -> None:
    """The body is a roof: a box whose upper nodes are lifted in the middle."""
    mesh = block((2, 1, 1), shake=0.0)
    slope = np.tan(np.radians(0.5 * angle))
    mesh.points[:, 2] += np.where(mesh.points[:, 2] > 0.5, slope * (1.0 - np.abs(mesh.points[:, 0] - 1.0)), 0.0)
    found, model = whole(mesh)
    ridge = np.flatnonzero((model.nodes.x0[:, 0] == 1.0) & (model.nodes.x0[:, 2] > 1.0))
    assert (np.isin(sharp_ones(found).nodes[:, :2], ridge).all(axis=1).sum() == 1) == sharp


@pytest.mark.parametrize(("planes", "edges"), [([0], 8), ([0, 1], 5), ([0, 1, 2], 3)])
def test_a_symmetry_plane_has_neither_faces_nor_edges(planes: list[int], edges: int) -> None:
    n = 3
    found, model = whole(block((n, n, n), SIZE), planes)
    x = model.nodes.x0[found.faces.nodes[:, :3]]
    assert not any((np.abs(x[:, :, axis]) < 1e-12).all(axis=1).any() for axis in planes)
    assert found.faces.n == 2 * n * n * (6 - len(planes))
    assert sharp_ones(found).n == n * edges
    assert found.flags.any()


def test_without_edge_contact_there_are_no_edges() -> None:
    found, _ = whole(block(CELLS, SIZE), edges=False)
    assert found.edges.n == len(found.far) == len(found.far_owner) == 0


@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_ranks_together_have_the_surface_that_one_has(ranks: int) -> None:
    meshes = [block(CELLS, SIZE), moved(block((3, 3, 3), 0.8 * SIZE), (3 * SIZE, 0.0, 0.0), rotation((1, 1, 0), 0.6))]
    case = meeting_of([{}, {}])
    ((piece, model),) = pieces_of(case, meshes)
    one, pieces = surface_of(piece, model), pieces_of(case, meshes, ranks)
    found = on_ranks(ranks, lambda comm: surface_of(*pieces[comm.rank], comm))
    faces = np.concatenate([s.faces.nodes for s in found])[np.argsort(np.concatenate([s.faces.id for s in found]))]
    assert (faces == one.faces.nodes).all()
    edges = np.concatenate([table(s.edges) for s in found])
    assert (edges[np.lexsort(edges.T[1::-1])] == table(one.edges)).all()
    flagged = set(model.nodes.id[one.flags].tolist())
    for s, (_, part) in zip(found, pieces, strict=True):
        assert set(part.nodes.id[s.flags].tolist()) == flagged & set(part.nodes.id.tolist())


@pytest.mark.parametrize("ranks", [3, 7])
def test_far_nodes_are_those_of_its_edges_that_a_rank_does_not_hold(ranks: int) -> None:
    shaken = moved(block((3, 3, 3), shake=0.4), (0.0, 0.0, 0.0), rotation((1, 2, 3), 0.7))
    pieces = pieces_of(meeting_of([{}], {"self_contact": ("body0",)}), [shaken], ranks)
    owner = {int(i): int(o) for _, model in pieces for i, o in zip(model.nodes.id, model.nodes.owner, strict=True)}
    found = on_ranks(ranks, lambda comm: surface_of(*pieces[comm.rank], comm))
    for s, (_, model) in zip(found, pieces, strict=True):
        missing = sorted(set(s.edges.nodes.reshape(-1).tolist()) - set(model.nodes.id.tolist()))
        assert s.far.tolist() == missing
        assert s.far_owner.tolist() == [owner[i] for i in missing]
    assert sum(len(s.far) for s in found) > 0


def test_concave_edges_belong_to_the_list_too() -> None:
    """Concave edges are also sharp; the narrow phase tests whether an edge is convex."""
    found, model = whole(cubes(CUBES[3]))
    edges = sharp_ones(found)
    inner = (model.nodes.x0[edges.nodes[:, :2]][..., :2] == 1.0).all(axis=(1, 2))
    assert inner.sum() == 1
    assert edges.n == 18 + 4


@pytest.mark.parametrize("ranks", [2, 3])
def test_an_edge_with_four_faces_gives_one_answer_on_any_number_of_ranks(ranks: int) -> None:
    mesh = cubes(CUBES[2])
    case = meeting_of([{}], {"self_contact": ("body0",)})
    ((piece, model),) = pieces_of(case, [mesh])
    one, pieces = surface_of(piece, model), pieces_of(case, [mesh], ranks)
    found = on_ranks(ranks, lambda comm: surface_of(*pieces[comm.rank], comm))
    assert Counter(row for s in found for row in map(tuple, s.edges.nodes.tolist())) == Counter(
        map(tuple, one.edges.nodes.tolist())
    )


def test_where_four_faces_meet_every_two_that_run_against_each_other_make_an_edge() -> None:
    """The edges are those of the two cubes and those of the two gaps between the cubes; the edges of the gaps are
    convex only if the gaps are closed.
    """
    found, model = whole(cubes(CUBES[2]))
    x = model.nodes.x0[found.edges.nodes[:, :2]]
    common = (x[..., :2] == 1.0).all(axis=(1, 2))
    assert common.sum() == 4
    assert len(np.unique(found.edges.sides[common])) == 4
