"""Number of kernel calls and of Python calls of the worker in a step: ``python -m tests.bench.calls CASE [--set ...]``.

The command runs the case on one rank and one thread with a profiler. A kernel call is a call of a kernel from Python; a
program or a pass of the threads is one call. Further arguments are those of the worker. ``--most N`` limits the two
lists of functions.
"""

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any

import conoid.worker
from conoid.cases.output import layout
from conoid.worker.kernels import store

ROOT = Path(conoid.worker.__file__).parent


class Calls:
    """Counts of calls by function: of kernels, and of the other functions of the worker."""

    def __init__(self, kernels: set[tuple[str, str]]) -> None:
        """``kernels``: file and name of each kernel."""
        self.kernels, self.python = Counter[str](), Counter[str]()
        self._known, self._root = kernels, f"{ROOT}{os.sep}"

    def count(self, frame: FrameType, event: str, _: Any) -> None:
        """Counts an event of ``sys.setprofile``; numba reports a kernel by its Python function."""
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        if event == "call" and file.startswith(self._root):
            found = self.kernels if (file, name) in self._known else self.python
            found[f"{file.removeprefix(self._root)}:{name}"] += 1


def counted(words: Sequence[str]) -> tuple[Calls, int]:
    """Runs a case; returns the calls in its time loop and the number of steps. Raises RuntimeError if the run does not
    succeed.
    """
    os.environ["NUMBA_CACHE_DIR"] = str(store.cache_folder())
    from conoid.worker.kernels.jit import DECLARED
    from conoid.worker.run import main
    from conoid.worker.run.loop import Loop

    calls: list[Calls] = []
    real = Loop.run

    def run(self: Loop) -> None:
        calls.append(Calls({(each.py_func.__code__.co_filename, each.py_func.__name__) for each in DECLARED}))
        sys.setprofile(calls[0].count)
        try:
            real(self)
        finally:
            sys.setprofile(None)

    Loop.run = run  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
        code = main.main([*words, "--out", folder, "--threads", "1"])
        if code:
            raise RuntimeError(f"the run ends with code {code}")
        return calls[0], int(json.loads((Path(folder) / layout.OUTCOME).read_bytes())["steps"])


def report(calls: Calls, steps: int, most: int) -> str:
    """Returns the calls in a step, and the functions with most calls."""
    lines = []
    for name, found in (("kernel calls", calls.kernels), ("Python calls of the worker", calls.python)):
        lines += [f"{name} in a step: {found.total() / steps:.1f}"]
        lines += [f"{number / steps:10.2f}  {function}" for function, number in found.most_common(most)]
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.bench.calls", description="See the module.")
    parser.add_argument("--most", type=int, default=10)
    options, rest = parser.parse_known_args()
    print(report(*counted(rest), options.most))
