"""The reader of LS-DYNA keyword decks: styles of pre-processors, parts and sets, and refusals."""

import math
import re
from pathlib import Path
from random import Random

import numpy as np
import pytest

from conoid.cases.model.bodies import MeshFile
from conoid.worker.errors import MeshError
from conoid.worker.mesh.build import build
from conoid.worker.mesh.lookup import meant
from conoid.worker.mesh.model import TetMesh
from conoid.worker.mesh.read import read

from .decks import DECKS, parts
from .mixtures import mixture


def taken(path: Path, group: str | None = None) -> TetMesh:
    return read(MeshFile(shape="file", path=path.name, unit=1.0, group=group), path, "mesh")


def test_decks_of_three_pre_processors_have_the_volume_of_their_parts(tmp_path: Path) -> None:
    for seed in range(30):
        chance, truth = Random(seed), mixture(seed)
        split, style = parts(truth, chance), DECKS[seed % len(DECKS)]
        path = tmp_path / f"{style.__name__}{seed}.k"
        text = style(truth, split, chance)
        path.write_bytes(text.replace("\n", chance.choice(("\n", "\r\n"))).encode())
        volumes = truth.volumes()
        for group, numbers in ((None, volumes), *((f"piece {part}", each) for part, each in split.items())):
            found = taken(path, group)
            assert found.volumes().sum() == pytest.approx(math.fsum(volumes[n] for n in numbers), rel=1e-6), path.name
        clamp = meant(taken(path).sets, "CLAMP")
        assert clamp is not None
        assert len(clamp.nodes) == len(range(0, len(truth.points), 2))


NODES = "*NODE\n" + "".join(
    f"{k},{x},{y},{z}\n"
    for k, (x, y, z) in enumerate([(x, y, z) for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)], 1)
)
SOLID = "*ELEMENT_SOLID\n10,1,1,2,4,3,5,6,8,7\n20,2,5,6,8,7,9,10,12,11\n"
PARTS = "*PART\nlower\n1,1,1\nupper\n2,1,1\n"
TWO = f"*KEYWORD\n{NODES}{SOLID}{PARTS}"


def volume(folder: Path, text: str, group: str | None = None) -> float:
    (folder / "two.key").write_text(text)
    return float(taken(folder / "two.key", group).volumes().sum())


@pytest.mark.parametrize(
    ("more", "group", "expected"),
    [
        ("", None, 2.0),
        ("", "1", 1.0),
        ("", "UPPER", 1.0),
        ("*SET_PART_LIST_TITLE\nboth\n5\n1,2\n", "both", 2.0),
        ("*SET_PART_LIST_GENERATE\n5\n1,2\n", "set_part:5", 2.0),
        ("*SET_SOLID\n2\n20\n", "set_solid:2", 1.0),
        ("*SET_SOLID_GENERAL_TITLE\nhigh\n3\nALL\nDELEM,10\n", "high", 1.0),
        ("*SET_PART_ADD\n6\n7\n*SET_PART_COLUMN\n7\n2\n", "set_part:6", 1.0),
    ],
)
def test_a_part_or_a_set_is_chosen_by_title_or_id(
    more: str, group: str | None, expected: float, tmp_path: Path
) -> None:
    assert volume(tmp_path, TWO + more, group) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("more", "name", "many"),
    [
        ("*SET_NODE_LIST\n1\n1,2,3,4\n", "1", 4),
        ("*SET_NODE_LIST_GENERATE_TITLE\nGrip\n1\n1,3,9,12\n", "grip", 7),
        ("*SET_NODE_GENERAL\n1\nPART,2\nDNODE,9,10\n", "1", 6),
        ("*SET_NODE_ADD\n1\n2\n*SET_NODE_COLUMN\n2\n1,0.5\n2\n", "nodes:1", 2),
        ("*SET_SEGMENT_TITLE\ntop\n1\n9,10,12,11\n", "top", 4),
        ("*SET_SEGMENT\n1\n9,10,12,0\n9,12,11,11\n", "surface:1", 4),
    ],
)
def test_sets_of_nodes_and_segments_are_read(more: str, name: str, many: int, tmp_path: Path) -> None:
    volume(tmp_path, TWO + more)
    mesh = taken(tmp_path / "two.key")
    found = meant(mesh.sets, name)
    assert found is not None
    assert len(found.nodes) == many
    if found.faces is not None:
        assert (len(found.faces), found.inner) == (2, 0)
        assert np.ptp(mesh.points[found.nodes], axis=0).tolist() == [1.0, 1.0, 0.0]


TET10 = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,.5,0,0\n6,.5,.5,0\n7,0,.5,0\n8,0,0,.5\n9,.5,0,.5\n10,0,.5,.5\n"


def test_tets_of_ten_and_four_nodes_are_read_in_the_order_of_the_manual(tmp_path: Path) -> None:
    for rows in ("1,1\n1,2,3,4,5,6,7,8,9,10\n", "1,1,1,2,3,4,4,4,4,4\n", "1,1\n1,2,3,4\n", "1,1\n1,2,3,4,0,0,0,0\n"):
        assert volume(tmp_path, f"{TET10}*ELEMENT_SOLID (ten nodes format)\n{rows}") == pytest.approx(1 / 6)
    swapped = "1,1\n1,2,3,4,5,6,7,8,10,9\n"
    with pytest.raises(MeshError, match=r"tet 1 \(line 13\): node 10 is not near the middle of the edge between"):
        volume(tmp_path, f"{TET10}*ELEMENT_SOLID\n{swapped}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TWO.replace("10,1,1,2,4,3,5,6,8,7", "10,1,5,6,8,7,1,2,4,3"), r"hexahedron 10 \(line 16\) is inverted"),
        (TWO.replace("20,2,5", "10,2,5"), "element 10 is defined twice"),
        (TWO.replace("5,0,0,1", "4,0,0,1"), "node 4 is defined twice"),
        (TWO.replace("\n12,", "\n13,"), r"hexahedron 20 \(line 17\) uses node 12, which is not defined"),
        (TWO.replace("10,12,11\n", "10,12\n"), "line 17: an element with 7 nodes; expected 4 or 8 or 10"),
        (TWO.replace("20,2,5", "20,0,5"), "line 17: pid = '0' is no number of a node, an element or a part"),
        (TWO + "*ELEMENT_SOLID\n30,1\n", "line 24: the nodes of this element are missing"),
        (TWO + "*ELEMENT_SOLID_T15\n", r"line 23: \*ELEMENT_SOLID_T15 is not supported"),
        (TWO + "*NODE_TRANSFORM\n", r"line 23: \*NODE_TRANSFORM is not supported"),
        (TWO + "*NODDE\n1,2\n", r"line 23: the keyword \*NODDE is not known; it could change the mesh"),
        (TWO + "*PART\nagain\n1\n", "line 25: the part 1 is defined twice"),
        (TWO + "*PART\nagain\n", r"line 23: \*PART has two cards for each part"),
        (TWO + "*SET_NODE\n1\n2,x\n", "line 25: member = 'x' is not a whole number"),
        (TWO + "*SET_PART\n1\n*SET_PART\n1\n", r"line 26: the set 1 of \*SET_PART is defined twice"),
        (TWO + "*ELEMENT_TSHELL\n30,1,1,2,4,3,5,6,8,7\n", r"1 cards of \*ELEMENT_TSHELL, whose elements are not read"),
        (TWO + "*INCLUDE\n/etc/passwd\n", "line 24: the included file '/etc/passwd' is not below the folder"),
        (TWO.replace("1,0,0,0\n", "1,0,0,&z\n"), "line 3: the parameter '&z' is not defined above"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_with_its_line(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=rf"^mesh\.path = 'two.key': {message}") as raised:
        volume(tmp_path, text)
    assert "\n" not in str(raised.value)


def test_a_name_of_two_things_and_an_unknown_one_are_refused(tmp_path: Path) -> None:
    more = "*SET_PART_TITLE\nlower\n5\n2\n"
    with pytest.raises(MeshError, match=r"mesh\.group = 'lower': may be the part 1 or the set_part 5, which"):
        volume(tmp_path, TWO + more, "lower")
    assert volume(tmp_path, TWO + more, "part:lower") == pytest.approx(1.0)
    with pytest.raises(MeshError, match="no such part or set; known: lower, upper, set_part:lower"):
        volume(tmp_path, TWO + more, "middle")


def test_a_deck_without_an_end_may_be_cut_off(tmp_path: Path) -> None:
    for end, found in (("*END\n", False), ("", True)):
        volume(tmp_path, TWO + end)
        origin = taken(tmp_path / "two.key").origin
        assert origin is not None
        assert ("the deck has no *END: it may be cut off" in origin.notes) == found


def test_ignored_keywords_are_reported(tmp_path: Path) -> None:
    more = "*ELEMENT_SHELL\n1,9,1,2,3,4\n*CONTACT_TIED_NODES_TO_SURFACE\n1,2\n*SET_NODE_GENERAL\n3\nBOX,1\n"
    more += "*END\n"
    volume(tmp_path, TWO.replace("3,0,1,0\n", "3,0,1,0,7\n") + more)
    origin = taken(tmp_path / "two.key").origin
    assert origin is not None
    assert origin.notes == (
        "elements that carry no volume are skipped: 1 *ELEMENT_SHELL",
        "keywords that join, hold or load bodies are ignored: 1 *CONTACT_TIED_NODES_TO_SURFACE",
        "constraints of nodes (TC, RC of *NODE) are ignored: 1 nodes",
        "a set is not read: the set 3 of *SET_NODE line 29: the option 'BOX' is not supported",
        "2 hexahedra are cut into 12 tets of 4 nodes with matching faces",
    )


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("*SET_NODE_LIST_TITLE\ngrip\n1\n1,2,98,99\n", r"\*SET_NODE grip \(2, such as 98\)"),
        (
            "*SET_SOLID\n2\n20,99\n*SET_PART\n3\n1,9\n",
            r"\*SET_PART 3 \(1, such as 9\), \*SET_SOLID 2 \(1, such as 99\)",
        ),
        ("*SET_SOLID_GENERAL\n3\nALL\nDELEM,99\n", None),
    ],
)
def test_sets_with_undefined_members_are_reported(more: str, message: str | None, tmp_path: Path) -> None:
    volume(tmp_path, TWO + more)
    origin = taken(tmp_path / "two.key").origin
    assert origin is not None
    found = [note for note in origin.notes if "undefined members; these members are left out" in note]
    assert len(found) == (message is not None)
    assert message is None or re.search(f": {message}$", found[0])


def test_another_unit_than_that_of_the_deck_is_refused(tmp_path: Path) -> None:
    assert volume(tmp_path, TWO.replace("*NODE", "*CONTROL_UNITS\n         m         s        kg\n*NODE", 1)) == 2.0
    with pytest.raises(MeshError, match=r"mesh.unit = 1.00 m, but the file is in mm; mend the key or the file"):
        volume(tmp_path, TWO.replace("*NODE", "*CONTROL_UNITS\n        mm        ms        kg\n*NODE", 1))


def test_a_deck_is_read_again_when_a_file_that_it_includes_has_changed(tmp_path: Path) -> None:
    (tmp_path / "main.k").write_text(f"*KEYWORD\n*INCLUDE\nsub/nodes.k\n{SOLID}{PARTS}*END\n")
    (tmp_path / "sub").mkdir()
    file, digests = MeshFile(shape="file", path="main.k", unit=1.0), set()
    for height in (2, 3):
        (tmp_path / "sub/nodes.k").write_text(NODES.replace(",2\n", f",{height}\n"))
        mesh = build(file, tmp_path)
        assert mesh.points[:, 2].max() == height
        digests.add(mesh.origin and mesh.origin.file)
    assert len(digests) == 2
    (tmp_path / "sub/nodes.k").unlink()
    with pytest.raises(MeshError, match=r"line 3: the included file 'sub/nodes.k' is no file there"):
        build(file, tmp_path)
