"""Combinations of ranks and threads on three scenes, in a given time: the glass bar, a bar with eight times its tets,
the long rod.

The command ``python -m tests.bench.threads FOLDER [--minutes 10] [--scenes bar,rod,large] [--ranks 1,1x16,...]`` makes
one run after the other, the most important runs first, until the time is used up; an unfinished run is stopped at this
time. A later call of the command continues from the runs in FOLDER. Each call of the command prints the tables of
``conoid bench scale`` of each scene, and writes the tables to FOLDER.

On 16 cores all combinations take about ten minutes. On fewer cores, the times of threads without a core are
projected from timed tasks; runs with two threads show the error of this projection.
"""

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases.figures import duration
from conoid.cases.outcome import from_json
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.client.commands.benches import layouts_of
from conoid.client.errors import ClientError
from conoid.client.remote.submission import case_of
from conoid.client.studies import study
from conoid.client.studies.projection import Network
from conoid.client.studies.scaling import CORES, Layout, Trial, found, run, trials

RANKS = "1,1x16,16,4x4,1x4,2x8,1x8,1x2"
"""Combinations of ranks and threads, the most important combinations first."""
NETWORK = Network(latency=2e-6, bandwidth=5e9)
_QUIET = ["run.frames=0", "run.snapshots=0", "reference=[]"]
_LEAST = 10.0
"""Time in s that must remain for a run to start (chosen value: a run takes about five seconds to its first step)."""


@dataclass(frozen=True)
class Scene:
    """A case with its changed keys."""

    case: str
    changes: tuple[str, ...]


SCENES: Mapping[str, Scene] = {
    "bar": Scene("glass_steel_bar", ("run.end_time=30us", "run.samples=120", "numerics.dt_safety=0.9")),
    "rod": Scene("long_rod", ("run.end_time=10us", "run.samples=40")),
    "large": Scene(
        "glass_steel_bar",
        ("run.end_time=6us", "run.samples=60", "numerics.dt_safety=0.9", "parts[0].mesh.element_size=0.45mm",
         "parts[1].mesh.element_size=0.45mm"),
    ),
}  # fmt: skip


def main(words: Sequence[str]) -> int:
    """Runs the benchmark. Returns 0 if all runs are complete, 3 if the time was too short, 1 if digests differ or a run
    failed."""
    options = _parse(words)
    layouts, deadline = layouts_of(options.ranks), time.monotonic() + 60.0 * options.minutes
    names = options.scenes.split(",")
    short = False
    try:
        for name, trial in _in_order(names, layouts):
            short |= not _made(SCENES[name], trial, options.folder / name, deadline)
    except KeyboardInterrupt:
        short = True
    ended = [_ended(name, options.folder / name, layouts) for name in names]
    return 1 if not all(ended) else 3 if short else 0


def _parse(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.threads", description="See the module.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--ranks", default=RANKS)
    return parser.parse_args(words)


def _in_order(names: Sequence[str], layouts: Sequence[Layout]) -> Iterator[tuple[str, Trial]]:
    """Yields the runs: all scenes of each combination, in the given order; the combination with a single rank comes
    first.
    """
    place = {each: number for number, each in enumerate([(1, 1), *layouts][::-1])}
    some = sorted(trials(layouts, CORES), key=lambda trial: -place.get((trial.ranks, trial.threads), 0))
    return ((name, trial) for trial in some for name in names)


def _made(scene: Scene, trial: Trial, folder: Path, deadline: float) -> bool:
    """Returns whether the run is complete; an unfinished run of an earlier call is repeated."""
    place = folder / trial.folder
    if place.exists() and not _succeeded(place):
        shutil.rmtree(place)
    left = deadline - time.monotonic()
    if not place.exists() and left < _LEAST:
        return False
    began = time.monotonic()
    try:
        run(scene.case, [*scene.changes, *_QUIET], trial, folder, left)
    except subprocess.TimeoutExpired:
        return False
    print(f"{folder.name} {trial.folder}: {duration(time.monotonic() - began)}", file=sys.stderr, flush=True)
    return True


def _succeeded(place: Path) -> bool:
    ended = place / layout.OUTCOME
    return ended.is_file() and from_json(ended.read_bytes()).state == State.SUCCEEDED


def _ended(name: str, folder: Path, layouts: Sequence[Layout]) -> bool:
    """Prints the tables of the finished runs of a scene; returns whether the digests of these runs are equal."""
    scene = SCENES[name]
    there = [trial for trial in trials(layouts, CORES) if _succeeded(folder / trial.folder)]
    if not there or (there[0].ranks, there[0].threads) != (1, 1):
        print(f"{name}: no run on one rank and one thread, so there is nothing to compare with\n")
        return True
    runs = [each for trial in there for each in found(trial, folder, layouts, NETWORK)]
    done = study.Study(case_of(scene.case).name, scene.changes, CORES, NETWORK, runs)
    text = study.to_markdown(done)
    (folder / "scale.md").write_text(text, encoding="utf-8")
    (folder / "scale.json").write_bytes(study.to_json(done))
    print(f"## {name}\n\n{text}")
    return done.equal


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except ClientError as error:
        sys.exit(str(error))
