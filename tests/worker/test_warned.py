"""``validate`` and a run give the same warnings and the same errors if both read the meshes."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case
from conoid.cases.model.bodies import Mesh
from conoid.cases.outcome import from_json
from conoid.client.examination import examine
from conoid.worker import simulation
from conoid.worker.errors import ConoidError
from conoid.worker.mesh.child import Limits, perform
from conoid.worker.mesh.sources import Sources
from conoid.worker.mesh.structured import structured
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.scene.survey import surveyed

BLOCK = {"shape": "box", "low": [0, 0, 0], "high": [2e-3, 2e-3, 2e-3], "element_size": 5e-4, "generator": "structured"}
GRIP = {"kind": "velocity", "parts": ["bar"], "low": [0, 0, 0], "high": ["2 mm", "2 mm", 0]}
PLANE = {"kind": "symmetry", "axis": "x", "at": 0}
METAL = {"density": 7800, "elastic": {"young": "200 GPa", "poisson": 0.3}}
GLASS = {
    "density": "2500 kg/m^3", "elastic": {"young": "70 GPa", "poisson": 0.22},
    "brittle": {"strength": "100 MPa", "energy": "8 J/m^2"},
}  # fmt: skip


def case(*boundaries: dict[str, Any], material: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Returns a bar from a file above a generated block."""
    below = {**BLOCK, "low": [0, 0, "-3 mm"], "high": ["2 mm", "2 mm", "-1 mm"]}
    mesh = {"shape": "file", "path": "bar.inp", "unit": "1 mm"}
    return {
        "name": "two", "materials": {"m": material or METAL},
        "run": {"end_time": "0.05 us", "frames": 0, "snapshots": 0},
        "parts": [
            {"name": "bar", "material": "m", "mesh": mesh, "velocity": [0, 0, "-9 m/s"], **more},
            {"name": "block", "material": "m", "mesh": below},
        ],
        "boundaries": list(boundaries), "contact": {},
    }  # fmt: skip


def write(path: Path, *shifts: tuple[float, float, float], bent: float = 0.0) -> None:
    """Writes a file of blocks at the given positions, mm, each with its own nodes; ``bent`` is the distance in mm of
    the nodes of the plane x = 0 from this plane.
    """
    made = structured(parse_case({**case(), "parts": case()["parts"][1:]}).parts[0].mesh)  # type: ignore[arg-type]
    nodes, tets = [], []
    for n, shift in enumerate(shifts):
        points = 1e3 * made.points + np.array([0.0, 0.0, 3.0]) + shift
        points[points[:, 0] == shift[0], 0] += bent
        nodes += [f"{n * len(points) + i + 1}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(points.tolist())]
        tets += [(made.tets + n * len(points) + 1).tolist()]
    lines = [f"{i + 1}, {', '.join(map(str, tet))}" for i, tet in enumerate(t for some in tets for t in some)]
    path.write_text("\n".join(["*NODE", *nodes, "*ELEMENT, TYPE=C3D4", *lines, "*ELEMENT, TYPE=MASS", "99999, 1", ""]))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Files are read in this process, which takes a tenth of the time of a child process."""
    monkeypatch.setenv("CONOID_CACHE_DIR", str(tmp_path / "cache"))

    def read(mesh: Mesh, sources: Sources, target: Path, key: str, limits: Limits) -> None:
        perform(mesh, key, sources, target)

    monkeypatch.setattr("conoid.worker.mesh.build.run_child", read)
    monkeypatch.setattr("conoid.client.examination._survey", lambda made, place: (surveyed(made, place), []))
    write(tmp_path / "bar.inp", (0, 0, 0))
    return tmp_path


def both(data: dict[str, Any], folder: Path) -> tuple[list[str], list[str]]:
    """Returns the warnings of an examination and those of a run up to its first step, without warnings of bare numbers,
    which the run gives when it reads the case."""
    examined = [str(each) for each in examine(data, folder).odd]
    begun = simulation.build(parse_case(data), folder, SerialComm())
    return [each for each in examined if "no unit, taken for" not in each], list(begun.warnings)


@pytest.mark.parametrize(
    ("data", "shifts", "bent", "words"),
    [
        (case(), [(0, 0, 0), (0, 0, 3)], 0.0, "2 pieces that share no node"),
        (case(), [(0, 0, 0), (0, 0, 2)], 0.0, "2 pieces that share no node"),
        (case(), [(1e11, 0, 0)], 0.0, "from the origin, with tets of"),
        (case({**PLANE, "parts": ["bar"]}), [(0, 0, 0)], 1e-3, "off this plane of symmetry"),
        (case({**GRIP, "z": 0, "high": ["2 mm", "2 mm", "0.47 mm"]}), [(0, 0, 0)], 0.0, "less than a tenth of an edge"),
        (case(velocity=[0, 0, "-2 km/s"]), [(0, 0, 0)], 0.0, "without eos"),
        (case(material=GLASS, velocity=[0, 0, "-1 km/s"]), [(0, 0, 0)], 0.0, "breaks in tension only"),
        (case() | {"contact": "none"}, [(0, 0, -1)], 0.0, "without contact or bond"),
        ({**case(), "run": {"end_time": "1 ns"}}, [(0, 0, 0)], 0.0, "is shorter than the first time step"),
        (
            case({**PLANE, "parts": ["bar"]}, velocity=["9 m/s", 0, 0]),
            [(0, 0, 0)],
            0.0,
            "check whether the motion is symmetric",
        ),
    ],
)
def test_both_warn_of_the_same(data: Any, shifts: Any, bent: float, words: str, folder: Path) -> None:
    write(folder / "bar.inp", *shifts, bent=bent)
    examined, begun = both(data, folder)
    assert examined == begun
    assert any(words in each for each in examined), examined
    assert any("elements that carry no volume are skipped: 1 MASS" in each for each in examined)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (case({**GRIP, "z": 0}, {**GRIP, "z": "1 m/s"}), r"boundaries\[1\]: drives nodes along z that boundaries\[0\]"),
        (
            case({**GRIP, "x": "1 m/s"}, {**PLANE, "parts": ["bar"]}),
            r"boundaries\[0\]: moves nodes off their plane of symmetry, boundaries\[1\]",
        ),
        (case({**PLANE, "at": "0.3 mm", "parts": ["bar"]}), r"boundaries\[0\]: tets of part 'bar' reach"),
        (case() | {"contact": {"parts": ["bar"], "self_contact": ["bar"]}}, "a piece of 'bar' overlaps another"),
        (case({"kind": "wall", "name": "w", "normal": [0, 0, 1], "point": [0, 0, "1 mm"], "parts": ["bar"]}), "behind"),
    ],
)  # fmt: skip
def test_both_refuse_the_same(data: Any, words: str, folder: Path) -> None:
    made = parse_case(data)
    if "piece" in words:
        write(folder / "bar.inp", (0, 0, 0), (1, 0, 0))
    refused = surveyed(made, folder).refused
    with pytest.raises(ConoidError, match=words) as error:
        simulation.build(made, folder, SerialComm())
    assert refused == [str(error.value)]


@pytest.mark.parametrize(
    "shift", [(0, 0, 0), (1, 0, 0), (0.13, 0.21, 0.4), (1.2, 1.3, 1.1), (0, 0, 1.5), (0.5, 0, 0), (0.5, 0.5, 1.5)]
)
@pytest.mark.parametrize("contact", ["none", {}])
def test_a_volume_that_counts_twice_is_refused_by_both(shift: Any, contact: Any, folder: Path) -> None:
    """The common volume of the blocks is the part of 8 mm^3 that the shift leaves. The common volume is exact if the
    tets coincide; otherwise its error is half a layer of tets.
    """
    write(folder / "bar.inp", (0, 0, 0), shift)
    made = parse_case(case() | {"contact": contact})
    message = r"parts\[0\].mesh: pieces of 'bar' that share no node overlap: about [0-9.e-]+ of 1.6e-08 m\^3 are"
    with pytest.raises(ConoidError, match=message) as error:
        simulation.build(made, folder, SerialComm())
    assert surveyed(made, folder).refused == [str(error.value)]
    twice = float(str(error.value).split("about ")[1].split()[0])
    common = float(np.prod([2.0 - each for each in shift]))
    aligned = all(each in {0, 1} for each in shift)
    assert 1e9 * twice == pytest.approx(common, rel=1e-3 if aligned else 0.3)


def test_a_process_of_each_warns_of_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The expected warnings are: a bare density, the notes of the file, its pieces, the law of tension only, and the
    linear pressure."""
    write(tmp_path / "bar.inp", (0, 0, 0), (0, 0, 3))
    data = case({**PLANE, "parts": ["bar"]}, material={**GLASS, "density": 2500}, velocity=[0, 0, "-2 km/s"])
    (tmp_path / "case.json").write_text(json.dumps(data))
    examined = [str(each) for each in examine(data, tmp_path).odd]
    command = [sys.executable, "-m", "conoid.worker", str(tmp_path / "case.json"), "--out", str(tmp_path / "out")]
    subprocess.run(command, check=True)
    outcome = from_json((tmp_path / "out" / "outcome.json").read_bytes())
    assert list(outcome.warnings[: len(examined)]) == examined
    assert {"no unit", "share no node", "tension only", "without eos", "no volume"} <= {
        words for words in ("no unit", "share no node", "tension only", "without eos", "no volume")
        if any(words in each for each in examined)
    }  # fmt: skip
    journal = (tmp_path / "out" / "journal.jsonl").read_text()
    assert all(json.dumps(each)[1:-1] in journal or each in journal for each in examined)
