"""A fragment has the same number and the same colour in all snapshots of a real run, on the page and in pictures."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.output import layout
from conoid.client import snapshots
from conoid.client.drawing import part_colours
from conoid.client.snapshots import Snapshot

from .visitor import DEMO_CASE

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]
NODE = shutil.which("node")
WEB = Path(__file__).parents[2] / "client" / "web"
FOLLOWED = 20
"""Number of fragments that are followed, in addition to the steel bar and the largest fragment of glass."""


OFTEN = """
import sys
from conoid.worker.run import main as worker

ready = worker.ready_kernels

def readied(*arguments):
    ready(*arguments)
    from conoid.worker.snapshots import stage

    stage.pause = lambda *_, **__: 0.0

worker.ready_kernels = readied
sys.exit(worker.main(sys.argv[1:]))
"""
"""Script that runs the worker without the pause of 1 s between two snapshots: a fast machine would write few
snapshots."""


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> list[Snapshot]:
    """Snapshots of the demo until 200 us, as many as the worker can write."""
    folder = tmp_path_factory.mktemp("demo") / "run"
    command = [sys.executable, "-c", OFTEN, str(DEMO_CASE), "--out", str(folder)]
    for change in ("run.end_time='200 us'", "run.snapshots=400", "run.frames=60", "run.ranks=1", "reference=[]"):
        command += ["--set", change]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [snapshots.read(path) for path in sorted((folder / layout.SNAPSHOTS).glob("*.snap"))]


def parts_of(one: Snapshot) -> dict[int, int]:
    """Returns the part of each drawn fragment."""
    rows = one.array("vertex_fragment")[one.array("triangles")[:, 0]]
    numbers = one.fragments["id"][rows]
    return dict(zip(numbers.tolist(), one.array("triangle_part").tolist(), strict=True))


def test_fragments_are_followed_through_fifty_snapshots(seen: list[Snapshot]) -> None:
    assert len(seen) >= 50
    last, parts = seen[-1].fragments, parts_of(seen[-1])
    heaviest = [int(label) for label in last["id"][np.argsort(-last["mass"])] if label >= 0]
    steel, glass = (next(label for label in heaviest if parts.get(label) == part) for part in (0, 1))
    followed = [steel, glass, *[label for label in heaviest if label not in {steel, glass}][:FOLLOWED]]
    for label in followed:
        born = float(last["birth"][last["id"] == label][0]) * (1.0 - 1e-6)
        since = [one for one in seen if one.header.t >= born]  # before its birth the number is not final
        times, masses, centres, speeds = course(since, label)
        assert len(times) == len(since), f"{label} is never away"
        assert (np.diff(masses) <= 1e-9 * masses[0]).all(), "it loses pieces and never gets any"
        steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
        lost = 1.0 - masses[1:] / masses[:-1]
        assert (steps <= 2.0 * speeds[:-1] * np.diff(times) + 1e-4 + 0.06 * lost).all(), f"{label} does not jump"
    assert len(course(seen, steel)[0]) == len(seen)


def course(seen: list[Snapshot], label: int) -> tuple[np.ndarray, ...]:
    """Returns times, masses, centres, and maxima of the speed near the fragment, in the snapshots that contain the
    fragment.
    """
    rows = [(one, np.flatnonzero(one.fragments["id"] == label)) for one in seen]
    found = [(one.header.t, one.fragments, row[0]) for one, row in rows if len(row)]
    times, masses = np.array([t for t, *_ in found]), np.array([table["mass"][row] for _, table, row in found])
    centres = np.array([table["centre"][row] for _, table, row in found], float)
    speeds = np.linalg.norm([table["velocity"][row] for _, table, row in found], axis=1)
    return times, masses, centres, np.maximum(speeds, 300.0)


@pytest.mark.skipif(NODE is None, reason="no node on this machine")
def test_page_and_pictures_give_each_fragment_one_colour_at_all_times(seen: list[Snapshot], tmp_path: Path) -> None:
    for name in ("colours.js",):
        shutil.copy(WEB / name, tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    colours: dict[int, tuple[int, ...]] = {}
    for one in seen[:: max(1, len(seen) // 10)]:
        pairs = sorted(parts_of(one).items())
        script = "data.map(([id, part]) => page.ofFragment(BigInt(id), part, 2))"
        question = json.dumps({"module": str(tmp_path / "colours.js"), "script": script, "data": pairs})
        command = [str(NODE), str(Path(__file__).with_name("scripts.mjs"))]
        drawn = json.loads(subprocess.run(command, input=question, capture_output=True, text=True, check=True).stdout)
        numbers, parts = zip(*pairs, strict=True)
        assert drawn == part_colours.of_fragments(numbers, parts, 2).tolist()
        for (label, _), colour in zip(pairs, drawn, strict=True):
            assert colours.setdefault(label, tuple(colour)) == tuple(colour)
