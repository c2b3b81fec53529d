"""A case on several numbers of ranks: what each run took, and what it would take with a core a rank."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from conoid.cases import layout
from conoid.cases.cores import usable_cores
from conoid.cases.load import resolved_json
from conoid.cases.outcome import from_json
from conoid.cases.run import State

from .errors import ClientError
from .projection import Network, Projection, read
from .submission import case_of, locate

CORES = usable_cores()
"""That this process may use."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ENVIRONMENT = {**dict.fromkeys(_THREADS, "1"), "HYDRA_LAUNCHER": "fork", "HYDRA_IFACE": "lo"}


def scale(
    case: str, overrides: Sequence[str], ranks: Sequence[int], folder: Path, network: Network
) -> Iterator[Projection]:
    """Runs a case on one rank and on each number of ``ranks``, one after the other, each in its own folder.

    A run that is there already, of the same case, is only read. Raises CaseError, and ClientError for a run that does
    not succeed.
    """
    for number in sorted({1, *ranks}):
        place = folder / f"ranks-{number}"
        if not _there(place, resolved_json(case_of(case, [*overrides, f"run.ranks={number}"]))):
            _run(locate(case), overrides, number, place)
        yield read(place, network)


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


def _run(case: Path, overrides: Sequence[str], ranks: int, folder: Path) -> None:
    (folder / layout.LOGS).mkdir(parents=True)
    command = [*mpiexec(), "-n", str(ranks), sys.executable, "-m", "mpi4py", "-m", "conoid.worker", str(case)]
    changes = [word for override in overrides for word in ("--set", override)]
    crowded = {"MPIR_CVAR_ENABLE_HEAVY_YIELD": "1"} if ranks > CORES else {}
    with (folder / layout.LOGS / layout.LAUNCHER_LOG).open("wb") as log:
        subprocess.run(
            [*command, "--out", str(folder), *changes], stdin=subprocess.DEVNULL, stdout=log, stderr=log, check=False,
            env={**os.environ, **_ENVIRONMENT, **crowded},
        )  # fmt: skip
    _succeeded(folder)


def mpiexec() -> list[str]:
    """The site's own when it names one, else the one beside this Python or in PATH. Raises ClientError."""
    beside = Path(sys.executable).with_name("mpiexec")
    chosen = shlex.split(os.environ.get("CONOID_MPIEXEC", ""))
    found = str(beside) if beside.is_file() else shutil.which("mpiexec")
    if not chosen and found is None:
        raise ClientError("no mpiexec: install conoid[mpich], or name the site's own in CONOID_MPIEXEC")
    return chosen or [str(found)]
