"""The reader of .msh files, in this process: files that gmsh writes with every option, and damaged files."""

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from conoid.worker.errors import MeshError
from conoid.worker.mesh.msh import reading
from conoid.worker.mesh.named import NamedMesh
from conoid.worker.mesh.solid import solid

WRITER = """
import itertools
import gmsh
gmsh.initialize()
number = gmsh.option.setNumber
number("General.Terminal", 0)
occ = gmsh.model.occ
a, b = occ.addBox(0, 0, 0, 2, 2, 5), occ.addBox(0, 0, 5, 2, 2, 5)
occ.fragment([(3, a)], [(3, b)])
occ.synchronize()
gmsh.model.addPhysicalGroup(3, [a], 1, name="lower")
gmsh.model.addPhysicalGroup(3, [b], 2, name="upper")
gmsh.model.addPhysicalGroup(3, [a, b], 3, name="all")
gmsh.model.addPhysicalGroup(2, [1], 1, name="left")
number("Mesh.MeshSizeMax", 1.5)
gmsh.model.mesh.generate(3)
def write(kind):
    for version, binary in itertools.product((2.2, 4.1), (0, 1)):
        number("Mesh.MshFileVersion", version)
        number("Mesh.Binary", binary)
        gmsh.write(f"{kind}-{version}-{binary}.msh")
write("plain")
for name in ("SaveAll", "SaveParametric"):
    number(f"Mesh.{name}", 1)
    write(name)
    number(f"Mesh.{name}", 0)
number("Mesh.PartitionCreateGhostCells", 1)
gmsh.model.mesh.partition(3)
write("ghosts")
number("Mesh.PartitionSplitMeshFiles", 1)
write("split")
"""
DIALECTS = [f"{version}-{binary}" for version, binary in itertools.product((2.2, 4.1), (0, 1))]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes two boxes of 20 m^3 with a common face, with the groups lower, upper and all; the last group contains both
    boxes.
    """
    place = tmp_path_factory.mktemp("msh")
    subprocess.run([sys.executable, "-c", WRITER], cwd=place, check=True, timeout=120)
    return place


def read_msh(path: Path, group: str | None, key: str) -> NamedMesh:
    return solid(reading.read_msh(path, group, key))


def volume(found: NamedMesh) -> float:
    return float(found.mesh.volumes().sum())


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("kind", ["plain", "SaveAll", "SaveParametric", "ghosts"])
def test_each_group_has_its_own_tets_once(kind: str, dialect: str, folder: Path) -> None:
    """Some tets are in two groups; a file of the format 2.2 lists such a tet once for each group. Some tets in the file
    are ghost cells.
    """
    path = folder / f"{kind}-{dialect}.msh"
    if kind == "SaveAll" and dialect.startswith("2.2"):  # gmsh omits the groups in a file of this format
        assert len(read_msh(path, "lower", "mesh").mesh.tets) == 0
        assert volume(read_msh(path, None, "mesh")) == pytest.approx(40.0)
        return
    for group, expected in (("lower", 20.0), ("upper", 20.0), ("all", 40.0), ("2", 20.0), (None, 40.0)):
        found = read_msh(path, group, "mesh")
        assert volume(found) == pytest.approx(expected)
        assert len(np.unique(np.sort(found.mesh.tets, axis=1), axis=0)) == len(found.mesh.tets)
        assert found.notes == ()


@pytest.mark.parametrize("binary", [0, 1])
def test_the_files_of_partitions_add_up_without_their_ghost_cells(binary: int, folder: Path) -> None:
    found = [read_msh(folder / f"split-4.1-{binary}_{i}.msh", None, "mesh") for i in (1, 2, 3)]
    assert sum(map(volume, found)) == pytest.approx(40.0)
    assert found[0].notes == ("the file is a part of a mesh: of 3 partitions, these are missing: 2, 3",)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_two_groups_of_one_name_are_taken_together(dialect: str, folder: Path, tmp_path: Path) -> None:
    content = (folder / f"plain-{dialect}.msh").read_bytes().replace(b'"upper"', b'"lower"')
    (tmp_path / "same.msh").write_bytes(content)
    found = read_msh(tmp_path / "same.msh", "lower", "mesh")
    assert volume(found) == pytest.approx(40.0)
    assert found.notes == ("several groups have the name 'lower' and are united: 1, 2",)
    assert volume(read_msh(tmp_path / "same.msh", "2", "mesh")) == pytest.approx(20.0)


@pytest.mark.parametrize("version", ["2.2-0", "4.1-0"])
def test_text_may_begin_with_a_byte_order_mark_and_have_other_ends_of_lines(
    version: str, folder: Path, tmp_path: Path
) -> None:
    content = (folder / f"plain-{version}.msh").read_bytes()
    for changed in (
        b"\xef\xbb\xbf" + content,
        content.replace(b"\n", b"\r\n"),
        b"$Comments\nhere\n$EndComments\n\n" + content,
    ):
        (tmp_path / "changed.msh").write_bytes(changed)
        assert volume(read_msh(tmp_path / "changed.msh", "upper", "mesh")) == pytest.approx(20.0)


def test_an_unknown_group_lists_those_of_volumes(folder: Path) -> None:
    for group, but in (("ice", ""), ("left", r" \('left' is a group of surfaces\)"), ("Lower", ""), ("4", "")):
        message = rf"^mesh\.group = '{group}': no such group of volumes{but}; known: lower, upper, all$"
        with pytest.raises(MeshError, match=message):
            read_msh(folder / "plain-4.1-0.msh", group, "mesh")


NODES = "$Nodes\n5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 1 1 -1\n$EndNodes\n"
TETS = "$Elements\n2\n100 4 2 1 1 10 20 30 40\n101 4 2 2 1 10 30 20 50\n$EndElements\n"
SMALL = f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{NODES}{TETS}"
NAMES = '$PhysicalNames\n2\n3 1 "{}"\n3 2 "{}"\n$EndPhysicalNames\n'


def test_groups_of_one_entity_are_distinguished(tmp_path: Path) -> None:
    (tmp_path / "small.msh").write_text(SMALL)
    assert [read_msh(tmp_path / "small.msh", group, "mesh").names.tets.tolist() for group in ("1", "2", None)] == [
        [100], [101], [100, 101],
    ]  # fmt: skip


def test_a_name_that_is_the_number_of_another_group_is_refused(tmp_path: Path) -> None:
    (tmp_path / "small.msh").write_text(SMALL.replace("$Nodes", NAMES.format("2", 'Körper "1"') + "$Nodes"))
    with pytest.raises(MeshError, match=r"mesh\.group = '2': the name of one group and the number of another group"):
        read_msh(tmp_path / "small.msh", "2", "mesh")
    assert read_msh(tmp_path / "small.msh", 'Körper "1"', "mesh").names.tets.tolist() == [101]


POLYHEDRON = "3\n102 29 2 3 1 {}\n".format(" ".join(["10"] * 20))


def test_other_volumes_are_refused_where_they_are_chosen(tmp_path: Path) -> None:
    (tmp_path / "small.msh").write_text(SMALL.replace("$Elements\n2\n", f"$Elements\n{POLYHEDRON}"))
    with pytest.raises(MeshError, match=r"^1 elements of the type 29 of gmsh \(the first is 102\); elements with a"):
        read_msh(tmp_path / "small.msh", None, "mesh")
    found = read_msh(tmp_path / "small.msh", "2", "mesh")
    assert found.names.tets.tolist() == [101]
    assert found.notes == ("elements that cannot be read are outside of the group: 1 of the type 29 of gmsh",)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "$Nodes\n5",
            "$Nodes\n6",
            r"the file is damaged or cut off: the section \$Nodes has fewer numbers than its counts",
        ),
        ("$Nodes\n5", "$Nodes\n4", r"the section \$Nodes has more numbers than its counts"),
        ("$Nodes\n5", "$Nodes\n-1", r"the section \$Nodes has fewer numbers"),
        ("10 0 0 0", "10 0 x 0", r"the section \$Nodes has a word that is no number"),
        ("10 0 0 0", "10.5 0 0 0", r"the section \$Nodes has a node whose number is not whole"),
        ("20 1 0 0", "10 1 0 0", "node 10 is defined twice"),
        ("101 4 2 2", "100 4 2 2", "element 100 is defined twice"),
        ("10 30 20 50", "10 30 20 60", "tet 101 uses node 60, which is not defined"),
        ("$Elements\n2", "$Elements\n3", r"the section \$Elements has fewer numbers than its counts"),
        ("101 4 2 2 1", "101 4 2.5 2 1", r"the section \$Elements has 2.5 where a whole number is expected"),
        ("101 4 ", "101 999 ", "the file has elements of the type 999 of gmsh, which is not supported"),
        ("$EndNodes", "$EndNode", r"the section \$Nodes has no end"),
        ("$EndNodes\n", f"$EndNodes\n{NODES}", r"the file is damaged: it has two sections \$Nodes"),
        ("$EndNodes\n", "$EndNodes\nhello\n", "the file is damaged: 'hello' stands in no section"),
        (NODES, "", r"the file has no section \$Nodes"),
        ("2.2 0 8", "2.2 0 4", "the file is damaged: its format is '2.2 0 4'"),
        ("2.2 0 8", "2.2 1 8", "the file is damaged: its mark of the byte order has a wrong value"),
        ("2.2 0 8", "2 0 8", "the .msh format '2' is not read; save it as 4.1 or 2.2"),
        (
            "$Nodes",
            '$PhysicalNames\n2\n3 1 "a"\n$EndPhysicalNames\n$Nodes',
            r"the section \$PhysicalNames is wrong",
        ),
    ],
)
def test_what_does_not_fit_is_refused(before: str, after: str, message: str, tmp_path: Path) -> None:
    assert before in SMALL
    (tmp_path / "bad.msh").write_text(SMALL.replace(before, after, 1))
    with pytest.raises(MeshError, match=message) as raised:
        read_msh(tmp_path / "bad.msh", None, "mesh")
    assert "\n" not in str(raised.value)


def test_an_unknown_section_is_reported(tmp_path: Path) -> None:
    (tmp_path / "small.msh").write_text(f"{SMALL}$Strange\n1 2 3\n$EndStrange\n$Periodic\n0\n$EndPeriodic\n")
    assert read_msh(tmp_path / "small.msh", None, "mesh").notes == ("unknown sections are ignored: $Strange",)
