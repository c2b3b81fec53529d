"""Description of the machine and the software of a measurement."""

import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path


def describe() -> dict[str, str]:
    """Returns processor, cores, load, versions and commit, as text."""
    return {
        "processor": f"{_processor()}, {os.cpu_count()} cores",
        "load": load(),
        "python": platform.python_version(),
        "numba": version("numba"),
        "numpy": version("numpy"),
        "commit": _commit(),
    }


def load() -> str:
    """Returns the number of runnable processes, mean over 1, 5 and 15 minutes. A mean above the number of cores shows
    that other programs were running, too."""
    return " ".join(f"{mean:.1f}" for mean in os.getloadavg())


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def _commit() -> str:
    here = Path(__file__).parent
    made = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=here, capture_output=True, text=True)
    return made.stdout.strip() or "unknown"
