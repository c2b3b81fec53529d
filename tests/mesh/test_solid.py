"""Hexahedra, wedges and pyramids cut into tets with matching faces; tets of ten nodes; degenerate hexahedra."""

import math

import numpy as np
import pytest

from conoid.worker.errors import MeshError
from conoid.worker.mesh.cells import HEX8, HEX20, TET4, TET10, cells
from conoid.worker.mesh.faces import across, boundary_faces, same_side
from conoid.worker.mesh.model import check
from conoid.worker.mesh.named import NamedMesh
from conoid.worker.mesh.patterns import cuts
from conoid.worker.mesh.solid import Content, solid

from .mixtures import Mixture, mixture, turned

SEEDS = range(100)


def judge(made: NamedMesh, truth: Mixture) -> None:
    """Checks three properties: the tets of every element have the volume of the element, every inner face has two tets,
    and the surface is that of the elements.
    """
    mesh = check(made.mesh, made.names)
    volumes = mesh.volumes()
    for number, expected in truth.volumes().items():
        assert math.fsum(volumes[made.names.tets == number]) == pytest.approx(expected, rel=1e-12)
    assert len(same_side(mesh.tets)) == 0
    faces = boundary_faces(mesh.tets)
    assert {turned(face) for face in made.places[faces].tolist()} == truth.surface()
    assert int((across(mesh.tets) < 0).sum()) == len(faces)
    edges = np.sort(np.concatenate([faces[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()


def made_or_refused(truth: Mixture) -> NamedMesh | None:
    try:
        return solid(truth.content())
    except MeshError as error:
        message = str(error)
    assert "so distorted" in message or "inverted" in message
    return None


@pytest.mark.parametrize("degenerate", [False, True])
def test_a_hundred_random_mixtures_have_their_volume_and_their_surface(degenerate: bool) -> None:
    for seed in SEEDS:
        truth = mixture(seed)
        judge(solid(truth.content(degenerate)), truth)


@pytest.mark.slow
def test_a_thousand_strongly_warped_mixtures_do_or_are_refused() -> None:
    done = 0
    for seed in range(1000):
        truth = mixture(seed, jitter=0.28)
        made = made_or_refused(truth)
        if made is None:
            continue
        judge(made, truth)
        done += 1
    assert done > 500


def test_the_cube_has_seventy_four_cuts() -> None:
    """The number of triangulations is from De Loera, Rambau, Santos 2010, "Triangulations", theorem 6.3.10."""
    every = [cut for pattern in range(64) for cut in cuts(pattern)]
    assert len(every) == 74
    assert sum(not row[-1].any() for row in every) == 2, "two of five tets, the others of six"


CUBE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


def one(nodes: list[int], points: np.ndarray = CUBE, line: int = 0) -> NamedMesh:
    return solid(
        Content(np.arange(1, len(points) + 1), points, [cells(HEX8, np.array([7]), np.array(nodes), np.array([line]))])
    )


@pytest.mark.parametrize(
    ("nodes", "volume", "tets"),
    [
        ([0, 1, 2, 3, 4, 5, 6, 7], 1.0, 6),
        ([0, 1, 2, 2, 4, 5, 6, 6], 0.5, 3),
        ([1, 0, 4, 5, 3, 3, 7, 7], 0.5, 3),
        ([0, 1, 2, 3, 4, 4, 4, 4], 1 / 3, 2),
        ([0, 1, 2, 3, 3, 3, 3, 3], None, 0),
        ([0, 1, 3, 4, 4, 4, 4, 4], 1 / 6, 1),
        ([0, 1, 3, 3, 4, 4, 4, 4], 1 / 6, 1),
        ([0, 1, 2, 3, 4, 5, 6, 6], 2 / 3, 4),
    ],
)
def test_a_hexahedron_may_repeat_nodes(nodes: list[int], volume: float | None, tets: int) -> None:
    """The degenerate hexahedron is a wedge in two ways, a pyramid, a flat tet, a tet in two ways, or lacks one edge."""
    if volume is None:
        with pytest.raises(MeshError, match="hexahedron 7 is flat"):
            one(nodes)
        return
    found = one(nodes)
    assert (len(found.mesh.tets), found.mesh.volumes().sum()) == (tets, pytest.approx(volume))


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ([4, 5, 6, 7, 0, 1, 2, 3], r"^hexahedron 7 \(line 12\) is inverted \(1 of 1 elements\)$"),
        ([0, 1, 2, 3, 0, 1, 2, 3], r"^hexahedron 7 \(line 12\) is flat"),
        ([0, 1, 2, 3, 4, 5, 0, 7], r"^hexahedron 7 \(line 12\) repeats nodes in a way that leaves no wedge"),
        ([0, 1, 0, 3, 4, 5, 6, 7], r"^hexahedron 7 \(line 12\) repeats nodes"),
        ([0, 1, 2, 2, 2, 2, 2, 2], r"^hexahedron 7 \(line 12\) repeats nodes"),
        ([0, 2, 1, 3, 4, 5, 6, 7], r"^hexahedron 7 \(line 12\) is "),
    ],
)
def test_an_element_without_a_proper_volume_is_refused_with_its_line(nodes: list[int], message: str) -> None:
    with pytest.raises(MeshError, match=message):
        one(nodes, line=12)


@pytest.mark.parametrize(("raised", "share"), [(4, 1 / 3), (5, 1 / 6)])
def test_warped_faces_are_reported_with_their_lost_volume(raised: int, share: float) -> None:
    """A corner of the unit cube is raised by h. The volume below a bilinear top is larger by h / 4. The volume below
    the two triangles is larger by h / 3 if the diagonal ends at this corner, as it does at the smallest number, else by
    h / 6.
    """
    points = CUBE.copy()
    points[raised, 2] += 0.3
    found = one(list(range(8)), points)
    assert found.mesh.volumes().sum() == pytest.approx(1 + 0.3 * share)
    lost = (0.25 - share) * 0.3 / (1 + 0.3 * share)
    message = f"{100 * abs(lost):.2g} % {'less' if lost > 0 else 'more'} volume"
    assert found.notes[1] == f"each face that is not flat becomes two triangles, with {message}"


@pytest.mark.parametrize("other", [False, True])
def test_a_quadrilateral_beside_two_tets_takes_their_diagonal(other: bool) -> None:
    """Half a cube is a wedge, and two tets with either diagonal are on the face 0 2 6 4 of the cube."""
    wedge = cells(HEX8, np.array([1]), np.array([[0, 1, 2, 2, 4, 5, 6, 6]]))
    rows = [(2, 4, 6, 8), (2, 0, 4, 8)] if other else [(0, 6, 2, 8), (0, 4, 6, 8)]
    points = np.concatenate([CUBE, [[0.1, 0.9, 0.5]]])
    found = solid(Content(np.arange(9), points, [wedge, cells(TET4, np.array([2, 3]), np.array(rows))]))
    check(found.mesh, found.names)
    assert len(boundary_faces(found.mesh.tets)) == 2 * 2 + 2 + 4
    assert len(same_side(found.mesh.tets)) == 0


# Second order ---------------------------------------------------------------------------------------------------------

EDGES = TET10.edges


def ball(bulge: float) -> Content:
    """Returns two tets of ten nodes whose midside nodes are moved outwards by a fraction of the edges."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    rows = [(0, 1, 2, 3), (1, 2, 3, 4)]
    points, middles, nodes = corners.tolist(), dict[tuple[int, int], int](), []
    for row in rows:
        made = list(row)
        for a, b in ((row[i], row[j]) for i, j in EDGES):
            key = min(a, b), max(a, b)
            if key not in middles:
                middle = (corners[a] + corners[b]) / 2
                middles[key] = len(points)
                points.append((middle + bulge * (middle - corners.mean(axis=0))).tolist())
            made.append(middles[key])
        nodes.append(made)
    return Content(np.arange(1, len(points) + 1), np.array(points), [cells(TET10, np.array([5, 6]), np.array(nodes))])


def test_tets_of_ten_nodes_become_eight_or_their_corners() -> None:
    straight, curved = ball(0.0), ball(0.2)
    corners, eight = solid(straight), solid(straight, "eight")
    assert (len(corners.mesh.tets), len(eight.mesh.tets)) == (2, 16)
    assert corners.mesh.volumes().sum() == pytest.approx(eight.mesh.volumes().sum(), rel=1e-14)
    check(eight.mesh, eight.names)
    assert len(boundary_faces(eight.mesh.tets)) == 6 * 4
    assert corners.notes[0].startswith(
        "2 tets of 10 nodes are taken as the tets of their 4 corners, with the same volume;"
    )
    round_ = solid(curved)
    check(round_.mesh, round_.names)
    assert len(round_.mesh.tets) == 16, "the corners would lose more than a thousandth"
    assert round_.notes[0].startswith(
        "2 tets of 10 nodes are taken as eight tets of 4 nodes each; their corners alone would"
    )
    assert len(solid(curved, "corners").mesh.tets) == 2


def test_the_volume_that_corners_lose_is_that_of_the_quadratic_element() -> None:
    """Three edges of the unit tet are bent by h along -z. Each bent edge adds A h / 3 below the tet, and one of them
    removes as much at the slanted face (the integral of the shape function of such a node over a triangle is a third of
    its area).
    """
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    middles = np.array([(corners[a] + corners[b]) / 2 for a, b in EDGES])
    middles[:3, 2] -= 0.01
    points = np.concatenate([corners, middles])
    found = solid(Content(np.arange(10), points, [cells(TET10, np.array([1]), np.arange(10))]), "corners")
    lost = (3 - 1) * 0.5 * 0.01 / 3
    assert f"{100 * lost / (1 / 6 + lost):.2g} % less volume than the curved elements" in found.notes[0]


def test_a_mesh_that_eight_tets_cannot_match_is_refused() -> None:
    whole = ball(0.0)
    torn = Content(np.arange(1, len(whole.points) + 2), np.concatenate([whole.points, whole.points[6:7]]), whole.cells)
    torn.cells[0].nodes[1][torn.cells[0].nodes[1] == 6] = len(whole.points)
    with pytest.raises(
        MeshError, match=r"^node \d+ is in the middle of the edge between nodes 2 and 3, but not in every"
    ):
        solid(torn, "eight")
    whole = ball(0.0)
    gmsh = whole.cells[0].nodes[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    with pytest.raises(MeshError, match=r"^tet 5: node \d+ is not near the middle of the edge between nodes 2 and 4$"):
        solid(Content(whole.tags, whole.points, [cells(TET10, np.array([5, 6]), gmsh)]))
    tet = cells(TET4, np.array([9]), np.array([[1, 2, 3, 4]]))
    first = cells(TET10, np.array([5]), whole.cells[0].nodes[:1])
    mixed = Content(whole.tags, whole.points, [first, tet])
    with pytest.raises(MeshError, match=r"^second_order = 'eight': 1 elements have no nodes in the middle"):
        solid(mixed, "eight")
    assert len(solid(mixed).mesh.tets) == 2


def test_hexahedra_of_twenty_nodes_are_taken_by_their_corners() -> None:
    """The four upper edges of a cube are bent outwards by h along z: each edge adds A h / 3 on the top face."""
    middles = np.array([(CUBE[a] + CUBE[b]) / 2 for a, b in HEX20.edges])
    middles[4:8, 2] += 0.03
    points = np.concatenate([CUBE, middles])
    found = solid(Content(np.arange(20), points, [cells(HEX20, np.array([1]), np.arange(20))]))
    assert found.mesh.volumes().sum() == pytest.approx(1.0)
    assert found.notes[0] == "1 hexahedra of 20 nodes are read with their corners only, with 4 % less volume"
