"""Real workers under the real mpiexec, started and awaited with a time limit; no process of a worker continues after a
test.
"""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

MPIEXEC = Path(sys.executable).with_name("mpiexec")
PATIENCE, EACH = 180.0, 30.0
"""Time limits in s: of a launcher, and of each run that ``together`` starts in one program in addition."""
_PROCESS = re.compile(r"rank \d+ of \d+, process (\d+)")


def command(ranks: int, *arguments: str, module: Sequence[str] = ("-m", "conoid.worker")) -> list[str]:
    """Returns the command line of a worker; ``module`` may be another program that runs the worker."""
    return [str(MPIEXEC), "-n", str(ranks), sys.executable, "-m", "mpi4py", *module, *arguments]


@contextmanager
def started(words: list[str]) -> Iterator[subprocess.Popen[str]]:
    """Starts a launcher in a separate process group, and kills it at the end of the ``with`` block."""
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as launcher:
        try:
            yield launcher
        finally:
            if launcher.poll() is None:
                launcher.terminate()
                try:
                    launcher.wait(20.0)
                except subprocess.TimeoutExpired:
                    os.killpg(launcher.pid, 9)


def ended(words: list[str], patience: float = PATIENCE) -> subprocess.CompletedProcess[str]:
    """Waits at most ``patience`` s for the end of the launcher; returns the launcher."""
    with started(words) as launcher:
        out, err = launcher.communicate(timeout=patience)
    return subprocess.CompletedProcess(words, launcher.returncode, out, err)


def together(ranks: int, place: Path, runs: Sequence[Sequence[str]]) -> None:
    """Runs several cases one after the other in one program of ``ranks`` ranks; each case is given by the arguments of
    its worker. ``place``: a folder for the cases.
    """
    place.mkdir(exist_ok=True)
    (place / "runs.json").write_text(json.dumps(runs), encoding="utf-8")
    program = Path(__file__).with_name("many.py")
    words = command(ranks, str(place / "runs.json"), module=[str(program)])
    finished = ended(words, PATIENCE + EACH * len(runs))
    assert finished.returncode == 0, finished.stdout + finished.stderr


def processes(folder: Path) -> list[int]:
    """Returns the process ids that the ranks of a run wrote into their logs."""
    return [
        int(number) for log in sorted(folder.glob("log/rank-*.log")) for number in _PROCESS.findall(log.read_text())
    ]


def wait_until_gone(numbers: list[int], seconds: float = 20.0) -> list[int]:
    """Waits for processes to end; returns the processes that have not ended."""
    limit = time.monotonic() + seconds
    while (left := [n for n in numbers if _lives(n)]) and time.monotonic() < limit:
        time.sleep(0.05)
    return left


def _lives(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_for(path: Path, text: str, launcher: subprocess.Popen[str], seconds: float = 90.0) -> None:
    """Waits until a file contains a text; fails if the launcher ends or the time limit has passed."""
    limit = time.monotonic() + seconds
    while not path.exists() or text not in path.read_text(encoding="utf-8"):
        assert launcher.poll() is None, "the worker ended before it wrote that"
        assert time.monotonic() < limit, f"{text!r} did not appear in {path}"
        time.sleep(0.05)
