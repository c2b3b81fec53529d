"""Compilation of all kernels ahead of a run, on several cores: ``python -m conoid.worker.kernels.compile``.

If the sources of a module are unchanged, its kernels are linked from an earlier cache folder. The kernels of all other
modules are compiled by one child process for each core, module after module. A module is compiled after the modules
that it imports, so that no kernel is compiled twice. numba has separate files for each kernel, so two children never
write the same file.
"""

import fcntl
import os
import queue
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from ..errors import CompileError, StoppedError
from ..run.signals import REQUESTS
from . import store

Tell = Callable[[int, int], None]
"""Callback that receives the progress every few seconds: number of compiled kernels, and number of all kernels."""

COMPLETE = "complete"
"""File in the cache folder. If the file exists, all kernels are compiled."""
WORD_EVERY = 3.0
"""Interval between two reports of the progress, s. Chosen value."""
_MOST = 4
"""Largest number of child processes. Chosen value: the longest chain of imports has 27 % of the machine code."""
_MOST_WORDS = 500
"""Number of characters that are kept from an error report of numba. The error is at the beginning of the report."""
_PATIENCE = 900.0
"""Time limit for the compilation of a module, s. The largest module takes ten seconds on an idle core."""
_HASH = "hash"
"""File in the folder of a module with compiled kernels. The file contains the hash of the sources of the kernels."""
_LOCK, _LOOK = "lock", 0.3
"""Two constants: the lock file of the program that compiles; and the interval between two checks of the lock, s, which
is a tenth of WORD_EVERY."""


def compile_all(folder: Path, tell: Tell, root: Path = store.ROOT, package: str = "conoid.worker") -> bool:
    """Compiles every kernel below ``root`` that is missing in ``folder``. Returns False if no kernel is missing. Raises
    CompileError.

    A lock ensures that only one program compiles at a time. A second program waits, and continues the compilation if
    the first program is killed.
    """
    if (folder / COMPLETE).exists():
        return False
    counts = {path: path.read_text(encoding="utf-8").count(store.DECLARATION) for path in store.kernel_files(root)}
    total = sum(counts.values())
    progress = _Saying(tell, folder, total)
    with _alone(folder, progress):
        if not (folder / COMPLETE).exists():
            modules = {path: _Module.of(path, root, package) for path in counts}
            kept = {path for path, module in modules.items() if module.take_over(folder)}
            if missing := set(counts) - kept:
                _in_parallel(_order(missing), folder, progress, modules)
            (folder / COMPLETE).touch()
    tell(total, total)
    return True


class _Saying:
    """Reports the number of kernels in the folder: first at once, then every ``WORD_EVERY`` s."""

    def __init__(self, tell: Tell, folder: Path, total: int) -> None:
        self._tell, self._folder, self._total = tell, folder, total
        self._last = -WORD_EVERY

    def __call__(self) -> None:
        if time.monotonic() - self._last >= WORD_EVERY:
            self._last = time.monotonic()
            self._tell(min(self._total, sum(1 for _ in self._folder.rglob("*.nbc"))), self._total)


@contextmanager
def _alone(folder: Path, progress: _Saying) -> Iterator[None]:
    """Holds the lock of the folder while this process lives, so that no other program compiles into the folder."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / _LOCK).open("w")
    except OSError as error:
        raise CompileError(f"kernels cannot be kept in {folder}: {error.strerror}; set CONOID_CACHE_DIR") from None
    with lock:
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                progress()
                time.sleep(_LOOK)
        yield


@dataclass(frozen=True)
class _Module:
    """A source file with kernels."""

    name: str
    """Name with which Python imports the module, and name of the module's cache folder."""
    hash: str
    """Hash of all sources on which the kernels of the module depend."""

    @classmethod
    def of(cls, path: Path, root: Path, package: str) -> "_Module":
        name = ".".join((package, *path.relative_to(root).with_suffix("").parts))
        return cls(name, store.module_hash(path, root))

    def take_over(self, folder: Path) -> bool:
        """Links the kernels of the module from another folder beside ``folder``, unless ``folder`` has them. Returns
        True if all kernels of the module are now in the folder.
        """
        own = folder / self.name
        if self._whole(own):
            return True
        for other in folder.parent.glob(f"*/{self.name}"):
            if self._whole(other):
                return self._link(other, own)
        return False

    def done(self, folder: Path) -> None:
        """Marks the kernels of the module in the folder as completely compiled."""
        own = folder / self.name
        own.mkdir(exist_ok=True)
        (own / _HASH).write_text(self.hash)

    def _whole(self, own: Path) -> bool:
        try:
            return (own / _HASH).read_text() == self.hash
        except OSError:
            return False

    def _link(self, other: Path, own: Path) -> bool:
        """Links files. Returns False if the file system allows no links; in this case the kernels are compiled."""
        try:
            own.mkdir(exist_ok=True)
            for path in other.glob("*.nb[ci]"):
                (own / path.name).unlink(missing_ok=True)
                (own / path.name).hardlink_to(path)
        except OSError:
            return False
        self.done(own.parent)
        return True


# Order of the modules ---------------------------------------------------------------------------------------------


def _order(files: set[Path]) -> dict[Path, set[Path]]:
    """Returns, for each file, the files that must be compiled before it. Files at the beginning of the longest chains
    of imports come first.
    """
    needs = {path: _needed(path, files) for path in files}
    length = {path: len(path.read_text(encoding="utf-8")) for path in files}
    chain: dict[Path, int] = {}
    for path in sorted(files, key=lambda path: len(needs[path]), reverse=True):
        chain[path] = length[path] + max((chain[user] for user in chain if path in needs[user]), default=0)
    return {path: needs[path] for path in sorted(files, key=lambda path: (-chain[path], path))}


def _needed(path: Path, files: set[Path]) -> set[Path]:
    """Returns the ``files`` that ``path`` imports, directly or through other files."""
    return (store.reached([path]) & files) - {path}


def _in_parallel(needs: dict[Path, set[Path]], folder: Path, progress: _Saying, modules: dict[Path, _Module]) -> None:
    """Compiles files. A file is compiled after the files that it ``needs``. The function uses as many child processes
    as there are cores.
    """
    children: queue.SimpleQueue[_Child] = queue.SimpleQueue()
    number = min(_MOST, len(os.sched_getaffinity(0)), len(needs))
    done: set[Path] = set()
    running: dict[Future[None], Path] = {}
    waiting, last = list(needs), time.monotonic()
    with ThreadPoolExecutor(number) as threads, ExitStack() as ended:
        for _ in range(number):
            children.put(ended.enter_context(_child(folder)))
        while waiting or running:
            progress()
            ready = [path for path in waiting if needs[path] <= done][: number - len(running)]
            for path in ready:
                waiting.remove(path)
                running[threads.submit(_by_one, children, modules[path].name)] = path
            finished, _ = wait(running, timeout=_LOOK, return_when=FIRST_COMPLETED)
            for future in finished:
                future.result()
                done.add(path := running.pop(future))
                modules[path].done(folder)
                last = time.monotonic()
            if time.monotonic() - last > _PATIENCE:
                name = modules[min(running.values())].name
                raise CompileError(f"kernels of {name}: not compiled after {_PATIENCE:.0f} s")


def _by_one(children: "queue.SimpleQueue[_Child]", module: str) -> None:
    child = children.get()
    child.compile(module)
    children.put(child)


# Child processes --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Child:
    """Process that compiles modules. Its standard error is the file ``errors``."""

    process: "subprocess.Popen[bytes]"
    errors: IO[bytes]

    def compile(self, module: str) -> None:
        """Compiles a module. Returns when all kernels of the module are in the cache. Raises CompileError. Raises
        StoppedError if the run was asked to stop, because a launcher sends the stop signal to all processes of a rank.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(module.encode() + b"\n")
            if self.process.stdout.readline().decode().strip() == module:
                return
        if -self.process.wait() in REQUESTS:
            raise StoppedError("stopped on request, before its kernels were compiled")
        raise CompileError(f"kernels of {module} cannot be compiled: {self._reason()}")

    def _reason(self) -> str:
        """Returns the last line that the child process wrote, or its exit code."""
        code = self.process.wait()
        self.errors.seek(0)
        lines = self.errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1].strip() if lines and code > 0 else f"the process ended with code {code}"


@contextmanager
def _child(folder: Path) -> Iterator[_Child]:
    """Starts a child process; it ends when the ``with`` block ends, or when this process dies."""
    command = [sys.executable, "-P", "-m", "conoid.worker.kernels.compile", "--child"]
    environment = os.environ | {store.VARIABLE: str(folder), "NUMBA_NUM_THREADS": "1"}
    pipe = subprocess.PIPE
    with (
        tempfile.TemporaryFile() as errors,
        subprocess.Popen(command, bufsize=0, stdin=pipe, stdout=pipe, stderr=errors, env=environment) as process,
    ):
        try:
            yield _Child(process, errors)
        finally:
            process.kill()


def _serve() -> int:
    """Runs the child: imports the modules named on standard input, compiles their kernels, and writes the name of each
    finished module. Returns the exit code.

    A child process prints only its answers to standard output; it prints all other text to standard error.
    """
    import importlib

    from . import jit

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    try:
        for module in map(str.strip, sys.stdin):
            importlib.import_module(module)
            for kernel in jit.DECLARED:
                if kernel.py_func.__module__ == module:
                    kernel.load()
            print(module, file=answers, flush=True)
    except Exception as error:
        text = " ".join(f"{type(error).__name__}: {error}".split())
        print(text[:_MOST_WORDS], file=sys.stderr)
        return CompileError.exit_code
    return 0


def words(done: int, total: int) -> str:
    """Returns the progress as text."""
    return f"compiling kernels: {done} of {total}"


def main() -> int:
    """Compiles missing kernels and reports the progress; returns the exit code."""
    try:
        fresh = compile_all(store.cache_folder(), lambda done, total: print(words(done, total), flush=True))
    except (CompileError, StoppedError) as error:
        print(error, file=sys.stderr)
        return CompileError.exit_code
    if not fresh:
        print("all kernels are compiled")
    return 0


if __name__ == "__main__":
    sys.exit(_serve() if "--child" in sys.argv else main())
