"""Time from launch to the first step: phases with empty and full caches, number of compiled and loaded kernels, and
time from the submission over HTTP."""

import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.client.local.own_server import LocalServer

from .startup_phases import PHASES
from .table import Cell, table

CASE = "taylor_copper"
_ROOT = Path(__file__).parents[2]
Phases = dict[str, list[float]]
_CACHED = re.compile(r"^\[(\d+)\].*\[cache\] data (saved to|loaded from)", re.MULTILINE)


@dataclass(frozen=True)
class Startup:
    """Time to the first step of a Taylor bar with 12,960 tets, s; wall time and CPU time for each phase."""

    cold: Phases
    """Time on one rank, without kernels and mesh in the cache."""
    warm: Phases
    """Median time on one rank with kernels and mesh in the cache."""
    ranks: int
    cold_ranks: float
    """Time from ``mpiexec`` with the given number of ranks to the first step, without kernels in the cache, but with
    the mesh."""
    warm_ranks: float
    submitted: float
    """Time from the submission over HTTP to the first step, with kernels and mesh in the cache."""
    ahead: int
    """Number of kernels in the cache after a start without kernels in the cache."""
    compiled: dict[int, int]
    """Number of kernels that each rank compiled itself in a start without kernels in the cache."""
    loaded: dict[int, int] = field(default_factory=dict)
    """Number of kernels that each rank loaded in a start without kernels in the cache."""


def measure(rounds: int = 3, ranks: int = 2) -> Startup:
    """Compiles every kernel twice, in separate caches."""
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
        cache = {**os.environ, "CONOID_CACHE_DIR": folder}
        del cache["NUMBA_CACHE_DIR"]
        cold = _phases(cache)
        warm = [_phases(cache) for _ in range(rounds)]
        shutil.rmtree(Path(folder) / "kernels")
        cold_ranks, output = _launch(ranks, {**cache, "NUMBA_DEBUG_CACHE": "1"})
        warm_ranks = statistics.median(_launch(ranks, cache)[0] for _ in range(rounds))
        count = Counter((int(rank), what) for rank, what in _CACHED.findall(output))
        ahead = sum(1 for _ in Path(folder).rglob("*.nbc"))
        submitted = _submitted(rounds, ranks, cache)
    return Startup(
        cold=cold, warm={name: _medians([one[name] for one in warm]) for name in PHASES}, ranks=ranks,
        cold_ranks=cold_ranks, warm_ranks=warm_ranks, submitted=submitted, ahead=ahead,
        compiled={rank: count[rank, "saved to"] for rank in range(ranks)},
        loaded={rank: count[rank, "loaded from"] for rank in range(ranks)},
    )  # fmt: skip


def _medians(rows: list[list[float]]) -> list[float]:
    return [statistics.median(column) for column in zip(*rows, strict=True)]


def _phases(environment: Mapping[str, str]) -> Phases:
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench.startup_phases", str(time.time()), CASE],
        cwd=_ROOT, env=environment, stdout=subprocess.PIPE, text=True, timeout=600, check=True,
    )  # fmt: skip
    seconds: Phases = json.loads(done.stdout.splitlines()[-1])
    return seconds


def _launch(ranks: int, environment: Mapping[str, str]) -> tuple[float, str]:
    """Returns the time from ``mpiexec`` to the first step, s, and the output of the ranks; each line of the output
    names its rank.
    """
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
        command = [str(Path(sys.executable).with_name("mpiexec")), "-prepend-rank", "-n", str(ranks), sys.executable]
        command += ["-m", "mpi4py", "-m", "conoid.worker", CASE, "--out", folder]
        begin = time.time()
        done = subprocess.run(
            [*command, "--set", "run.end_time=1 us", "--set", "run.frames=0"],
            env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600, check=True,
        )  # fmt: skip
        return _first_step(Path(folder)) - begin, done.stdout


def _submitted(rounds: int, ranks: int, environment: Mapping[str, str]) -> float:
    before = dict(os.environ)
    os.environ.clear()
    os.environ.update(environment)
    try:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder, LocalServer(Path(folder), ranks) as server:
            seconds = []
            for _ in range(rounds):
                begin = time.time()
                run = server.session.submit(CASE, ["run.end_time=1 us", "run.frames=0", f"run.ranks={ranks}"])
                run.wait(120.0)
                seconds.append(_first_step(server.runs / run.id) - begin)
    finally:
        os.environ.clear()
        os.environ.update(before)
    return statistics.median(seconds)


def _first_step(folder: Path) -> float:
    """Returns the Unix time at which the worker began its first step."""
    lines = (folder / layout.JOURNAL).read_bytes().splitlines()
    return next(m.wall for m in map(messages.from_json, lines) if isinstance(m, messages.Started))


def report(startup: Startup) -> str:
    """Returns tables of the phases with empty and full caches, of the totals, and of the numbers of compilations."""
    columns = {name: [*startup.cold[name], *startup.warm[name]] for name in PHASES}
    columns["all"] = [sum(column) for column in zip(*columns.values(), strict=True)]
    rows: list[list[Cell]] = [[name, *(f"{value:.2f}" for value in values)] for name, values in columns.items()]
    compiled = "; ".join(
        f"rank {rank} compiled {startup.compiled[rank]} itself and loaded {startup.loaded[rank]}"
        for rank in startup.compiled
    )
    lines = [
        table(["one rank, seconds", "cold", "cold, CPU", "warm", "warm, CPU"], rows), "",
        f"mpiexec -n {startup.ranks} to the first step: {startup.cold_ranks:.1f} s without kernels in the cache, "
        f"{startup.warm_ranks:.2f} s with them; from the submission over HTTP {startup.submitted:.2f} s.",
        f"Cold, {startup.ahead} kernels were compiled ahead; {compiled}.",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"
