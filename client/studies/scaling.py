"""Execution of a scaling study: a case on several numbers of ranks and threads, with measured and projected times."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases.estimates.cores import usable_cores
from conoid.cases.load import resolved_json
from conoid.cases.outcome import from_json
from conoid.cases.output import layout
from conoid.cases.run import State

from ..errors import ClientError
from ..remote.submission import case_of, locate
from .projection import Network, Projection, read

CORES = usable_cores()
"""Number of cores that this process may use."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ENVIRONMENT = {**dict.fromkeys(_THREADS, "1"), "HYDRA_LAUNCHER": "fork", "HYDRA_IFACE": "lo"}


Layout = tuple[int, int]
"""A layout of a run: number of ranks, and number of threads of each rank."""


@dataclass(frozen=True)
class Trial:
    """A run of a scaling study."""

    ranks: int
    threads: int
    by_tasks: bool = False
    """True if the run uses one thread for each rank and times its tasks. Times with ``threads`` or fewer threads are
    computed from these task times."""

    @property
    def folder(self) -> str:
        """Name of the folder of the run inside the folder of the study."""
        threads = f"x{self.threads}" if self.threads > 1 else ""
        return f"ranks-{self.ranks}{threads}{'-tasks' if self.by_tasks else ''}"

    def changes(self, overrides: Sequence[str]) -> list[str]:
        """Returns the overrides of the case for this run, after ``overrides``."""
        return [*overrides, f"run.ranks={self.ranks}", f"run.threads={self.threads}"]


def trials(layouts: Iterable[Layout], cores: int) -> list[Trial]:
    """Returns the runs of a study of ``layouts`` on a machine with ``cores`` cores. The first run has one rank.
    Layouts with enough cores, and layouts with one thread for each rank, follow; ranks can share cores. For layouts
    with more threads than cores there are runs with timed tasks, and a run with two threads that checks the
    projection.
    """
    wanted = sorted({(1, 1), *layouts})
    beyond = {ranks: threads for ranks, threads in wanted if threads > 1 and ranks * threads > cores}
    if beyond:
        beyond.setdefault(1, max(beyond.values()))
        wanted = sorted({*wanted, (1, 2)} if cores > 1 else wanted)
    there = [Trial(*each) for each in wanted if each[1] == 1 or each[0] * each[1] <= cores]
    return [*there, *(Trial(ranks, threads, by_tasks=True) for ranks, threads in sorted(beyond.items()))]


def scale(
    case: str, overrides: Sequence[str], layouts: Sequence[Layout], folder: Path, network: Network
) -> Iterator[Projection]:
    """Runs a case on one rank and in each of the ``layouts``, one after the other, each in a folder of its own. A
    finished run of the same case is only read. Raises CaseError, and ClientError if a run fails.
    """
    for trial in trials(layouts, CORES):
        run(case, overrides, trial, folder)
        yield from found(trial, folder, layouts, network)


def run(case: str, overrides: Sequence[str], trial: Trial, folder: Path, seconds: float | None = None) -> None:
    """Computes a run of a study if it does not exist yet. Raises ClientError if the run fails, TimeoutExpired if the
    run has not ended after ``seconds``.
    """
    place = folder / trial.folder
    if not _there(place, resolved_json(case_of(case, trial.changes(overrides)))):
        _run(locate(case), trial, overrides, place, seconds)


def found(trial: Trial, folder: Path, layouts: Sequence[Layout], network: Network) -> list[Projection]:
    """Returns the projections from a run: for its own layout, or for all ``layouts`` that can be computed from its
    timed tasks.
    """
    place = folder / trial.folder
    if not trial.by_tasks:
        return [read(place, network)]
    # Layouts with 1 and 2 threads are compared with the measured run of two threads.
    also = {1, 2} if trial.ranks == 1 else set()
    known = from_json((place / layout.OUTCOME).read_bytes()).projected
    asked = {threads for ranks, threads in layouts if ranks == trial.ranks and ranks * threads > CORES}
    return [read(place, network, threads) for threads in sorted((asked | also) & set(known))]


def _there(folder: Path, case: bytes) -> bool:
    """Returns True if the run exists and has succeeded. Raises ClientError if the folder contains another run."""
    if not folder.exists():
        return False
    names = (layout.OUTCOME, layout.RESOLVED_CASE)
    if all((folder / name).is_file() for name in names) and (folder / layout.RESOLVED_CASE).read_bytes() == case:
        return _succeeded(folder)
    raise ClientError(f"{folder} contains another run, or a run that did not end; choose another folder")


def _succeeded(folder: Path) -> bool:
    """Returns True if the run has succeeded. Raises ClientError if the run has failed."""
    ended = folder / layout.OUTCOME
    outcome = from_json(ended.read_bytes()) if ended.is_file() else None
    if outcome is None or outcome.state != State.SUCCEEDED:
        message = outcome.message if outcome is not None else "no outcome was written"
        raise ClientError(f"the run in {folder} did not succeed: {message}")
    return True


def _run(case: Path, trial: Trial, overrides: Sequence[str], folder: Path, seconds: float | None) -> None:
    (folder / layout.LOGS).mkdir(parents=True)
    worker = [sys.executable, "-P", "-m", "mpi4py", "-m", "conoid.worker"]
    command = [*mpiexec(), "-n", str(trial.ranks), *worker, str(case)]
    words = [word for change in trial.changes(overrides) for word in ("--set", change)]
    words += ["--use", "project" if trial.by_tasks else "all"]
    crowded = {"MPIR_CVAR_ENABLE_HEAVY_YIELD": "1"} if trial.ranks > CORES else {}
    with (folder / layout.LOGS / layout.LAUNCHER_LOG).open("wb") as log:
        child = subprocess.Popen(
            [*command, "--out", str(folder), *words], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
            env={**os.environ, **_ENVIRONMENT, **crowded},
        )  # fmt: skip
        try:
            child.wait(seconds)
        finally:
            child.terminate()  # mpiexec forwards the signal to its ranks.
            child.wait()
    _succeeded(folder)


def mpiexec() -> list[str]:
    """Returns the mpiexec of the site if CONOID_MPIEXEC is set, else the mpiexec beside this Python or in PATH.
    Raises ClientError.
    """
    beside = Path(sys.executable).with_name("mpiexec")
    chosen = shlex.split(os.environ.get("CONOID_MPIEXEC", ""))
    found = str(beside) if beside.is_file() else shutil.which("mpiexec")
    if not chosen and found is None:
        raise ClientError("no mpiexec: install conoid[mpich], or set CONOID_MPIEXEC to the mpiexec of the site")
    return chosen or [str(found)]
