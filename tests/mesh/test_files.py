"""Mesh files: gmsh .msh in four dialects, Abaqus .inp; groups, units, and every kind of bad file."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.model.bodies import MeshFile
from conoid.worker.errors import MeshError
from conoid.worker.mesh.build import build
from conoid.worker.mesh.child import Limits
from conoid.worker.mesh.model import TetMesh, check

WRITER = """
import gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
a, b = occ.addBox(0, 0, 0, 1, 1, 1), occ.addBox(1, 0, 0, 1, 1, 1)
occ.fragment([(3, a)], [(3, b)])
occ.synchronize()
gmsh.model.addPhysicalGroup(3, [a], 1, name="steel")
gmsh.model.addPhysicalGroup(3, [b], 7, name="glass_ball")
gmsh.model.addPhysicalGroup(2, [1], name="left")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
gmsh.model.mesh.generate(3)
for version in (2.2, 4.1):
    for binary in (0, 1):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(f"{version}-{binary}.msh")
gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
gmsh.write("gmsh.inp")
gmsh.model.mesh.setOrder(2)
gmsh.write("second.msh")
"""
FILES = ["2.2-0.msh", "2.2-1.msh", "4.1-0.msh", "4.1-1.msh", "gmsh.inp"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes two cubes with a common face with gmsh: the steel cube from x = 0, the glass cube from x = 1."""
    place = tmp_path_factory.mktemp("meshes")
    subprocess.run([sys.executable, "-c", WRITER], cwd=place, check=True, timeout=60)
    return place


def read(path: str, folder: Path, group: str | None = None, unit: float = 1.0) -> TetMesh:
    return build(MeshFile(shape="file", path=path, unit=unit, group=group), folder, "parts[1].mesh")


@pytest.mark.parametrize("path", FILES)
def test_every_dialect_gives_the_same_mesh(path: str, folder: Path) -> None:
    mesh = check(read(path, folder, unit=1e-3))
    assert mesh.volumes().sum() == pytest.approx(2e-9)
    assert mesh.points.max(axis=0).tolist() == [2e-3, 1e-3, 1e-3]
    first = read(FILES[0], folder, unit=1e-3)
    assert np.allclose(mesh.points, first.points, rtol=0, atol=1e-12)
    assert len(mesh.tets) == len(first.tets)


@pytest.mark.parametrize("path", ["2.2-1.msh", "4.1-0.msh", "gmsh.inp"])
def test_a_group_is_chosen_by_name(path: str, folder: Path) -> None:
    glass = read(path, folder, "glass_ball")
    assert glass.volumes().sum() == pytest.approx(1.0)
    assert glass.points.min(axis=0).tolist() == [1.0, 0.0, 0.0]


def test_a_physical_group_is_chosen_by_number_too(folder: Path) -> None:
    assert read("4.1-1.msh", folder, "7").points[:, 0].min() == 1.0


@pytest.mark.parametrize("path", ["4.1-1.msh", "gmsh.inp"])
def test_an_unknown_group_lists_the_known_ones(path: str, folder: Path) -> None:
    with pytest.raises(
        MeshError, match=r"^parts\[1\]\.mesh\.group = 'ice': no such .*glass_ball.*steel|steel.*glass_ball"
    ):
        read(path, folder, "ice")


@pytest.mark.parametrize("path", FILES[:4])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_file_that_was_cut_off_is_refused(path: str, share: float, folder: Path, tmp_path: Path) -> None:
    content = (folder / path).read_bytes()
    (tmp_path / path).write_bytes(content[: int(share * len(content))])
    with pytest.raises(MeshError, match=rf"mesh\.path = '{path}': the file is damaged or cut off"):
        read(path, tmp_path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "this is not a .msh file; its first line must be .MeshFormat"),
        (b"\x00\xff\x13garbage" * 500, "this is not a .msh file"),
        (b'SystemCall "touch started";\n', "this is not a .msh file"),
        (
            b'$MeshFormat\nSystemCall "touch started";\n',
            "the file is damaged or cut off: the section .MeshFormat has no end",
        ),
        (b'$MeshFormat\n2.2 0 8\n$EndMeshFormat\nSystemCall "touch started";\n', "stands in no section"),
        (b"$MeshFormat\n4 0 8\n$EndMeshFormat\n", "the .msh format '4' is not read"),
        (b"$MeshFormat\n4.1 1 8\n" + b"\x07\xf1" * 3000, "no tets|damaged"),
        (b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 99999999999 1 99999999999\n", "damaged|memory"),
    ],
)
def test_garbage_is_refused_in_one_line(content: bytes, message: str, tmp_path: Path) -> None:
    """The third file would start a program if gmsh read the file, because gmsh would execute it as a script."""
    (tmp_path / "bad.msh").write_bytes(content)
    with pytest.raises(MeshError, match=rf"^parts\[1\]\.mesh\.path = 'bad.msh': .*({message})") as raised:
        read("bad.msh", tmp_path)
    assert "\n" not in str(raised.value)
    assert [file.name for file in tmp_path.iterdir()] == ["bad.msh"]


def test_second_order_tets_are_read_either_way(folder: Path) -> None:
    corners = read("second.msh", folder)
    assert corners.volumes().sum() == pytest.approx(2.0)
    assert corners.origin is not None
    assert "are taken as the tets of their 4 corners" in corners.origin.notes[0]
    file = MeshFile(shape="file", path="second.msh", unit=1.0, second_order="eight")
    eight = check(build(file, folder, "mesh"))
    assert (len(eight.tets), eight.volumes().sum()) == (8 * len(corners.tets), pytest.approx(2.0))


def test_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "rod.stl").write_text("solid")
    with pytest.raises(MeshError, match=r"'rod.stl': expected a file name that ends in .msh, .inp, .k, "):
        read("rod.stl", tmp_path)


MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
5
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 {height}
50 1 1 -1
$EndNodes
$Elements
2
100 4 2 1 1 10 20 30 40
101 4 2 1 1 10 30 20 50
$EndElements
"""
INP = """*NODE
10, 0, 0, 0
20, 1, 0, 0
30, 0, 1, 0
40, 0, 0, {height}
50, 1, 1, -1
*ELEMENT, TYPE=C3D4
100, 10, 20, 30, 40
101, 10, 30, 20, 50
"""


@pytest.mark.parametrize(("name", "text"), [("two.msh", MSH), ("two.inp", INP)])
@pytest.mark.parametrize(("height", "word", "volume"), [("-1", "inverted", "-1.67e-10"), ("0", "flat", "0")])
def test_a_bad_tet_is_named_as_in_the_file(
    name: str, text: str, height: str, word: str, volume: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text.format(height=height))
    line = r" \(line 8\)" if name == "two.inp" else ""
    message = (
        rf"'{name}': tet 100{line} is {word}: its nodes 10, 20, 30, 40 span a volume of {volume} m\^3; .*\(1 of 2 tets"
    )
    with pytest.raises(MeshError, match=message):
        read(name, tmp_path, unit=1e-3)


def test_a_group_without_tets_is_named(tmp_path: Path) -> None:
    (tmp_path / "empty.inp").write_text(INP.format(height=1) + "*ELSET, ELSET=NONE\n")
    with pytest.raises(MeshError, match=r"^parts\[1\]\.mesh\.group = 'none': the group has no element with a volume$"):
        read("empty.inp", tmp_path, group="none")


@pytest.mark.parametrize("more", ["102, 10, 20, 30, 40", "102, 20, 30, 10, 40"])
def test_a_tet_that_is_there_twice_is_refused(more: str, tmp_path: Path) -> None:
    (tmp_path / "twice.inp").write_text(INP.format(height=1) + more)
    with pytest.raises(MeshError, match="elements 100 and 102 lie on the same side of a face that both have"):
        read("twice.inp", tmp_path)


def test_a_file_is_read_again_when_it_has_changed(tmp_path: Path) -> None:
    for height in (1, 2):
        (tmp_path / "two.inp").write_text(INP.format(height=height))
        assert read("two.inp", tmp_path).points[:, 2].max() == height


def test_reading_has_limits(tmp_path: Path) -> None:
    (tmp_path / "long.inp").write_text("*NODE\n" + "".join(f"{i}, 0, 0, 0\n" for i in range(1, 600_001)))
    file = MeshFile(shape="file", path="long.inp", unit=1.0)
    with pytest.raises(MeshError, match=r"memory"):
        build(file, tmp_path, limits=Limits(memory=160 * 2**20))
