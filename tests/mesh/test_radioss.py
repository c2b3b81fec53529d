"""The reader of Radioss starter decks: two styles, parts and subsets, groups and surfaces, and refusals."""

import math
from pathlib import Path
from random import Random

import numpy as np
import pytest

from conoid.cases.model.bodies import MeshFile
from conoid.cases.units import parse_quantity
from conoid.worker.errors import MeshError
from conoid.worker.mesh.lookup import meant
from conoid.worker.mesh.model import TetMesh
from conoid.worker.mesh.read import read

from .decks import parts
from .mixtures import mixture
from .starters import starter


def taken(path: Path, group: str | None = None) -> TetMesh:
    return read(MeshFile(shape="file", path=path.name, unit=1.0, group=group), path, "mesh")


def test_starter_decks_have_the_volume_of_their_parts(tmp_path: Path) -> None:
    for seed in range(20):
        random, truth = Random(seed), mixture(seed)
        split, path = parts(truth, random), tmp_path / f"r{seed}_0000.rad"
        path.write_text(starter(truth, split, random))
        volumes = truth.volumes()
        for group, numbers in (
            (None, volumes),
            ("all of it", volumes),
            *((f"piece {p}", each) for p, each in split.items()),
        ):
            expected = math.fsum(volumes[number] for number in numbers)
            assert taken(path, group).volumes().sum() == pytest.approx(expected, rel=1e-6), f"{seed} {group}"
        mesh = taken(path)
        clamp, skin = meant(mesh.sets, "clamp"), meant(mesh.sets, "SKIN")
        assert clamp is not None
        assert skin is not None
        assert skin.faces is not None
        assert (len(clamp.nodes), len(skin.faces)) == (len(range(0, len(truth.points), 2)), len(truth.surface()))


def row(*numbers: int) -> str:
    return "".join(f"{n:10d}" for n in numbers) + "\n"


NODES = "/NODE\n" + "".join(
    f"{k:10d}{x:20g}{y:20g}{z:20g}\n"
    for k, (x, y, z) in enumerate([(x, y, z) for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)], 1)
)
BRICKS = f"/BRICK/1\n{row(10, 1, 2, 4, 3, 5, 6, 8, 7)}/BRICK/2\n{row(20, 5, 6, 8, 7, 9, 10, 12, 11)}"
PARTS = f"/PART/1\nlower\n{row(1, 1, 7)}/PART/2\nupper\n{row(1, 1, 8)}/SUBSET/7\nboth\n{row(8)}/SUBSET/8\nhigh\n"
TWO = NODES + BRICKS + PARTS


@pytest.mark.parametrize(
    ("more", "name", "many", "faces"),
    [
        (f"/GRNOD/PART/1\ngrip\n{row(2)}", "grip", 8, None),
        (f"/GRNOD/SUBSET/1\n\n{row(8)}", "1", 8, None),
        (f"/GRNOD/GENE/1\n\n{row(1, 3, 9, 12)}", "nodes:1", 7, None),
        (f"/GRNOD/GRNOD/2\ng\n{row(1, -3)}/GRNOD/NODE/1\na\n{row(1, 2, 3)}/GRNOD/NODE/3\nb\n{row(3)}", "g", 2, None),
        (f"/SURF/SEG/1\ntop\n{row(1, 9, 10, 12, 11)}", "top", 4, 2),
        (f"/SURF/SEG/1\ntop\n{row(1, 9, 10, 12)}{row(2, 9, 12, 11, 11)}", "top", 4, 2),
        (f"/SURF/SURF/4\nall\n{row(1)}/SURF/PART/1\nx\n{row(1, 2)}", "all", 12, 20),
    ],
)
def test_groups_and_surfaces_are_read(more: str, name: str, many: int, faces: int | None, tmp_path: Path) -> None:
    (tmp_path / "two_0000.rad").write_text(TWO + more)
    found = meant(taken(tmp_path / "two_0000.rad").sets, name)
    assert found is not None
    assert (len(found.nodes), found.faces if found.faces is None else len(found.faces)) == (many, faces)


@pytest.mark.parametrize("length", ["mm", "cm", "in"])
def test_another_unit_than_that_of_the_deck_is_refused(length: str, tmp_path: Path) -> None:
    path = tmp_path / "two_0000.rad"
    path.write_text(f"/BEGIN\ntwo\n      2022         0\n{'kg':>20}{length:>20}{'ms':>20}\n{TWO}")
    with pytest.raises(MeshError, match=f"mesh.unit = 1.00 m, but the file is in {length}; mend the key or the file"):
        taken(path)
    unit = parse_quantity(f"1 {length}", "m")
    made = read(MeshFile(shape="file", path=path.name, unit=unit), path, "mesh")
    assert made.volumes().sum() == pytest.approx(2.0 * unit**3, rel=1e-12)


def test_a_group_with_undefined_nodes_is_reported(tmp_path: Path) -> None:
    (tmp_path / "two_0000.rad").write_text(f"{TWO}/GRNOD/NODE/1\ngrip\n{row(1, 2, 98, -99)}")
    origin = taken(tmp_path / "two_0000.rad").origin
    assert origin is not None
    assert "undefined members; these members are left out: /GRNOD grip (2, such as 98)" in " ".join(origin.notes)


@pytest.mark.parametrize(
    ("group", "expected"), [("both", 2.0), ("high", 1.0), ("2", 1.0), ("subset:8", 1.0), (None, 2.0)]
)
def test_a_part_or_a_subset_is_chosen(group: str | None, expected: float, tmp_path: Path) -> None:
    (tmp_path / "two.rad").write_text(TWO)
    assert taken(tmp_path / "two.rad", group).volumes().sum() == pytest.approx(expected)


def test_tets_are_read_in_one_line_and_in_two(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    edges = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
    points = [*corners, *((corners[a] + corners[b]) / 2 for a, b in edges)]
    nodes = "/NODE\n" + "".join(f"{k:10d}{x:20g}{y:20g}{z:20g}\n" for k, (x, y, z) in enumerate(points, 1))
    for text in (f"/TETRA4/1\n{row(1, 1, 2, 3, 4)}", f"/TETRA10/1\n{row(1)}{row(*range(1, 11))}"):
        (tmp_path / "tet.rad").write_text(nodes + text)
        assert taken(tmp_path / "tet.rad").volumes().sum() == pytest.approx(1 / 6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TWO.replace(row(10, 1, 2, 4, 3, 5, 6, 8, 7), row(10, 5, 6, 8, 7, 1, 2, 4, 3)), r"hexahedron 10 \(line 15\)"),
        (TWO.replace(row(20, 5, 6, 8, 7, 9, 10, 12, 11), row(20, 5, 6, 8, 7)), "line 17: an element of /BRICK with 4"),
        (TWO.replace(row(20, 5)[:-1], row(10, 5)[:-1]), "element 10 is defined twice"),
        (TWO.replace("        12", "        13", 1), r"hexahedron 20 \(line 17\) uses node 12, which is not defined"),
        (TWO.replace("/NODE\n", "/NODE/3\n"), "line 1: /NODE/3: nodes in a unit of their own are not read"),
        (f"#include mesh.inc\n{TWO}", "line 1: the included file 'mesh.inc' is no file there"),
        (f"{TWO}/TRANSFORM/TRA/1\n", "line 29: /TRANSFORM is not supported"),
        (f"{TWO}/NODES\n", "line 29: the keyword /NODES is not known; it could change the mesh"),
        (f"{TWO}/PART/1\n", "line 29: /PART/1 is defined twice"),
        (f"{TWO}/SPHCEL/1\n{row(30, 1)}", "1 lines of /SPHCEL, whose elements are not read"),
        (TWO.replace("1" + " " * 19 + "0", "1" + " " * 19 + "x"), "line 2: .* has no three coordinates"),
        ("hello\n", "line 1: 'hello' is before the first keyword"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_with_its_line(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "two.rad").write_text(text)
    with pytest.raises(MeshError, match=rf"^mesh\.path = 'two.rad': {message}") as raised:
        taken(tmp_path / "two.rad")
    assert "\n" not in str(raised.value)
