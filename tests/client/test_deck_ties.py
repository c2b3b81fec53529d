"""Ties of decks become bonds, with the tolerance of the deck."""

from pathlib import Path

import pytest

from conoid.client.decks.importing import lines

from .deck_texts import STEEL, lsdyna, read, row

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
