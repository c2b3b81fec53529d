"""A case made from a deck and an equal case written directly have equal results, to the last bit."""

import sys
from pathlib import Path

import pytest

from conoid.cases.outcome import from_json
from conoid.cases.output import layout

from ..client.taylor_deck import abaqus_text, lsdyna_text
from .launching import command, ended

SIZE, END = 1.6e-3, "6.0E-6"
NATIVE = """
name = "by_hand"

[materials.metal]
density = "8930 kg/m^3"
elastic.young = "117 GPa"
elastic.poisson = 0.35
strength.model = "linear_hardening"
strength.yield_stress = "0.4 GPa"
strength.hardening = "0.1 GPa"

[[parts]]
name = "bar"
material = "metal"
mesh = {{ shape = "file", path = "bar.{kind}", unit = "1 mm", group = "{group}" }}
velocity = ["0 m/s", "0 m/s", "-227 m/s"]
[[boundaries]]
kind = "symmetry"
axis = "x"

[[boundaries]]
kind = "symmetry"
axis = "y"

{wall}
[run]
end_time = "6 us"
frames = {frames}
"""
WALL = '[[boundaries]]\nkind = "wall"\npoint = ["0 m", "0 m", "0 m"]\nnormal = [0, 0, 1]\n'
PLANE = '[[boundaries]]\nkind = "symmetry"\naxis = "z"\n'


def digest(folder: Path, case: Path, ranks: int) -> str:
    done = ended(command(ranks, str(case), "--out", str(folder)))
    assert done.returncode == 0, done.stderr
    found = from_json((folder / layout.OUTCOME).read_bytes()).digest
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("kind", "text", "group", "wall", "frames"),
    [("k", lsdyna_text(SIZE, END), "1", WALL, 2), ("inp", abaqus_text(SIZE, END), "ROD", PLANE, 20)],
    ids=["lsdyna", "abaqus"],
)
def test_an_imported_taylor_bar_is_the_one_written_by_hand(
    tmp_path: Path, kind: str, text: str, group: str, wall: str, frames: int
) -> None:
    deck, hand = tmp_path / f"bar.{kind}", tmp_path / "by_hand.toml"
    deck.write_text(text, encoding="utf-8")
    hand.write_text(NATIVE.format(kind=kind, group=group, wall=wall, frames=frames), encoding="utf-8")
    words = [sys.executable, "-m", "conoid.client.cli", "import", str(deck), "--units", "mm,t,s"]
    assert ended(words).returncode == 0
    imported = digest(tmp_path / "imported", tmp_path / "bar.toml", 1)
    assert imported == digest(tmp_path / "native", hand, 2)
