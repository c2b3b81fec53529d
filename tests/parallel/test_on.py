"""Boundaries and probes on sets of a mesh file have the same effect as boxes with the same nodes, on any number of
ranks."""

from pathlib import Path
from random import Random

import h5py

from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from ..mesh.bars import bar
from ..mesh.decks import prepost
from ..mesh.mixtures import mixture
from .launching import together

CASE = """
name = "pulled"
[run]
end_time = "6 us"
samples = 20
frames = 0
[materials.glass]
density = "2500 kg/m^3"
elastic.young = "72 GPa"
elastic.poisson = 0.22
brittle.strength = "60 MPa"
brittle.energy = "20 J/m^2"
brittle.scatter = { modulus = 8, seed = 1, area = "0.1 mm^2" }
[[parts]]
name = "bar"
material = "glass"
mesh = { shape = "file", path = "bar.inp", unit = "1 mm" }
fracture = { delay = 0.2, shear_weight = 0.5 }
[[boundaries]]
kind = "velocity"
CLAMP
x = 0.0
[[boundaries]]
kind = "traction"
END
stress = ["90 MPa", 0, 0]
[[boundaries]]
kind = "rotation"
CLAMP
spin = { rate = ["3000 rad/s", 0, 0], centre = [0, "1 mm", "1 mm"] }
[[probes]]
name = "end"
part = "bar"
field = "velocity_x"
TIP
[[probes]]
name = "push"
part = "bar"
field = "momentum_x"
LAST
"""
MANY = next(seed for seed in range(100) if len({kind for kind, _ in mixture(seed).elements.values()}) == 3)
"""A mesh that has hexahedra, wedges and pyramids."""
SETS = {"CLAMP": 'on = "clamp"', "END": 'on = "END"', "TIP": 'on = "TIP"', "LAST": 'on = "TIP"'}
BOXES = {
    "CLAMP": 'low = [0, 0, 0]\nhigh = [0, "2 mm", "2 mm"]',
    "END": 'low = ["10 mm", 0, 0]\nhigh = ["10 mm", "2 mm", "2 mm"]',
    "TIP": 'low = ["9 mm", 0, 0]\nhigh = ["10 mm", "2 mm", "2 mm"]',
    "LAST": 'low = ["10 mm", 0, 0]\nhigh = ["10 mm", "2 mm", "2 mm"]',
}

MIXED = """
name = "mixed"
[run]
end_time = "3 us"
samples = 10
frames = 0
[[parts]]
name = "lump"
material = "steel"
mesh = { shape = "file", path = "lump.k", unit = "1 mm" }
stretch = { rate = ["2e4 1/s", 0, "-1e4 1/s"] }
[[boundaries]]
kind = "velocity"
on = "CLAMP"
y = 0.0
"""

HALF = """
name = "half"
[run]
end_time = "8 us"
samples = 10
frames = 1
sets = ["END"]
[[parts]]
name = "bar"
material = "steel"
mesh = { shape = "file", path = "bar.inp", unit = "1 mm" }
[[boundaries]]
kind = "symmetry"
axis = "x"
ON
[[boundaries]]
kind = "traction"
on = "END"
stress = ["-200 MPa", 0, 0]
course = [["0 us", 1], ["3 us", 1], ["3.1 us", -1]]
"""
"""Case: a bar that is pressed on a plane of symmetry, and pulled off later."""


def case(place: Path, name: str, words: dict[str, str], turning: bool) -> str:
    """Returns a case file. A box cannot rotate nodes, so that the case with boxes is compared without the rotation."""
    text = CASE if turning else CASE.replace('kind = "rotation"\nCLAMP\nspin', 'kind = "gravity"\n#')
    text = text.replace("#", 'acceleration = ["1 m/s^2", 0, 0]\n#')
    if turning:
        text = text.replace('kind = "velocity"\nCLAMP\nx = 0.0', 'kind = "velocity"\nTIP\ny = "1 m/s"')
    for word, keys in words.items():
        text = text.replace(f"\n{word}\n", f"\n{keys}\n")
    (place / f"{name}.toml").write_text(text, encoding="utf-8")
    return str(place / f"{name}.toml")


def test_sets_hold_what_boxes_hold_on_any_number_of_ranks(tmp_path: Path) -> None:
    bar(tmp_path / "bar.inp", (10, 2, 2), more="*NSET, NSET=LIGAMENT, GENERATE\n1, 3")
    names = {"sets": (SETS, False), "boxes": (BOXES, False), "turning": (SETS, True)}
    files = {name: case(tmp_path, name, *what) for name, what in names.items()}
    truth = mixture(MANY)
    (tmp_path / "lump.k").write_text(prepost(truth, {7: list(truth.elements)}, Random(0)), encoding="utf-8")
    (tmp_path / "mixed.toml").write_text(MIXED, encoding="utf-8")
    files["mixed"] = str(tmp_path / "mixed.toml")
    for name, on in (("plane", ""), ("held", 'on = "CLAMP"'), ("crack", 'on = "LIGAMENT"')):
        (tmp_path / f"{name}.toml").write_text(HALF.replace("\nON\n", f"\n{on}\n"), encoding="utf-8")
        files[name] = str(tmp_path / f"{name}.toml")
    ends: dict[tuple[str, int], Outcome] = {}
    histories = {}
    for ranks in (1, 3):
        runs = [[file, "--out", str(tmp_path / f"{name}-{ranks}"), "--use", "all"] for name, file in files.items()]
        together(ranks, tmp_path / f"place-{ranks}", runs)
        for name in files:
            out = tmp_path / f"{name}-{ranks}"
            ends[name, ranks] = from_json((out / layout.OUTCOME).read_bytes())
            histories[name, ranks] = (out / layout.HISTORY).read_bytes()
    assert {end.state for end in ends.values()} == {"succeeded"}
    assert len({ends[name, ranks].digest for name in ("plane", "held") for ranks in (1, 3)}) == 1
    assert ends["crack", 1].digest == ends["crack", 3].digest
    assert_open(tmp_path / "crack-3", ligament=3, crack=6)
    assert len({ends[name, ranks].digest for name in ("sets", "boxes") for ranks in (1, 3)}) == 1
    assert ends["mixed", 1].digest == ends["mixed", 3].digest, "hexahedra, wedges and pyramids of a keyword deck"
    assert ends["turning", 1].digest == ends["turning", 3].digest != ends["sets", 1].digest
    assert (ends["sets", 1].broken or 0) > 10, "nodes on sets separate, too"
    assert histories["sets", 1] == histories["sets", 3]
    assert histories["turning", 1] == histories["turning", 3]


def assert_open(folder: Path, ligament: int, crack: int) -> None:
    """The nodes of the set stay on the plane of symmetry, other nodes on the plane have left it; the frame contains the
    sets.
    """
    with h5py.File(layout.frame(folder, 1)) as file:
        root = file["VTKHDF"]
        x, data = root["Points"][:, 0], root["PointData"]
        there = x - data["displacement"][:, 0] < 1e-9
        held = data["set_LIGAMENT"][:] == 1
        assert (held & there).sum() == held.sum() == ligament
        assert (data["set_END"][:].sum(), (there & ~held).sum()) == (9, crack)
        assert (x[held] == 0.0).all()
        assert (x[there & ~held] > 1e-6).all()
