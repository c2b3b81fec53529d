"""A folder of runs that no solver computed: the command is
``python -m tests.bench.many FOLDER --runs 200 --sweeps 10``.

The runs have one of three shipped cases and are spread over two months; most runs are points of sweeps, and some runs
have failed. Each run has the files that a server and the page read: submission, case, journal, history.csv, one
snapshot, outcome. The numbers in these files follow simple laws of the changed keys, so that plots show a trend. The
same arguments make the same folder, except for the time of day.
"""

import argparse
import json
import random
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases import load
from conoid.server.intake.plans import FOLDER, Plan
from conoid.server.runs import folder
from tests.server.visitor import OWNER

from .story import Story

Changes = dict[str, Any]
_BATCHES = ("first", "second", "paper")
_DAYS = 60
"""Period in which the runs were submitted (chosen value)."""


@dataclass(frozen=True)
class Planned:
    """Points of a sweep of a case."""

    case: str
    label: str
    points: Sequence[Changes]


@dataclass(frozen=True)
class Place:
    """Identity of a run: id, owner, Unix time of its submission, labels."""

    run: str
    owner: str
    at: float
    labels: dict[str, str]


def grid(keys: dict[str, Sequence[Any]]) -> list[Changes]:
    """Returns each combination of the values of the keys."""
    return [dict(zip(keys, row, strict=True)) for row in product(*keys.values())]


def plans(sweeps: int) -> list[Planned]:
    """Yields the given number of sweeps; the first sweeps of each kind show the clearest trend."""
    speed, wide = "parts[0].velocity[2]", "parts[1].mesh.element_size"
    kinds = [
        Planned("glass_steel_demo", "speed", [{speed: f"{v} m/s"} for v in range(60, 301, 20)]),
        Planned("glass_steel_demo", "friction and size", grid({
            "contact.friction": [0.0, 0.1, 0.2, 0.3], wide: ["2.0 mm", "2.4 mm", "2.8 mm", "3.2 mm"],
        })),
        Planned("taylor_copper", "speed", [{speed: f"{v} m/s"} for v in (-150, -170, -190, -210, -227)]),
        Planned("long_rod", "speed and ranks", grid({
            speed: [f"{v} m/s" for v in (900, 1100, 1300, 1500)], "run.ranks": [1, 2, 4],
        })),
    ]  # fmt: skip
    return [kinds[n % len(kinds)] for n in range(sweeps)]


def lay(runs: Path, number: int = 200, sweeps: int = 10, owner: str = OWNER, seed: int = 1) -> list[str]:
    """Creates the folders of ``number`` runs of an owner; returns the ids of the runs, the oldest first."""
    draw = random.Random(seed)
    runs.mkdir(exist_ok=True, mode=0o700)
    jobs = list(_jobs(plans(sweeps), number, draw))
    begin, step = time.time() - 86400.0 * _DAYS, 86400.0 * (_DAYS - 0.1) / len(jobs)
    made = []
    for n, job in enumerate(jobs):
        at = begin + step * n
        ids = [_id(at + 0.004 * k, draw) for k in range(len(job.points))]
        sweep = _sweep(runs, job, ids, owner, at, draw) if job.label else ""
        for k, (run, changes) in enumerate(zip(ids, job.points, strict=True)):
            labels = {"sweep": sweep, "point": str(k)} if sweep else {"batch": draw.choice(_BATCHES)}
            _run(runs, Place(run, owner, at + 0.004 * k, labels), job.case, changes, draw)
        made += ids
    return made


def _jobs(planned: Sequence[Planned], number: int, draw: random.Random) -> Iterator[Planned]:
    """Yields sweeps, and single runs between the sweeps, up to the requested number of runs."""
    alone = number - sum(len(each.points) for each in planned)
    left, rest = list(planned), max(0, alone)
    while left or rest > 0:
        if left and draw.random() < len(left) / (len(left) + rest):
            yield left.pop(0)
        elif rest > 0:
            rest -= 1
            case = draw.choice(["glass_steel_demo", "taylor_copper", "long_rod"])
            yield Planned(case, "", [{"parts[0].velocity[2]": f"{draw.randrange(100, 300, 10)} m/s"}])


def _id(at: float, draw: random.Random) -> str:
    """Returns an id with the format of ``folder.new_id``, for another time of submission."""
    return folder._letters(int(1e6 * at), 11) + folder._letters(draw.getrandbits(55), 11)


def _sweep(runs: Path, job: Planned, ids: list[str], owner: str, at: float, draw: random.Random) -> str:
    plan = Plan(
        id=_id(at - 0.1, draw), owner=owner, name=job.case, submitted=at, key=None, digest="", at_once=2,
        points=list(job.points), runs=ids,
    )  # fmt: skip
    place = runs / FOLDER
    place.mkdir(exist_ok=True, mode=0o700)
    (place / f"{plan.id}.json").write_bytes(msgspec.json.encode(plan))
    return plan.id


def _run(runs: Path, place: Place, name: str, changes: Changes, draw: random.Random) -> None:
    data = load.apply_overrides(tomllib.loads(load.shipped_path(name).read_text()), changes)
    case = load.parse_case(data)
    made = folder.Submission(
        id=place.run, owner=place.owner, name=case.name, title=case.title, ranks=case.run.ranks,
        threads=case.run.threads, submitted=place.at, case_file="case.json", body_sha256="", idempotency_key=None,
        wall_time=None, estimate={}, labels=place.labels,
    )  # fmt: skip
    path = folder.create(runs, made, json.dumps(data).encode(), load.resolved_json(case))
    Story(path, place.run, case, place.at + 2.0, draw).tell()


def main(arguments: list[str]) -> None:
    """Creates the folder of runs."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("folder", type=Path)
    words.add_argument("--runs", type=int, default=200)
    words.add_argument("--sweeps", type=int, default=10)
    words.add_argument("--owner", default=OWNER)
    options = words.parse_args(arguments)
    made = lay(options.folder, options.runs, options.sweeps, options.owner)
    print(f"{len(made)} runs in {options.folder}")


if __name__ == "__main__":
    main(sys.argv[1:])
