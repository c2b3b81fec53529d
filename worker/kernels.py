"""Where compiled kernels are kept, and who compiles them.

numba's disk cache does not see an edited callee in another file, so the cache folder is named by a hash of every source
that a kernel is made of (files with kernels, and what they import from the worker), the versions and the processor.
Rank 0 compiles (or loads) first, the others then load what it left.
"""

import ast
import hashlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

_VARIABLE = "NUMBA_CACHE_DIR"


def cache_folder() -> Path:
    """The folder of this source tree's kernels on this machine."""
    h = hashlib.sha256()
    for source in sorted(kernel_sources(Path(__file__).parent)):
        h.update(source.read_bytes())
    for part in (version("numba"), version("llvmlite"), version("numpy"), platform.python_version(), _processor()):
        h.update(part.encode())
    base = os.environ.get("CONOID_CACHE_DIR") or Path.home() / ".cache" / "conoid"
    return Path(base) / "kernels" / h.hexdigest()[:16]


def kernel_sources(root: Path) -> set[Path]:
    """The files below ``root`` that hold kernels, and those whose names they import from there, to any depth."""
    found: set[Path] = set()
    waiting = [path for path in root.rglob("*.py") if "\n@njit(" in path.read_text(encoding="utf-8")]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imported(path)
    return found


def _imported(path: Path) -> list[Path]:
    """Files that ``path`` imports relatively."""
    files = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level > 0:
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            files += [base.with_suffix(".py"), *((base / alias.name).with_suffix(".py") for alias in node.names)]
    return [file for file in files if file.is_file()]


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith("flags")), platform.processor())


def use_cache() -> None:
    """Points numba to the folder; must come before numba is imported."""
    os.environ[_VARIABLE] = str(cache_folder())
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
