"""Where compiled kernels are kept, and who compiles them.

numba's disk cache does not see an edited callee in another file, so the cache folder is named by a hash of all worker
sources, the versions and the processor. Rank 0 compiles (or loads) first, the others then load what it left.
"""

import hashlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

_VARIABLE = "NUMBA_CACHE_DIR"


def cache_folder() -> Path:
    """The folder of this source tree's kernels on this machine."""
    h = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        h.update(source.read_bytes())
    for part in (version("numba"), version("llvmlite"), version("numpy"), platform.python_version(), _processor()):
        h.update(part.encode())
    base = os.environ.get("CONOID_CACHE_DIR") or Path.home() / ".cache" / "conoid"
    return Path(base) / "kernels" / h.hexdigest()[:16]


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith("flags")), platform.processor())


def use_cache() -> None:
    """Points numba to the folder; must come before numba is imported."""
    os.environ.setdefault(_VARIABLE, str(cache_folder()))
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
