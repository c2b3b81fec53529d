"""Folder of the compiled kernels.

numba's disk cache does not detect an edited callee in another file. Therefore the name of the cache folder is a hash.
The hash covers the code of every source on which kernels depend (files with kernels, and their imports from the
worker), the versions and the processor. The hash does not depend on the path and the time stamp of a source. Therefore
equal sources share a folder. Inside of the cache folder each module has its own folder (worker/kernels/jit.py), named
by a hash of the sources of its kernels. A new cache folder gets the folders of unchanged modules from an earlier cache
folder. Rank 0 hashes the sources once in a run, compiles missing kernels (worker/kernels/compile.py), and sends the
hash to the other ranks.
"""

import hashlib
import os
import platform
import re
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[1]
VARIABLE = "NUMBA_CACHE_DIR"
DECLARATION = "\n@njit("
"""Text with which the declaration of a kernel begins in a source file."""
_PROSE = re.compile(rb'"""[\s\S]*?"""|#[^\n]*')
"""Pattern of the docstrings and comments in a source file."""
_IMPORT = re.compile(r"^from (\.+)([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
"""Pattern of a relative import at the top level of a source without comments; its groups are level, module and names. A
pattern is used because reading the syntax trees of all sources would take six times as long."""


@cache
def source_hash(root: Path = ROOT) -> str:
    """Returns a hash of the sources of all kernels below ``root``, and of the versions. The computation takes 0.06 s of
    CPU time on an idle core.
    """
    return _hashed(kernel_sources(root), root)


def module_hash(path: Path, root: Path) -> str:
    """Returns a hash of everything on which the kernels of a file depend: its source, its imports, the versions and
    the processor.
    """
    return _named(f"{path.relative_to(root)} {_hashed(reached([path]), root)}")


def _hashed(sources: set[Path], root: Path) -> str:
    h = hashlib.sha256()
    for source in sorted(sources):
        h.update(f"{os.path.relpath(source, root)} ".encode() + _code(source.read_bytes()))
    for part in (version("numba"), version("llvmlite"), version("numpy"), platform.python_version()):
        h.update(part.encode())
    return h.hexdigest()


@cache
def _code(source: bytes) -> bytes:
    """Returns the lines of a source without docstrings, comments and empty lines, because kernels do not depend on
    them.
    """
    return b"\n".join(line.rstrip() for line in _PROSE.sub(b"", source).splitlines() if line.strip())


def _named(sources: str) -> str:
    return hashlib.sha256(f"{sources} {_processor()}".encode()).hexdigest()[:16]


def cache_folder(sources: str | None = None) -> Path:
    """Returns the cache folder for the kernels of this source tree on this machine.

    ``sources``: result of ``source_hash()``, if it was computed before.
    """
    base = os.environ.get("CONOID_CACHE_DIR") or Path.home() / ".cache" / "conoid"
    return Path(base) / "kernels" / _named(sources or source_hash())


def kernel_sources(root: Path) -> set[Path]:
    """Returns two kinds of files: files below ``root`` that have kernels, and files from which these import names,
    directly or through other files.
    """
    return reached(kernel_files(root))


def reached(paths: list[Path]) -> set[Path]:
    """Returns the files ``paths``, and the files that they import relatively, directly or through other files."""
    found: set[Path] = set()
    waiting = list(paths)
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += imported(path)
    return found


def kernel_files(root: Path) -> list[Path]:
    """Returns the files below ``root`` that have kernels."""
    return [path for path in root.rglob("*.py") if DECLARATION in path.read_text(encoding="utf-8")]


def imported(path: Path) -> list[Path]:
    """Returns the files that ``path`` imports relatively at its top level. A kernel can use names from these files
    only.
    """
    files = []
    for dots, module, names in _IMPORT.findall(_code(path.read_bytes()).decode()):
        base = path.parents[len(dots) - 1].joinpath(*module.split("."))
        files += [base.with_suffix(".py"), *((base / name).with_suffix(".py") for name in _names(names))]
    return [file for file in files if file.is_file()]


def _names(listed: str) -> list[str]:
    """Returns the names that an import statement imports, without the names after ``as``."""
    return [each.split()[0] for each in listed.strip("()\n ").split(",") if each.strip()]


@cache
def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith("flags")), platform.processor())


def use_cache(sources: str | None = None) -> Path:
    """Sets numba's cache folder and returns it.

    Raises RuntimeError if numba was already imported, because numba would then keep kernels beside their sources, and
    not detect an edited callee.
    """
    folder = cache_folder(sources)
    if "numba" in sys.modules and os.environ.get(VARIABLE) != str(folder):
        raise RuntimeError("numba was imported before its cache had a name")
    os.environ[VARIABLE] = str(folder)
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    return folder
