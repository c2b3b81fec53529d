"""Tied interface at the start: areas and integrals to rounding, constant stress between any meshes, gaps."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay

from conoid.cases import load
from conoid.cases.load import parse_case
from conoid.worker.bonds import clipping, interface
from conoid.worker.bonds.rows import Rows, assembled
from conoid.worker.errors import InputError
from conoid.worker.mesh.faces import FACES, across, areas
from conoid.worker.mesh.model import TetMesh
from conoid.worker.scene.assembly import assemble

from ..worker.meshes import Floats, block
from . import scenes
from .scenes import BOND, built, start


def turned(x: Floats, seed: int) -> Floats:
    """Returns the points after a random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return np.asarray(x @ (q * np.sign(np.linalg.det(q))).T)


@pytest.mark.parametrize("seed", range(5))
def test_the_pieces_of_a_face_add_up_to_it(seed: int) -> None:
    """A plane of random triangles covers a random triangle: the area, and the integrals of products with any linear
    function, agree."""
    rng = np.random.default_rng(seed)
    plane = rng.uniform(-3.0, 3.0, (60, 2))
    plane[:4] = [[-9, -9], [9, -9], [9, 9], [-9, 9]]
    masters = Delaunay(plane).simplices.astype(np.int32)
    e, f = (plane[masters[:, k]] - plane[masters[:, 0]] for k in (1, 2))
    up = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0] > 0.0
    masters[up] = masters[up][:, ::-1]  # the two triangles face each other
    corners = rng.uniform(-1.5, 1.5, (3, 2))
    d = corners[1:] - corners[0]
    corners = corners if d[0, 0] * d[1, 1] - d[0, 1] * d[1, 0] > 0.0 else corners[::-1]
    points = turned(np.column_stack([np.concatenate([plane, corners]), np.zeros(63)]), seed)
    slaves, n = np.array([[60, 61, 62]], np.int32), len(masters)
    pairs = np.ascontiguousarray(np.column_stack([np.zeros(n), np.arange(n)]), np.int32)
    area, far, own, both, corner = np.empty(n), np.empty((n, 2)), *(np.empty((n, 3, 3)) for _ in range(3))
    clipping.common(area, far, own, both, corner, points, slaves, masters, pairs)
    size = areas(points, slaves)[0]
    assert area.sum() == pytest.approx(size, rel=1e-12)
    assert np.abs(far[area > 0.0]).max() < 1e-12
    mass = size / 12.0 * (1.0 + np.eye(3))
    np.testing.assert_allclose(own.sum(axis=0), mass, rtol=0.0, atol=1e-12 * size)
    linear = points @ rng.normal(size=3)  # any linear function has the same value through the corners of each triangle
    np.testing.assert_allclose(
        np.einsum("pij,pj->i", both, linear[masters]), mass @ linear[slaves[0]], rtol=0.0, atol=1e-11 * size
    )


def rows_of(one: TetMesh, other: TetMesh, bond: str = "") -> tuple[Rows, interface.Found, Floats, "np.ndarray"]:
    """Returns the tied rows of two blocks, the second block on top of the first block, and the points and tets of the
    blocks.
    """
    case = load.parse_toml(
        scenes.start(1e-6) + scenes.block("below", (0, 0, 0), (1, 1, 1), 1)
        + scenes.block("above", (0, 0, 1), (1, 1, 2), 1) + scenes.BOND + bond
    )  # fmt: skip
    x, tets = np.concatenate([one.points, other.points]), np.concatenate([one.tets, other.tets + len(one.points)])
    part = np.repeat([0, 1], [len(one.tets), len(other.tets)])
    found = interface.find(case, x, tets.astype(np.int32), part, across(tets) < 0)
    corners = [tets[names // 4][np.arange(len(names))[:, None], FACES[names % 4]] for names in
               (found.pieces.slave, found.pieces.master)]  # fmt: skip
    return assembled(found.pieces, *corners), found, x, tets


def on_top(cells: tuple[int, int, int], seed: int, gap: float = 0.0) -> TetMesh:
    """Returns a block on top of a block of four by four by two cells, with the same size and other cells."""
    mesh = block(cells, shake=0.25, seed=seed)
    points = mesh.points * np.array([4.0 / cells[0], 4.0 / cells[1], 1.0]) + [0.0, 0.0, 2.0 + gap]
    return TetMesh(points, mesh.tets)


@pytest.mark.parametrize(("cells", "seed"), [((5, 7, 2), 1), ((3, 3, 1), 2), ((9, 4, 2), 3), ((4, 4, 2), 4)])
def test_a_constant_stress_passes_between_any_two_meshes(cells: tuple[int, int, int], seed: int) -> None:
    """Patch test: the forces of a unit traction on the tied nodes are equal to the forces on the faces of the mortar
    side, and a linear motion has no relative velocity.
    """
    one, other = block((4, 4, 2), shake=0.25, seed=seed + 10), on_top(cells, seed)
    rows, found, x, tets = rows_of(one, other)
    names = np.unique(found.pieces.master)
    masters = tets[names // 4][np.arange(len(names))[:, None], FACES[names % 4]]
    borne = np.bincount(masters.reshape(-1), np.repeat(areas(x, masters) / 3.0, 3), len(x))
    passed = np.bincount(rows.master, rows.area[rows.row] * rows.weight, len(x))
    assert rows.area.sum() == pytest.approx(16.0, rel=1e-13)
    np.testing.assert_allclose(passed, borne, rtol=0.0, atol=1e-13)
    motion = x @ np.random.default_rng(seed).normal(size=(3, 3)) + 1.0
    over = np.column_stack([np.bincount(rows.row, rows.weight * motion[rows.master, i]) for i in range(3)])
    np.testing.assert_allclose(motion[rows.node], over, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.x, x, rtol=0.0, atol=1e-13)


def test_the_finer_surface_lies_on_the_other_one() -> None:
    one, other = block((4, 4, 2)), on_top((9, 9, 2), 1, gap=0.01)
    rows, found, x, _ = rows_of(one, other)
    assert (rows.node >= len(one.points)).all()
    np.testing.assert_allclose(found.x[rows.node, 2], 2.0, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(found.x[rows.node, :2], x[rows.node, :2], rtol=0.0, atol=1e-13)
    assert len(np.unique(rows.node)) == 100


def test_overlaps_above_the_gap_are_refused_and_untied_nodes_counted() -> None:
    """Facets of 2.5 mm cut 0.2 mm off the hole of a tube; the rod in the tube has finer facets."""
    below = scenes.block("below", (0, 0, -4), (8, 8, 0), 2)
    above = scenes.block("above", (0, 0, -0.3), (8, 8, 4), 1.3)
    with pytest.raises(InputError, match=r"^bond\[0\].gap = 0.000\d* m: 'below' and 'above' overlap by 0.0003 m or"):
        built('contact = "none"\n' + start(1e-6) + below + above + BOND)
    rod = {"shape": "cylinder", "radius": "4 mm", "length": "10 mm", "element_size": "1 mm"}
    tube = {"shape": "tube", "inner_radius": "4 mm", "radius": "7 mm", "length": "10 mm", "element_size": "2.5 mm"}
    parts = [{"name": name, "material": "steel", "mesh": mesh} for name, mesh in (("rod", rod), ("tube", tube))]
    data = {"name": "joint", "run": {"end_time": "1 us"}, "parts": parts, "contact": "none"}
    whole = assemble(parse_case({**data, "bond": [{"parts": ["rod", "tube"], "kind": "tied"}]}), Path())
    (line,) = whole.warnings
    assert re.match(r"bond\[0\]: \d+ nodes of 'rod' are not tied: they lie up to 0.000\d* m inside 'tube', more", line)


def test_distances_above_the_gap_are_refused_or_counted() -> None:
    one = block((4, 4, 2))
    with pytest.raises(
        InputError, match=r"bond\[0\]\.gap = 0\.1\d* m: the nearest faces of 'below' and 'above' are 0.3"
    ):
        rows_of(one, on_top((4, 4, 2), 1, gap=0.3))
    rows, *_ = rows_of(one, on_top((4, 4, 2), 1, gap=0.3), "gap = 0.31")
    assert len(rows.node) == 25
    with pytest.raises(InputError, match=r"bond\[0\]\.parts: no faces of 'below' and 'above' lie face to face"):
        rows_of(one, on_top((4, 4, 2), 1, gap=9.0))
    beside = on_top((4, 4, 2), 1)
    beside.points[:, 0] += 4.0
    with pytest.raises(InputError, match="'below' and 'above' touch in a line or a point only"):
        rows_of(one, beside)
    tilted = on_top((4, 4, 2), 1)
    tilted.points[:, 2] += 0.2 * tilted.points[:, 0]
    _, found, *_ = rows_of(one, tilted, "gap = 0.3")
    assert len(found.warnings) == 1
    assert "nodes of 'below' are not tied: their distance from 'above' is up to 0.8 m" in found.warnings[0]
