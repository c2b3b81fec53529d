"""The reader of Abaqus input files, in this process: parts, instances, sets, and what it refuses with a line number."""

from pathlib import Path

import numpy as np
import pytest

from conoid.worker.errors import MeshError
from conoid.worker.mesh.abaqus import read_inp
from conoid.worker.mesh.gmsh_session import NamedMesh

PART = """*HEADING
 a comment line, with, commas
** one tet and its mirror image
*PART, NAME=Rod
*NODE, NSET=all
1, 0., 0., 0.
2, 1., 0., 0.
3, 0., 1., 0.
4, 0., 0., 1.
 5, 1., 1., -1.E+0
*Element, type=C3D4, elset=Upper
1, 1, 2, 3, 4
*ELEMENT, TYPE=C3D4
2, 1, 3, 2, 5
*ELEMENT, TYPE=S3, ELSET=skin
3, 1, 2, 3
*ELSET, ELSET=Lower, GENERATE
2, 2, 1
*ELSET, ELSET=Both
Upper, Lower
*END PART
"""
TWO = """*ASSEMBLY, NAME=A
*INSTANCE, NAME=Left, PART=ROD
*END INSTANCE
*INSTANCE, NAME=Right, PART=Rod
10., 0., 0.
10., 0., 0., 10., 0., 1., 90.
*END INSTANCE
*ELSET, ELSET=far, INSTANCE=right
1, 2
*END ASSEMBLY
*MATERIAL, NAME=steel
*ELASTIC
2.1e11, 0.3
"""


def read(text: str, tmp_path: Path, group: str | None = None) -> NamedMesh:
    (tmp_path / "case.inp").write_text(text)
    return read_inp(tmp_path / "case.inp", group, "mesh")


def test_a_part_without_assembly_is_read(tmp_path: Path) -> None:
    found = read(PART, tmp_path)
    assert found.mesh.volumes() == pytest.approx([1 / 6, 1 / 6])
    assert found.names.nodes.tolist() == [1, 2, 3, 4, 5]
    assert found.names.tets.tolist() == [1, 2]


@pytest.mark.parametrize(
    ("group", "tets"), [("UPPER", [1]), ("lower", [2]), ("Both", [1, 2]), ("rod", [1, 2]), (None, [1, 2])]
)
def test_sets_by_name_range_and_other_sets(group: str | None, tets: list[int], tmp_path: Path) -> None:
    assert read(PART, tmp_path, group).names.tets.tolist() == tets


def test_a_set_without_tets_is_unknown(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"mesh\.group = 'skin': no such element set; known: both, lower, rod, upper"):
        read(PART, tmp_path, "skin")


def test_instances_are_moved_then_turned(tmp_path: Path) -> None:
    found = read(PART + TWO, tmp_path)
    assert len(found.mesh.tets) == 4
    assert found.mesh.volumes() == pytest.approx(np.full(4, 1 / 6))
    right = read(PART + TWO, tmp_path, "Right").mesh
    assert right.points == pytest.approx(np.array([[10, 0, 0], [10, 1, 0], [9, 0, 0], [10, 0, 1], [9, 1, -1]]))


@pytest.mark.parametrize(("group", "tets"), [("far", [1, 2]), ("left", [1, 2]), ("upper", [1, 1])])
def test_groups_of_an_assembly(group: str, tets: list[int], tmp_path: Path) -> None:
    assert read(PART + TWO, tmp_path, group).names.tets.tolist() == tets


def test_an_independent_instance_brings_its_own_mesh(tmp_path: Path) -> None:
    body = PART.split("*PART, NAME=Rod\n")[1].split("*END PART")[0]
    text = f"*PART, NAME=Rod\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=Rod\n0, 0, 5\n{body}*END INSTANCE\n"
    found = read(text, tmp_path, "lower")
    assert found.names.tets.tolist() == [2]
    assert found.mesh.points[:, 2].tolist() == [5, 5, 5, 4]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file has no keyword"),
        ("some text\n", "line 1: data before the first keyword; this is not an .inp file"),
        ("*HEADING\n", "the file has no nodes"),
        ("*NODE\n1, 0, 0\n", "line 2: expected 4 numbers, found 3"),
        ("*NODE\n1, 0, zero, 0\n", "line 2: '1, 0, zero, 0' is not a list of numbers"),
        ("*NODE\n1.5, 0, 0, 0\n", "line 2: 1.5 is not a number of a node or element"),
        ("*NODE\nnan, 0, 0, 0\n", "line 2: nan is not a number of a node"),
        ("*NODE\n1, 0, 0, 0\n1, 1, 1, 1\n", "node 1 is defined twice"),
        ("*NODE, INPUT=/etc/passwd\n", r"line 1: \*NODE, INPUT is not followed"),
        ("*INCLUDE, INPUT=other.inp\n", r"line 1: \*INCLUDE, INPUT is not followed"),
        ("*NODE\n1, 0, 0, 0\n*NGEN\n1, 5, 1\n", r"line 3: \*NGEN is not followed; write the nodes and elements out"),
        ("*NODE, SYSTEM=C\n1, 0, 0, 0\n", "line 1: .*only Cartesian nodes"),
        ("*ELEMENT, TYPE=C3D8\n", "line 1: elements of the type C3D8; only C3D4"),
        ("*ELEMENT, TYPE=C3D10\n", "type C3D10; only C3D4"),
        ("*ELEMENT\n1, 1, 2, 3, 4\n", r"line 1: \*ELEMENT needs TYPE="),
        ("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n9, 1, 2, 3, 4\n", "tet 9 uses node 2, which is not defined"),
        (
            "*PART, NAME=a\n*END PART\n*INSTANCE, NAME=i, PART=b\n",
            "line 3: instance 'i' of the unknown part 'b'; known: a",
        ),
        ("*ELSET, ELSET=s, INSTANCE=i\n1\n", "line 1: .*unknown instance 'i'"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=message):
        read(text, tmp_path)


def test_a_file_on_which_meshio_ends_the_process(tmp_path: Path) -> None:
    """The reason for a reader of our own: there, an unknown element type is a ``sys.exit``."""
    with pytest.raises(MeshError, match="line 3: elements of the type C3D99"):
        read("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D99\n1, 1, 2, 3, 4\n", tmp_path)
