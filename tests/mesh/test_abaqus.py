"""The reader of Abaqus input files, in this process: parts, instances, sets, and refusals with a line number."""

from pathlib import Path

import numpy as np
import pytest

from conoid.worker.errors import MeshError
from conoid.worker.mesh.abaqus import keywords
from conoid.worker.mesh.abaqus.reading import read_inp
from conoid.worker.mesh.named import NamedMesh
from conoid.worker.mesh.solid import solid

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
BODY = PART.split("*PART, NAME=Rod\n")[1].split("*END PART")[0]
FLAT = f"*HEADING\n{BODY}"
ONE = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
TET = "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"


def read(text: str, tmp_path: Path, group: str | None = None) -> NamedMesh:
    (tmp_path / "case.inp").write_text(text)
    return solid(read_inp(tmp_path / "case.inp", group, "mesh"))


def test_a_part_without_assembly_is_read(tmp_path: Path) -> None:
    found = read(PART, tmp_path)
    assert found.mesh.volumes() == pytest.approx([1 / 6, 1 / 6])
    assert found.names.nodes.tolist() == [1, 2, 3, 4, 5]
    assert found.names.tets.tolist() == [1, 2]
    assert found.notes == ("elements that carry no volume are skipped: 1 S3",)


@pytest.mark.parametrize(
    ("group", "tets"), [("UPPER", [1]), ("lower", [2]), ("Both", [1, 2]), ("rod", [1, 2]), (None, [1, 2])]
)
def test_sets_by_name_range_and_other_sets(group: str | None, tets: list[int], tmp_path: Path) -> None:
    assert read(PART, tmp_path, group).names.tets.tolist() == tets


def test_an_unknown_group_lists_every_name_that_a_group_may_have(tmp_path: Path) -> None:
    known = r"known: Both, far, Left, Lower, Right, skin, Upper$"
    with pytest.raises(MeshError, match=rf"mesh\.group = 'ice': no such element set, instance or part; {known}"):
        read(PART + TWO, tmp_path, "ice")


def test_instances_are_moved_then_turned(tmp_path: Path) -> None:
    found = read(PART + TWO, tmp_path)
    assert len(found.mesh.tets) == 4
    assert found.mesh.volumes() == pytest.approx(np.full(4, 1 / 6))
    right = read(PART + TWO, tmp_path, "Right").mesh
    assert right.points == pytest.approx(np.array([[10, 0, 0], [10, 1, 0], [9, 0, 0], [10, 0, 1], [9, 1, -1]]))


@pytest.mark.parametrize("lines", ["\n0, 0, 0, 0, 1, 0, 90.\n", " 0., , \n0,0,0, 0,1,0, 9.D1\n", ",\n,,,,1,,90\n\n"])
def test_an_instance_may_be_turned_and_not_moved(lines: str, tmp_path: Path) -> None:
    """The rotation of the instance turns x into -z, and z into x. The first line of the instance, which is empty in
    this file, is the translation.
    """
    text = f"{PART}*INSTANCE, NAME=I, PART=Rod\n{lines}*END INSTANCE\n"
    expected = np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0], [1, 0, 0], [-1, 1, -1]])
    assert read(text, tmp_path).mesh.points == pytest.approx(expected)


@pytest.mark.parametrize(
    ("group", "tets"),
    [("far", [1, 2]), ("left", [1, 2]), ("upper", [1, 1]), ("Left.Upper", [1]), ("rod.upper", [1, 1]),
     ("rod", [1, 2, 1, 2])],
)  # fmt: skip
def test_groups_of_an_assembly(group: str, tets: list[int], tmp_path: Path) -> None:
    assert read(PART + TWO, tmp_path, group).names.tets.tolist() == tets


def test_an_independent_instance_brings_its_own_mesh(tmp_path: Path) -> None:
    text = f"*PART, NAME=Rod\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=Rod\n0, 0, 5\n{BODY}*END INSTANCE\n"
    found = read(f"{text}*END ASSEMBLY\n", tmp_path, "lower")
    assert found.names.tets.tolist() == [2]
    assert found.mesh.points[:, 2].tolist() == [5, 5, 5, 4]


# Names ----------------------------------------------------------------------------------------------------------------

QUALIFIED = """*ASSEMBLY, NAME=A
*INSTANCE, NAME=Rod-1, PART=Rod
*END INSTANCE
*INSTANCE, NAME="Rod 2", PART=Rod
0, 0, 9
*END INSTANCE
*ELSET, ELSET=Hit
Rod-1.2, "Rod 2".1
*ELSET, ELSET=Names
Rod-1.Lower, "Rod 2.Upper"
*ELSET, ELSET=Names, INSTANCE="Rod 2"
Lower,
*ELSET, ELSET=Upper, INSTANCE=Rod-1
2
*END ASSEMBLY
"""


@pytest.mark.parametrize(
    ("group", "low", "tets"),
    [("Hit", -1, [2, 1]), ("names", -1, [2, 1, 2]), ("Upper", -1, [2]), ("Rod.Upper", 0, [1, 1]),
     ("Rod 2.Lower", 8, [2])],
)  # fmt: skip
def test_members_and_sets_of_instances_stay_distinct(group: str, low: float, tets: list[int], tmp_path: Path) -> None:
    """A set of the assembly hides sets of the same name in parts; each set belongs to the scope in which it is
    defined.
    """
    found = read(PART + QUALIFIED, tmp_path, group)
    assert found.names.tets.tolist() == tets
    assert found.mesh.points[:, 2].min() == low


def test_a_set_that_hides_another_set_is_reported(tmp_path: Path) -> None:
    notes = read(PART + QUALIFIED, tmp_path, "Upper").notes
    assert "the set 'Upper' is that of the assembly; another one is Rod.Upper" in notes


def test_sets_of_one_name_in_two_parts_are_not_taken_for_each_other(tmp_path: Path) -> None:
    text = PART + PART.replace("*HEADING\n a comment line, with, commas\n", "").replace("NAME=Rod", "NAME=Plate")
    message = (
        "may be the set 'Upper' of the part 'Rod' or the set 'Upper' of the part 'Plate', which differ; write OWNER.SET"
    )
    with pytest.raises(MeshError, match=message):
        read(text, tmp_path, "Upper")
    assert read(text, tmp_path, "Plate.Upper").names.tets.tolist() == [1]


@pytest.mark.parametrize(
    "text",
    [
        "*ELSET, ELSET=A, GEN\n1, 2, 1\n",
        "*Elset , els = a ,\ngenerate\n1,2\n",
        "*ELSET, ELSET=A,\n** a comment\n  GENERATE ,\n INTERNAL\n1, 2, 1,\n",
        "*EL SET, ELSET=A\n1,\n2,\n",
        "*elset,elset=a\n\n1 ,\t2\n\n",
        "*ELSET, ELSET=A, UNSORTED\n2, 1, 1\n",
        '*ELSET, ELSET="A"\n1\n*ELSET, ELSET=a\nUpper, 2\n',
    ],
)
def test_a_set_may_be_written_in_many_ways(text: str, tmp_path: Path) -> None:
    for whole in (FLAT + text, (FLAT + text).replace("\n", "\r\n"), f"\ufeff{FLAT}{text}"):
        (tmp_path / "case.inp").write_bytes(whole.encode())
        assert solid(read_inp(tmp_path / "case.inp", "a", "mesh")).names.tets.tolist() == [1, 2]


def test_a_set_holds_what_another_one_held_where_it_is_named(tmp_path: Path) -> None:
    text = f"{FLAT}*ELSET, ELSET=A\nUpper\n*ELSET, ELSET=Upper\n2\n"
    assert read(text, tmp_path, "A").names.tets.tolist() == [1]
    assert read(text, tmp_path, "Upper").names.tets.tolist() == [1, 2]


def test_names_that_are_no_ascii_are_kept_apart(tmp_path: Path) -> None:
    """A file in UTF-8 or in Latin-1 is read; a file in UTF-16 is refused."""
    text = f"{FLAT}*ELSET, ELSET=Körper\n1\n*ELSET, ELSET=Kärper\n2\n"
    for encoding in ("utf-8", "latin-1"):
        (tmp_path / "case.inp").write_bytes(text.encode(encoding))
        assert solid(read_inp(tmp_path / "case.inp", "kärper", "mesh")).names.tets.tolist() == [2]
    (tmp_path / "case.inp").write_bytes(text.encode("utf-16"))
    with pytest.raises(MeshError, match="the file is UTF-16; save it as UTF-8 text"):
        read_inp(tmp_path / "case.inp", None, "mesh")


# Numbers --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("nodes", "points"),
    [
        ("1, , , \n2, 1.D0\n3, , 1d+00, ,\n4,,,1.0E0, 0., 0., 1.\n", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        ("1, 0, 0, -.5e-1\n2, 1\n\n3,,+1\n4,,,1", [[0, 0, -0.05], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    ],
)
def test_an_empty_field_is_zero_and_a_d_begins_an_exponent(
    nodes: str, points: list[list[float]], tmp_path: Path
) -> None:
    assert read(f"*NODE\n{nodes}\n{TET}", tmp_path).mesh.points.tolist() == points


def test_cylindrical_coordinates_have_degrees(tmp_path: Path) -> None:
    nodes = "*NODE, SYSTEM=C, NSET=N\n1, 0, 0, 0\n2, 2, 90, 0\n3, 2, 180., 0\n4, 0, 0, 3\n"
    expected = np.array([[0, 0, 0], [0, 2, 0], [-2, 0, 0], [0, 0, 3]])
    assert read(nodes + TET, tmp_path).mesh.points == pytest.approx(expected)


@pytest.mark.parametrize("row", ["1, 1, 2,\n3, 4\n", "1,\n1,2,3,4,\n", "1, 1, 2, 3\n** here\n4\n"])
def test_an_element_may_take_several_lines(row: str, tmp_path: Path) -> None:
    found = read(f"{ONE}5, 1, 1, -1\n*ELEMENT, TYPE=C3D4\n{row}2, 1, 3, 2, 5\n", tmp_path)
    assert found.mesh.volumes() == pytest.approx([1 / 6, 1 / 6])


# Elements other than tets ---------------------------------------------------------------------------------------------

EMPTY = ["CONN3D2", "SPRINGA", "DASHPOTA", "MASS", "S6", "S4R", "S8R5", "STRI65", "M3D3", "SFM3D4R", "COH3D6", "T3D2",
         "B31OS", "R3D3", "RB3D2", "ROTARYI", "CPS3", "DCOUP3D", "GAPUNI", "PIPE31H"]  # fmt: skip
VOLUMES = ["C3D27R", "C3D15V", "SC8R", "AC3D4", "DC3D4", "C3D4X", "U1"]


@pytest.mark.parametrize("kind", EMPTY)
def test_elements_without_volume_are_skipped_and_counted(kind: str, tmp_path: Path) -> None:
    text = f"{ONE}{TET}*ELEMENT, TYPE={kind}, ELSET=Extra\n7, 1, 2, 3, 4, 1, 2, 3, 4\n*ELSET, ELSET=All\n1, Extra\n"
    for group in ("All", None):
        found = read(text, tmp_path, group)
        assert found.names.tets.tolist() == [1]
        assert found.notes == (f"elements that carry no volume are skipped: 1 {kind}",)


@pytest.mark.parametrize("kind", VOLUMES)
def test_volumes_that_cannot_be_read_are_refused_where_they_are_chosen(kind: str, tmp_path: Path) -> None:
    nodes = ", 1" * {"C3D27R": 27, "C3D15V": 15, "SC8R": 8}.get(kind, 4)
    tet = TET.replace("C3D4", "C3D4, ELSET=A")
    text = f"{ONE}{tet}*ELEMENT, TYPE={kind}, ELSET=B\n7{nodes}\n8{nodes}\n"
    for group in ("B", None):
        message = rf"^2 elements of the type {kind}.* \(the first is 7\); elements with a volume can be C3D4, .*"
        with pytest.raises(MeshError, match=message):
            read(text, tmp_path, group)
    assert read(text, tmp_path, "A").notes == (f"elements that cannot be read are outside of the group: 2 {kind}",)


def test_a_connector_to_the_ground_does_not_swallow_the_next_one(tmp_path: Path) -> None:
    extra = "*ELEMENT, TYPE=CONN3D2\n5, 1,\n6, , 2\n*ELEMENT, TYPE=SPRING1\n7, 3\n8, 4,\n"
    text = f"{ONE}{TET}{extra}*ELSET, ELSET=A\n1,5,6,7,8\n"
    message = "elements that carry no volume are skipped: 2 CONN3D2, 2 SPRING1"
    assert read(text, tmp_path, "A").notes == (message,)


def test_elements_of_the_assembly_and_of_other_parts_are_counted(tmp_path: Path) -> None:
    spring = "*ELEMENT, TYPE=SPRINGA, ELSET=s\n1, Left.1, Right.2\n*END ASSEMBLY"
    found = read(PART + TWO.replace("*END ASSEMBLY", spring), tmp_path, "Left")
    assert found.names.tets.tolist() == [1, 2]
    assert found.notes == ("elements that carry no volume are skipped: 1 S3, 1 SPRINGA",)


def test_a_node_set_with_undefined_nodes_is_reported(tmp_path: Path) -> None:
    """A set of the assembly names nodes of an instance; reference points of the assembly are no nodes of a body."""
    inner = PART.replace("*END PART", "*NSET, NSET=Grip\n1, 2, 98, 99\n*END PART")
    outer = "*NODE\n1, 9., 9., 9.\n*NSET, NSET=Point\n1\n*NSET, NSET=Base, INSTANCE=Left\n5, 77\n*END ASSEMBLY"
    notes = read(inner + TWO.replace("*END ASSEMBLY", outer), tmp_path).notes
    found = [note for note in notes if "do not" in note or "undefined" in note]
    message = "sets have undefined members; these members are left out: "
    assert found == [f"{message}the node set 'Base' (1, such as 77), the node set 'Grip' (2, such as 98)"]


def test_a_part_without_an_instance_is_reported(tmp_path: Path) -> None:
    spare = PART.replace("*HEADING\n a comment line, with, commas\n", "").replace("NAME=Rod", "NAME=Spare")
    assert "parts without an instance are left out: 'Spare' (2 elements)" in read(PART + spare + TWO, tmp_path).notes


# Refused files --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file has no keyword"),
        ("some text\n", "line 1: data before the first keyword; this is not an .inp file"),
        ("*HEADING\n", "the file has no nodes"),
        ("*NODE\n1, 0, zero, 0\n", "line 2: '0, zero, 0' is not a list of numbers"),
        ("*NODE\n1, 0, 1_0, 0\n", "line 2: '0, 1_0, 0' is not a list of numbers"),
        ("*NODE\n1, 0, 0 0, 0\n", "line 2: '0, 0 0, 0' is not a list of numbers"),
        ("*NODE\n1, 0, inf, 0\n", "line 2: '0, inf, 0' is not a list of numbers"),
        ("*NODE\n1, 0,0,0,0,0,0,0\n", "line 2: a node has up to 6 values; found 7"),
        ("*NODE\n1.5, 0, 0, 0\n", "line 2: '1.5' is not a number of a node or element"),
        ("*NODE\n, 0, 0, 0\n", "line 2: '' is not a number of a node or element"),
        ("*NODE\n0, 0, 0, 0\n", "line 2: '0' is not a number of a node or element; the first one is 1"),
        (f"{ONE}*ELEMENT, TYPE=C3D4\n0, 1, 2, 3, 4\n", "line 7: '0' is not a number of a node or element; the first"),
        (f"{ONE}*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 0\n", "line 7: '0' is not a number of a node or element; the first"),
        (f"{FLAT}*ELSET, ELSET=s\n0, 1\n", "line 19: '0' is not a number of a node or element; the first one is 1"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATE\n0, 4, 2\n", "line 19: '0' is not a number of a node or element; the first"),
        (f"{FLAT}*ELSET, ELSET=s\n1, s\n", "line 19: the set 's' has itself among its members"),
        (f"{FLAT}*ELSET, ELSET=UPPER\n upper\n", "line 19: the set 'upper' has itself among its members"),
        ("*NODE\n1, 0, 0, 0\n1, 1, 1, 1\n", "node 1 is defined twice"),
        (f"{ONE}{TET}{TET}", "element 1 is defined twice"),
        (f"{ONE}{TET}*ELEMENT, TYPE=S3\n1, 1, 2, 3\n", "element 1 is defined twice"),
        ("*NODE\n1, 0, 0, \0\n", "line 2: a null byte; this is not a text file"),
        ("*NODE, INPUT=/etc/passwd\n", r"line 1: \*NODE, INPUT is not supported"),
        ("*NODE, SYSTEM=S\n1, 0, 0, 0\n", r"line 1: \*NODE, SYSTEM=S is not read; allowed: R, C"),
        ("*ELEMENT\n1, 1, 2, 3, 4\n", r"line 1: \*ELEMENT needs TYPE="),
        ("*ELEMENT, TYPE=C3D4, OFFSET=5\n", r"line 1: \*ELEMENT: the parameter OFFSET is not supported; supported"),
        ("*ELEMENT, TYPE=C3D4, TYPE=C3D4\n", r"line 1: \*ELEMENT: TYPE is given twice"),
        ("*ELEMENT, TYPE=\n", r"line 1: \*ELEMENT: TYPE needs a value"),
        ("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n9, 1, 2, 3, 4\n", r"tet 9 \(line 4\) uses node 2, which is not def"),
        (f"{ONE}*ELEMENT, TYPE=C3D4\n1, 1, 2, 3\n2, 1, 2, 3, 4\n", "line 7: an element of the type C3D4 with 8 nodes"),
        (f"{ONE}*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4, 4\n",
         "line 7: an element of the type C3D4 with 5 nodes; expected 4"),
        (f"{ONE}*ELEMENT, TYPE=C3D4\n1, 1, 2, 3\n", "line 7: an element of the type C3D4 with 3 nodes; expected 4"),
        (f"{ONE}*ELEMENT, TYPE=C3D4\n1, 1, , 3, 4\n", "line 7: '' is not a number of a node or element"),
        ("*INSTANCE, NAME=i, PART=b\n", "line 1: instance 'i' of the unknown part 'b'; known: none"),
        ("*ELSET, ELSET=s, INSTANCE=i\n1\n", "line 1: .*unknown instance 'i'; known: none"),
        (f"{FLAT}*ELSET, ELSET=s\nUpper, Nosuch\n",
         "line 19: 'Nosuch' is no element and no element set that is defined"),
        (f"{FLAT}*ELSET, ELSET=s\nRod.1\n", "line 19: 'Rod.1' is no element and no element set"),
        (f"{FLAT}*ELSET, ELSET=s\n1, 2, -3\n", "line 19: '-3' is no element and no element set"),
        (f"{FLAT}*ELSET, ELSET=s\n1 2\n", "line 19: '1 2' is no element and no element set"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATE\n1, 4, 2\n", "line 19: no steps of 2 lead from 1 to 4"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATE\n4, 1\n", "line 19: no steps of 1 lead from 4 to 1"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATE\n1, 4, 0\n", "line 19: no steps of 0 lead from 1 to 4"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATE\n1, 99999999999, 1\n", "line 19: GENERATE makes 99999999999 numbers"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATE\n1\n", "line 19: GENERATE takes a first number, a last one and a step"),
        (f"{FLAT}*ELSET, ELSET=s, GENERATED\n1, 2\n", r"line 18: \*ELSET: the parameter GENERATED is not supported"),
        (f"{FLAT}*ELSET, ELSET=s, G=1\n1, 2\n", r"line 18: \*ELSET: GENERATE has no value"),
        (f"{FLAT}*ELSET, ELSET=s, IN\n1, 2\n", r"line 18: \*ELSET: the parameter IN is not supported"),
        (f"{FLAT}*ELSET, ELSET=s,\n1, 2\n", r"line 18: \*ELSET: the parameter 1 is not supported"),
        (f"{FLAT}*ELSETS, ELSET=s\n1, 2\n", r"line 18: the keyword \*ELSETS is not known; it could change the mesh"),
        (f"{FLAT}*ELE, TYPE=C3D4\n", r"line 18: the keyword \*ELE may be \*ELECTRICALCONDUCTIVITY or .*; write"),
        (f"{FLAT}*NODE, NSET=\"a\n", "line 18: .* has a quotation mark without its partner"),
        ("*PART, NAME=a\n*PART, NAME=b\n", r"line 2: \*PART inside of the part 'a' \(line 1\); \*END PART is missing"),
        ("*PART, NAME=a\n*END PART\n*PART, NAME=A\n", "line 3: the part 'A' is defined twice"),
        (f"{PART}*INSTANCE, NAME=i, PART=Rod\n*NODE\n1, 0\n*END INSTANCE\n", "the instance 'i' .* has a mesh of its"),
        (f"{PART}*INSTANCE, NAME=i, PART=Rod\n*END INSTANCE\n*INSTANCE, NAME=I, PART=ROD",
         "instance 'I' is defined twice"),
        (f"{PART}*INSTANCE, NAME=i, PART=Rod, ELSET=Upper\n", r"\*INSTANCE: the parameter ELSET is not supported"),
        (f"{PART}*INSTANCE, NAME=i, INSTANCE=j, LIBRARY=k\n", r"\*INSTANCE: the parameter INSTANCE is not supported"),
        (f"{PART}*INSTANCE, NAME=i, PART=Rod\n0,0,0, 0,0,1, 90\n", "is a translation, 3 numbers; found 7"),
        (f"{PART}*INSTANCE, NAME=i, PART=Rod\n1\n1,0,0, 90\n", "is a rotation, 7 numbers; found 4"),
        (f"{PART}*INSTANCE, NAME=i, PART=Rod\n1\n1,0,0,1,0,0,90\n",
         "the two points of the axis of rotation are the same"),
        ("*PART, NAME=a\n*NODE\n1, 0, 0, 0\n", r"the file ends inside of the part 'a' \(line 1\); is it cut off\?"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_with_its_line(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=message) as raised:
        read(text, tmp_path)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "word",
    ["INCLUDE", "NGEN", "NFILL", "NMAP, TYPE=RECTANGULAR", "NCOPY", "ELGEN", "ELCOPY",
     "SYSTEM", "Im Perfection", "SYMMETRIC MODEL GENERATION", "PARAMETER"],
)  # fmt: skip
def test_keywords_that_make_or_move_nodes_are_refused(word: str, tmp_path: Path) -> None:
    name = "".join(word.partition(",")[0].split()).upper()
    with pytest.raises(MeshError, match=rf"line 18: \*{name} is not supported; write the nodes and elements out"):
        read(f"{FLAT}*{word}\n1, 2\n", tmp_path)


def test_a_missing_included_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"line 18: the included file 'x.inp' is no file there"):
        read(f"{FLAT}*INCLUDE, INPUT=x.inp\n", tmp_path)


def test_a_set_with_an_element_that_is_not_there_is_refused_where_it_is_chosen(tmp_path: Path) -> None:
    text = f"{FLAT}*ELSET, ELSET=s, GENERATE\n1, 9\n*ELSET, ELSET=t\ns\n"
    with pytest.raises(MeshError, match="the set 't' has the element 4, which is not defined"):
        read(text, tmp_path, "t")
    assert len(read(text, tmp_path, "Both").mesh.tets) == 2


ANALYSIS = """*Preprint, echo=NO
*Nset, nset=Corner, generate
 1, 5, 1
*Surface, type=ELEMENT, name=Top
Both, S1
*Solid Section, elset=Both, material=steel
,
*Material, name=steel
*Density
 7.8e-9,
*Amplitude, name=Amp, time=STEP TIME
0., 0., 1., 1.
*Initial Conditions, type=VELOCITY
1, 3, -1.
*Uncoupled Temperature-Displacement
*Step, name=Step-1, nlgeom=YES, inc=1000
*Dynamic, Explicit
, 1e-3
*El File
S, E
*Node Output
U, V
*Some word of another program, with=parameters
1, 2, 3
*End Step
"""


def test_what_would_join_or_remove_bodies_is_counted(tmp_path: Path) -> None:
    """The unsupported keywords are in the model, in the assembly and in a step, and some keywords are shortened."""
    assert keywords.JOINING.keys() <= keywords.ANALYSIS
    joined = "*TIE, NAME=t\na, b\n*Tie, name=u\nb, c\n*Embedded Element\nx\n*END ASSEMBLY"
    later = "*EQUA\n2\n1, 1, 1., 2, 1, -1.\n*STEP\n*MODEL CHANGE, REMOVE\nx\n"
    text = PART + TWO.replace("*END ASSEMBLY", joined) + later
    message = "keywords that join, hold or remove bodies are ignored: "
    assert read(text, tmp_path).notes[-1] == f"{message}1 *EMBEDDED ELEMENT, 1 *EQUATION, 1 *MODEL CHANGE, 2 *TIE"
    assert not any(message in note for note in read(PART + TWO, tmp_path).notes)


def test_keywords_of_the_analysis_are_skipped(tmp_path: Path) -> None:
    assert len(read(FLAT + ANALYSIS, tmp_path).mesh.tets) == 2
