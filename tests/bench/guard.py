"""Cost of a change: seven scenes are computed in alternation with the sources of this commit and of an earlier commit.

The command is ``python -m tests.bench.guard [COMMIT] [--only SCENE ...]``; the default commit is ``BASE``. The earlier
sources are checked out below build/guard and run with the same Python and libraries; each run has one rank. The printed
ratio is the median over the rounds of the CPU time of this commit over the CPU time of the earlier commit: above 1 this
commit is slower. If the digests of both commits are equal, the results are bit-identical; otherwise the table has the
largest energy residual of both commits.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.output import layout

from .table import Cell, table

BASE = "c1ab530"
"""The last commit before the memory layout of the step was changed."""
ROOT = Path(__file__).parents[2]
HOUSES = "cases", "client", "server", "worker"
PHASES = "elements", "nodes", "contact", "fracture"


@dataclass(frozen=True)
class Scene:
    """A scene of the guard: a shipped case or a file of this folder, with assignments of keys."""

    name: str
    case: str
    assignments: tuple[str, ...]
    rounds: int


_FRAMES = "run.frames=0", "run.snapshots=0", "reference=[]"
_COARSE = tuple(f"parts[{k}].mesh.element_size=1 mm" for k in range(4))
_LONG = "run.end_time=400 us", "run.samples=10"
_SLOW = tuple(f"parts[{k}].velocity=['0 m/s', '0 m/s', '{speed} mm/s']" for k, speed in enumerate((1, -1)))
SCENES = (
    Scene("shattering bar", "guard_shattering_bar.toml", _FRAMES, 3),
    Scene("glass bar to 40 us", "glass_steel_bar", (*_FRAMES, "run.end_time=40 us", "numerics.dt_safety=0.9"), 1),
    Scene("long rod to 20 us", "long_rod", (*_FRAMES, "run.end_time=20 us"), 2),
    Scene("cradle, fixed costs", "newton_cradle", (*_FRAMES, *_COARSE, "run.end_time=300 us"), 3),
    Scene("two tets", "two_tets", (*_FRAMES, "run.samples=10"), 5),
    Scene("crossed bars without contact", "crossed_bars", (*_FRAMES, *_LONG, 'contact="none"'), 5),
    Scene("crossed bars before contact", "crossed_bars", (*_FRAMES, *_LONG, *_SLOW), 5),
)
QUICK = SCENES[0], SCENES[3]


@dataclass(frozen=True)
class Paid:
    """Cost of one run."""

    outcome: dict[str, Any]

    @property
    def digest(self) -> str:
        """Digest of the last state of the run."""
        return str(self.outcome["digest"])

    def cpu(self, *phases: str) -> float:
        """Returns the CPU time of the named phases, s, or of all phases if no phase is named."""
        spent = {name: float(each[0]) for name, each in self.outcome["phases"].items()}
        return sum(spent.get(name, 0.0) for name in phases or spent)


@dataclass(frozen=True)
class Compared:
    """Rounds of a scene: pairs of a run of the earlier commit and a run of this commit."""

    scene: Scene
    rounds: list[tuple[Paid, Paid]]

    def ratio(self, *phases: str) -> float:
        """Returns the median ratio over the rounds; 1 if the phases take less than a hundredth of the whole time in
        both commits.
        """
        pairs = [(there.cpu(*phases), here.cpu(*phases), 0.01 * there.cpu()) for there, here in self.rounds]
        return statistics.median(1.0 if max(there, here) < least else here / there for there, here, least in pairs)


class NoCommitError(Exception):
    """The commit is not in this repository."""


def sources(commit: str) -> Path:
    """Returns the folder for PYTHONPATH from which the packages of the given commit are imported. Raises NoCommitError
    if the commit is not in this repository.
    """
    place = ROOT / "build" / "guard" / commit
    if not (place / "conoid").is_dir():
        made = subprocess.run(["git", "archive", commit, *HOUSES], cwd=ROOT, capture_output=True)
        if made.returncode:
            raise NoCommitError(made.stderr.decode().strip() or f"git has no commit {commit}")
        (place / "conoid").mkdir(parents=True)
        subprocess.run(["tar", "--extract", "--directory", str(place / "conoid")], input=made.stdout, check=True)
    return place


def run(scene: Scene, place: Path | None) -> Paid:
    """Runs the scene once with the sources in ``place``, or with the present sources if ``place`` is None. Raises
    RuntimeError if the run does not succeed.
    """
    file = Path(__file__).with_name(scene.case)
    environment = os.environ | ({"PYTHONPATH": str(place)} if place else {})
    environment.pop("NUMBA_CACHE_DIR", None)
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
        words = [sys.executable, "-m", "conoid.worker", str(file) if file.exists() else scene.case, "--out", folder]
        words += [word for assignment in scene.assignments for word in ("--set", assignment)]
        done = subprocess.run(words, env=environment, cwd=folder, capture_output=True, text=True, timeout=3600)
        if done.returncode:
            raise RuntimeError(f"{scene.name}: {(done.stderr or done.stdout).strip().splitlines()[-1:]}")
        return Paid(json.loads((Path(folder) / layout.OUTCOME).read_bytes()))


def measure(scenes: Sequence[Scene], place: Path) -> Iterator[Compared]:
    """Runs every scene with the sources in ``place`` and with the present sources, in alternation."""
    for scene in scenes:
        yield Compared(scene, [(run(scene, place), run(scene, None)) for _ in range(scene.rounds)])


def report(found: Sequence[Compared], commit: str) -> str:
    """Returns a table; its last column reports whether the results of both commits are equal."""
    head = ["scene", "tets", "steps", f"CPU s at {commit}", "here", "ratio", *PHASES, "answer"]
    return table(head, [_row(each) for each in found])


def _row(each: Compared) -> list[Cell]:
    there, here = each.rounds[-1]
    seconds = [statistics.median(pair[k].cpu() for pair in each.rounds) for k in (0, 1)]
    return [
        each.scene.name, here.outcome["elements"], here.outcome["steps"], *(round(s, 1) for s in seconds),
        f"{each.ratio():.2f}", *(f"{each.ratio(phase):.2f}" for phase in PHASES), _answer(there, here),
    ]  # fmt: skip


def _answer(there: Paid, here: Paid) -> str:
    if there.digest == here.digest:
        return f"equal, {here.digest[:8]}"
    return f"another; residuals {there.outcome['worst_residual']:.1e}, {here.outcome['worst_residual']:.1e}"


def main(arguments: Sequence[str]) -> int:
    """Prints the table; returns 2 if the commit or a scene is unknown."""
    parser = argparse.ArgumentParser(prog="tests.bench.guard", description="CPU time of seven scenes here and there.")
    parser.add_argument("commit", nargs="?", default=BASE)
    parser.add_argument("--only", action="append", metavar="SCENE", help="a scene by how its name begins")
    asked = parser.parse_args(arguments)
    some = [scene for scene in SCENES if any(scene.name.startswith(name) for name in asked.only or [""])]
    if not some:
        parser.error(f"--only {' '.join(asked.only)}: scenes are {', '.join(scene.name for scene in SCENES)}")
    try:
        place = sources(asked.commit)
    except NoCommitError as error:
        parser.error(str(error))
    print(report(list(measure(some, place)), asked.commit))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
