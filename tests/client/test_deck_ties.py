"""Ties of decks become bonds, with the tolerance of the deck."""

from pathlib import Path

import pytest

from conoid.client.decks.importing import lines
from conoid.client.decks.toml import bare

from .deck_texts import INSTANCES, STEEL, lsdyna, read, row

TWO_TETS = (
    "*PART", "other", row(2, 1, 1), "*NODE", "\n".join(f"{i:8}{x:16.3f}{y:16.3f}{z:16.3f}" for i, x, y, z in (
        (11, 0, 0, 0), (12, 1, 0, 0), (13, 0, 1, 0), (14, 0, 0, -1),
    )), "*ELEMENT_SOLID", "".join(f"{n:8}" for n in (2, 2, 11, 13, 12, 14, 14, 14, 14, 14)),
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "thickness", "gap", "kept"),
    [
        ("TIED_SURFACE_TO_SURFACE", (), None, False), ("TIED_NODES_TO_SURFACE_OFFSET", (), None, True),
        ("TIED_SURFACE_TO_SURFACE_CONSTRAINED_OFFSET_ID", (1, 1, -0.5, -0.25), "0.45 mm", True),
        ("TIED_SURFACE_TO_SURFACE_MPP_ID", (1, 1, 0.5, 0.25), None, False),
    ],
)  # fmt: skip
def test_tied_contacts_of_lsdyna_become_bonds(
    tmp_path: Path, name: str, thickness: tuple[float, ...], gap: str | None, kept: bool
) -> None:
    head = [row(3)] * ("_ID" in name) + [row(0)] * ("MPP" in name)
    cards = (f"*CONTACT_{name}", *head, row(1, 2, 3, 3), row(0), row(*thickness))
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *TWO_TETS, *cards))
    assert found.refusals == []
    (bond,) = found.data["bond"]
    assert bond == {"kind": "tied", "parts": ["body", "other"], **({"gap": gap} if gap else {})}
    assert ("keeps the distance" in "\n".join(lines(found, "a.toml"))) == kept


def test_two_tolerances_of_one_tied_pair_refuse(tmp_path: Path) -> None:
    tie = "*CONTACT_TIED_SURFACE_TO_SURFACE", row(1, 2, 3, 3), row(0)
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *TWO_TETS, *tie, row(1, 1, -0.5), *tie, row(1, 1, -0.1)))
    assert any("body and other are tied twice, with different tolerances" in line for line in found.refusals)
    assert len(found.data["bond"]) == 1


TIED = (
    "*Nset, nset=bottom, instance=two\n1, 2, 3\n*Surface, name=nodes, type=NODE\nbottom,\n"
    "*Elset, elset=body, instance=one\n1\n*Surface, name=faces, type=ELEMENT\nbody,\n"
    "*Tie, name=t, position tolerance=0.25, adjust=no\nnodes, faces\n"
)


def test_a_tie_of_abaqus_joins_nodes_to_faces(tmp_path: Path) -> None:
    found = read(tmp_path, "a.inp", INSTANCES.format(sets=TIED))
    assert found.refusals == []
    (bond,) = found.data["bond"]
    assert (set(bond["parts"]), bond["gap"]) == ({"one", "two"}, "0.25 mm")
    assert "ADJUST=NO: the deck keeps the distance" in "\n".join(lines(found, "a.toml"))


def test_a_pressure_of_abaqus_follows_its_surface(tmp_path: Path) -> None:
    load = "*Amplitude, name=A\n0., 0., 1e-6, 1., 1., 1.\n*Step\n*Dynamic, Explicit\n, 1e-5\n"
    load += "*Dsload, amplitude=A\nfaces, P, 12.5\n"
    deck = INSTANCES.format(sets=TIED).replace("*Step\n*Dynamic, Explicit\n, 1e-5\n", load)
    found = read(tmp_path, "a.inp", deck)
    assert found.refusals == []
    (boundary,) = bare(found.data["boundaries"])
    assert boundary == {
        "kind": "traction", "pressure": "12.5 MPa", "follows": True, "on": "faces", "parts": ["one"],
        "course": [["0 s", 0.0], ["1e-06 s", 1.0], ["1 s", 1.0]],
    }  # fmt: skip
    (refusal,) = read(tmp_path, "b.inp", deck.replace("P, 12.5", "TRVEC, 12.5, 1, 0, 0")).refusals
    assert "only pressures ('surface, P, size') are translated" in refusal
