"""A case on several numbers of ranks and threads: what each run took, and what it would take with a core a thread."""

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
"""That this process may use."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ENVIRONMENT = {**dict.fromkeys(_THREADS, "1"), "HYDRA_LAUNCHER": "fork", "HYDRA_IFACE": "lo"}


Layout = tuple[int, int]
"""Ranks, and threads of each."""


@dataclass(frozen=True)
class Trial:
    """One run of a study."""

    ranks: int
    threads: int
    by_tasks: bool = False
    """On one thread a rank, with tasks that are timed: what ``threads`` and fewer would take follows from them."""

    @property
    def folder(self) -> str:
        """Below that of the study."""
        threads = f"x{self.threads}" if self.threads > 1 else ""
        return f"ranks-{self.ranks}{threads}{'-tasks' if self.by_tasks else ''}"

    def changes(self, overrides: Sequence[str]) -> list[str]:
        """Keys of the case."""
        return [*overrides, f"run.ranks={self.ranks}", f"run.threads={self.threads}"]


def trials(layouts: Iterable[Layout], cores: int) -> list[Trial]:
    """The runs that a study of ``layouts`` takes on a machine with so many ``cores``: one rank first; then what there
    are cores for, and ranks of one thread, which can take turns; then, for layouts whose threads have no cores, runs
    with tasks that are timed, and two threads that show how right they are.
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
    """Runs a case on one rank and in each of the ``layouts``, one after the other, each in its own folder.

    A run that is there already, of the same case, is only read. Raises CaseError, and ClientError for a run that does
    not succeed.
    """
    for trial in trials(layouts, CORES):
        run(case, overrides, trial, folder)
        yield from found(trial, folder, layouts, network)


def run(case: str, overrides: Sequence[str], trial: Trial, folder: Path, seconds: float | None = None) -> None:
    """Makes a run of a study that is not there yet. Raises ClientError where it does not succeed, TimeoutExpired when
    it has not ended after so many ``seconds``.
    """
    place = folder / trial.folder
    if not _there(place, resolved_json(case_of(case, trial.changes(overrides)))):
        _run(locate(case), trial, overrides, place, seconds)


def found(trial: Trial, folder: Path, layouts: Sequence[Layout], network: Network) -> list[Projection]:
    """What a run says of its layout, or of those of ``layouts`` that follow from its tasks."""
    place = folder / trial.folder
    if not trial.by_tasks:
        return [read(place, network)]
    also = {1, 2} if trial.ranks == 1 else set()  # to compare with, and beside two threads that are measured
    known = from_json((place / layout.OUTCOME).read_bytes()).projected
    asked = {threads for ranks, threads in layouts if ranks == trial.ranks and ranks * threads > CORES}
    return [read(place, network, threads) for threads in sorted((asked | also) & set(known))]


def _there(folder: Path, case: bytes) -> bool:
    """Whether the run has been done. Raises ClientError when the folder holds another one."""
    if not folder.exists():
        return False
    names = (layout.OUTCOME, layout.RESOLVED_CASE)
    if all((folder / name).is_file() for name in names) and (folder / layout.RESOLVED_CASE).read_bytes() == case:
        return _succeeded(folder)
    raise ClientError(f"{folder} holds another run, or one that did not end; choose another folder")


def _succeeded(folder: Path) -> bool:
    """True. Raises ClientError for a run that did not succeed."""
    ended = folder / layout.OUTCOME
    outcome = from_json(ended.read_bytes()) if ended.is_file() else None
    if outcome is None or outcome.state != State.SUCCEEDED:
        said = outcome.message if outcome is not None else "no outcome was written"
        raise ClientError(f"the run in {folder} did not succeed: {said}")
    return True


def _run(case: Path, trial: Trial, overrides: Sequence[str], folder: Path, seconds: float | None) -> None:
    (folder / layout.LOGS).mkdir(parents=True)
    command = [*mpiexec(), "-n", str(trial.ranks), sys.executable, "-m", "mpi4py", "-m", "conoid.worker", str(case)]
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
            child.terminate()  # mpiexec tells its ranks
            child.wait()
    _succeeded(folder)


def mpiexec() -> list[str]:
    """The site's own when it names one, else the one beside this Python or in PATH. Raises ClientError."""
    beside = Path(sys.executable).with_name("mpiexec")
    chosen = shlex.split(os.environ.get("CONOID_MPIEXEC", ""))
    found = str(beside) if beside.is_file() else shutil.which("mpiexec")
    if not chosen and found is None:
        raise ClientError("no mpiexec: install conoid[mpich], or name the site's own in CONOID_MPIEXEC")
    return chosen or [str(found)]
