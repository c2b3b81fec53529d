"""Kernels: the name of the cache folder, the loading of kernels, and their compilation before a run."""

import ast
import fcntl
import importlib
import os
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.worker.errors import CompileError, StoppedError
from conoid.worker.kernels import compile as ahead
from conoid.worker.kernels import jit, store
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.run import main

BELOW = """
from conoid.worker.kernels.jit import njit

from .numbers import FACTOR


@njit("float64(float64)")
def scaled(x):
    return FACTOR * x
"""
ABOVE = """
from conoid.worker.kernels.jit import njit

from .below import scaled


@njit("void(float64[::1])")
def scale(values):
    for i in range(len(values)):
        values[i] = scaled(values[i])


@njit("float64(float64[::1])")
def total(values):
    return values.sum()
"""


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Writes a package ``tiny`` that child processes can import: three kernels in two modules."""
    root = tmp_path / "tiny"
    root.mkdir()
    files = {"above": ABOVE, "below": BELOW, "numbers": "FACTOR = 2.0\n", "beside": "from .above import scale\n"}
    for name, text in files.items():
        (root / f"{name}.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return root


# Hash of the sources --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("edited", "another"), [("above", True), ("numbers", True), ("beside", False)])
def test_an_edited_source_of_a_kernel_names_another_folder(tree: Path, edited: str, another: bool) -> None:
    before = store.source_hash(tree)
    with (tree / f"{edited}.py").open("a") as file:
        file.write("EDITED = True\n")
    store.source_hash.cache_clear()
    assert (store.source_hash(tree) != before) == another
    assert (store.cache_folder(store.source_hash(tree)) != store.cache_folder(before)) == another


def test_words_about_a_kernel_leave_its_folder_and_its_compiled_code(tree: Path, tmp_path: Path) -> None:
    """A docstring or a comment moves the lines of a kernel, but numba still finds the compiled kernel."""
    before, folder = store.source_hash(tree), tmp_path / "kernels"
    ahead.compile_all(folder, lambda *_: None, tree, "tiny")
    text = (tree / "above.py").read_text()
    (tree / "above.py").write_text('"""Two kernels.\n\nOf one file.\n"""\n\n# a comment\n\n' + text)
    store.source_hash.cache_clear()
    assert store.source_hash(tree) == before
    script = "import tiny.above as a; a.total.load(); print(*a.total.stats.cache_hits.values())"
    environment = os.environ | {store.VARIABLE: str(folder)}
    found = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["1"]


def test_a_copy_elsewhere_and_one_that_was_written_again_have_the_same_folder(tree: Path, tmp_path: Path) -> None:
    before = store.source_hash(tree)
    copied = shutil.copytree(tree, tmp_path / "copied")
    assert store.source_hash(copied) == before
    os.utime(tree / "above.py", (1e9, 1e9))
    store.source_hash.cache_clear()
    assert store.source_hash(tree) == before


def test_the_imports_found_by_a_pattern_are_those_of_the_syntax_tree() -> None:
    for path in store.ROOT.rglob("*.py"):
        found = [node for node in ast.parse(path.read_text()).body if isinstance(node, ast.ImportFrom) and node.level]
        bases = [(path.parents[node.level - 1].joinpath(*(node.module or "").split(".")), node.names) for node in found]
        files = [file for base, names in bases for file in (base, *(base / alias.name for alias in names))]
        imported = [file.with_suffix(".py") for file in files if file.with_suffix(".py").is_file()]
        assert sorted(store.imported(path)) == sorted(imported), path


def test_ranks_but_the_first_hash_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    class Second(SerialComm):
        rank = 1

        def broadcast(self, item: Any) -> Any:
            assert item is None
            return "0" * 64, None

    def refuse(*_: object) -> str:
        raise AssertionError("rank 1 hashes")

    monkeypatch.setenv(store.VARIABLE, "")
    monkeypatch.delitem(sys.modules, "numba")
    monkeypatch.setattr(store, "source_hash", refuse)
    main.ready_kernels(Second(), None)
    assert os.environ[store.VARIABLE] == str(store.cache_folder("0" * 64))


# Loading --------------------------------------------------------------------------------------------------------------


@jit.njit("float64(float64[::1], int64)", cache=False)
def _inner(values, i):  # type: ignore[no-untyped-def]
    return values[i] + 1.0


@jit.njit("float64(float64[::1], int64)", cache=False)
def _outer(values, i):  # type: ignore[no-untyped-def]
    return 2.0 * _inner(values, i)


def test_a_kernel_is_loaded_at_its_first_call_with_what_it_calls() -> None:
    begin = time.thread_time(), jit.cpu_time()
    assert not _outer.overloads
    assert not _inner.overloads
    assert _outer(np.ones(3), 1) == 4.0
    assert len(_outer.overloads) == len(_inner.overloads) == 1
    spent, worked = time.thread_time() - begin[0], jit.cpu_time() - begin[1]
    assert worked < 0.5 * spent, "what the loading took is no work"


@jit.njit("float64[::1](int64)", cache=False)
def made(n):  # type: ignore[no-untyped-def]
    return np.full(n, 2.0)


@jit.njit("float64(float64[::1], int64)", cache=False)
def read(values, i):  # type: ignore[no-untyped-def]
    return values[i]


@jit.njit("float64(int64)", cache=False)
def used(n):  # type: ignore[no-untyped-def]
    values, found = made(n), 0.0
    for i in range(n):
        found += read(values, i)
    return found


def test_only_kernels_with_arrays_count_references() -> None:
    """Arrays that a kernel allocates are freed, for any kernel that has read them."""
    pages, many = Path("/proc/self/statm"), 1_000_000
    assert used(10) == 20.0
    assert [kernel.targetoptions["_nrt"] for kernel in (made, read, used)] == [True, False, True]
    before = int(pages.read_text().split()[1])
    assert [used(many) for _ in range(40)] == [2.0 * many] * 40
    assert (int(pages.read_text().split()[1]) - before) * os.sysconf("SC_PAGE_SIZE") < 10 * 8 * many


def test_threads_may_call_a_kernel_first_together() -> None:
    @jit.njit("float64(float64[::1])", cache=False)
    def first(values):  # type: ignore[no-untyped-def]
        return values.sum()

    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(first, [np.ones(3)] * 8)) == [3.0] * 8
    assert len(first.overloads) == 1


@pytest.mark.parametrize("values", [np.ones(3, np.float32), np.ones((3, 3)), np.ones(6)[::2]])
@pytest.mark.parametrize("loaded", [False, True])
def test_a_kernel_takes_no_other_arguments_not_even_at_its_first_call(values: Any, loaded: bool) -> None:
    @jit.njit("float64(float64[::1])", cache=False)
    def first(values):  # type: ignore[no-untyped-def]
        return values[0]

    if loaded:
        first.load()
    with pytest.raises(TypeError, match="No matching definition"):
        first(values)
    assert len(first.overloads) == 1


# Compilation before a run ---------------------------------------------------------------------------------------------


def compiled(folder: Path) -> set[str]:
    return {path.name.split("-")[0] for path in folder.rglob("*.nbc")}


def test_all_kernels_are_compiled_and_the_progress_is_reported(tree: Path, tmp_path: Path) -> None:
    progress: list[tuple[int, int]] = []
    folder = tmp_path / "cache"
    assert ahead.compile_all(folder, lambda *numbers: progress.append(numbers), tree, "tiny")
    assert compiled(folder) == {"below.scaled", "above.scale", "above.total"}
    assert (progress[0], progress[-1]) == ((0, 3), (3, 3))
    assert progress == sorted(progress)
    assert not ahead.compile_all(folder, lambda *numbers: progress.append(numbers), tree, "tiny"), "all are there"


def test_modules_that_have_not_changed_are_linked_from_an_earlier_folder(tree: Path, tmp_path: Path) -> None:
    """A process that uses the new folder loads the kernels of unchanged modules from the old folder."""
    folders = [tmp_path / "cache" / name for name in ("first", "second", "third")]
    text = "import numpy as np; from tiny.above import scale; x = np.ones(2); scale(x); "
    text += "print(x, sum(scale.stats.cache_hits.values()))"
    edits = [
        ("above", ABOVE),
        ("above", ABOVE.replace("values[i] = s", "values[i] += s")),
        ("numbers", "FACTOR = 3.0\n"),
    ]
    progress = []
    for folder, (name, edited) in zip(folders, edits, strict=True):
        (tree / f"{name}.py").write_text(edited)
        assert ahead.compile_all(folder, lambda *_: None, tree, "tiny")
        environment = os.environ | {store.VARIABLE: str(folder)}
        ask = [sys.executable, "-c", text]
        progress.append(subprocess.run(ask, env=environment, capture_output=True, text=True, check=True).stdout)
    assert progress == ["[2. 2.] 1\n", "[3. 3.] 1\n", "[4. 4.] 1\n"]
    assert [compiled(folder) for folder in folders] == [{"below.scaled", "above.scale", "above.total"}] * 3
    below, above = (
        [next(folder.rglob(f"{name}*.nbc")).stat().st_ino for folder in folders] for name in ("below.sc", "above.sc")
    )
    assert below[0] == below[1] != below[2], "what it imports has changed at last"
    assert len(set(above)) == 3
    (folders[2] / ahead.COMPLETE).unlink()  # the program was killed after its last module
    assert ahead.compile_all(folders[2], lambda *_: None, tree, "tiny")
    assert (folders[2] / ahead.COMPLETE).exists()


def test_every_kernel_of_the_worker_is_counted() -> None:
    files = store.kernel_files(store.ROOT)
    for path in files:
        importlib.import_module(ahead._Module.of(path, store.ROOT, "conoid.worker").name)
    mine = [kernel for kernel in jit.DECLARED if kernel.py_func.__module__.startswith("conoid.worker.")]
    assert sum(path.read_text(encoding="utf-8").count(store.DECLARATION) for path in files) == len(mine)


def test_a_module_comes_after_those_that_it_imports() -> None:
    order = ahead._order(set(store.kernel_files(store.ROOT)))
    done: set[Path] = set()
    while ready := [path for path, needs in order.items() if needs <= done and path not in done]:
        done |= set(ready)
    assert done == set(order)
    assert store.ROOT / "elements" / "tet4.py" in order[store.ROOT / "elements" / "sweep.py"]


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ('@njit("void(float64)")\ndef broken(x):\n    missing(x)\n', "missing"),
        ("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n", "the process ended with code -9"),
        ("raise SystemExit(3)\n", "the process ended with code 3"),
    ],
)
def test_a_child_that_fails_ends_in_one_line(tree: Path, tmp_path: Path, wrong: str, reason: str) -> None:
    with (tree / "above.py").open("a") as file:
        file.write("\n\n" + wrong)
    with pytest.raises(CompileError, match=r"^kernels of tiny\.above cannot be compiled: ") as caught:
        ahead.compile_all(tmp_path / "cache", lambda *_: None, tree, "tiny")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "cache" / ahead.COMPLETE).exists()


def test_a_child_that_is_told_to_stop_has_not_failed(tree: Path, tmp_path: Path) -> None:
    """A launcher sends a cancel signal to every process of a rank."""
    with (tree / "above.py").open("a") as file:
        file.write("\n\nimport os, signal\nos.kill(os.getpid(), signal.SIGTERM)\n")
    with pytest.raises(StoppedError, match="stopped on request"):
        ahead.compile_all(tmp_path / "cache", lambda *_: None, tree, "tiny")


def test_a_child_that_hangs_is_not_waited_for(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tree / "below.py").write_text(BELOW + "\nimport time\ntime.sleep(1000)\n")
    monkeypatch.setattr(ahead, "_PATIENCE", 1.0)
    with pytest.raises(CompileError, match=r"tiny\.below.*not compiled after 1 s"):
        ahead.compile_all(tmp_path / "cache", lambda *_: None, tree, "tiny")


def test_a_folder_that_cannot_be_written_is_named(tree: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CompileError, match=r"kernels cannot be kept in .*file.*set CONOID_CACHE_DIR"):
        ahead.compile_all(tmp_path / "file" / "cache", lambda *_: None, tree, "tiny")


def test_a_second_program_waits_for_the_first(tree: Path, tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    folder.mkdir()
    progress: list[tuple[int, int]] = []
    with (folder / ahead._LOCK).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        second = threading.Thread(
            target=ahead.compile_all, args=(folder, lambda *numbers: progress.append(numbers), tree, "tiny")
        )
        second.start()
        time.sleep(1.0)
        assert not compiled(folder)
        assert progress == [(0, 3)]
        (folder / ahead.COMPLETE).touch()
    second.join(60.0)
    assert not second.is_alive()
    assert not compiled(folder), "the first has compiled them"


def test_the_worker_reports_the_cause_of_its_waiting(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def compile_all(folder: Path, tell: ahead.Tell) -> bool:
        tell(31, 112)
        raise CompileError("kernels of x cannot be compiled: y")

    monkeypatch.setattr(ahead, "compile_all", compile_all)
    monkeypatch.chdir(tmp_path)
    code = main.main(["taylor_copper", "--out", str(tmp_path / "run")])
    assert code == 1
    journal = (tmp_path / "run" / "journal.jsonl").read_text()
    assert '"state":"starting","cause":null,"message":"compiling kernels: 31 of 112"' in journal
    assert "kernels of x cannot be compiled: y" in (tmp_path / "run" / "outcome.json").read_text()


def test_numba_is_not_imported_before_its_cache_has_a_name() -> None:
    """Without a separate cache folder numba would store kernels beside their sources, and would not detect an edited
    callee.
    """
    text = "import sys, conoid.worker.run.main; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", text], check=True)
    text = "import numba; from conoid.worker.kernels import store; store.use_cache()"
    clean = {key: value for key, value in os.environ.items() if key != store.VARIABLE}
    ended = subprocess.run([sys.executable, "-c", text], env=clean, capture_output=True, text=True, check=False)
    assert "numba was imported before" in ended.stderr


def test_no_two_processes_call_a_function_the_same() -> None:
    """The objects of several processes are loaded together, so the functions in them need unique names."""
    ask = "from conoid.worker.kernels import jit; from numba.core.bytecode import FunctionIdentity as F; "
    ask += "print(next(F._unique_ids))"
    ended = [subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True) for _ in range(2)]
    one, other = (int(each.stdout) for each in ended)
    assert one != other
    assert min(one, other) > 2**40
