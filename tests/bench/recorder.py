"""A pytest plugin that stores as JSON the assertions of every test with their numbers, the outcome of the test and its
CPU time.

The command is ``pytest -p tests.bench.recorder -o enable_assertion_pass_hook=true --recorded FILE``. The tests need no
change for the recorder: pytest calls a hook for each assertion that holds, with the values of its terms.
"""

import json
import re
import time
from pathlib import Path
from typing import Any

import pytest

_NUMBER = re.compile(r"\d")
_SIGN = re.compile(r"<|>|==|\bin\b")


class Recorder:
    """Collects the results of the tests by node id."""

    def __init__(self, path: Path) -> None:
        """Sets the file that is written at the end of the session."""
        self.path = path
        self.tests: dict[str, dict[str, Any]] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Any:
        """Measures the CPU time of the test and of the processes for which the test waits."""
        began = _cpu()
        try:
            return (yield)
        finally:
            self._entry(item.nodeid)["cpu"] = _cpu() - began
            self._entry(item.nodeid)["says"] = (getattr(item.obj, "__doc__", "") or "") if hasattr(item, "obj") else ""

    def pytest_assertion_pass(self, item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
        """Stores the last values of each assertion that compares numbers."""
        if _NUMBER.search(expl) and _SIGN.search(orig):
            line = " ".join(expl.split("\n", 1)[0].split())
            self._entry(item.nodeid)["held"][str(lineno)] = [" ".join(orig.split()), line]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Stores the outcome of the test; a failure of the setup or the teardown also counts."""
        entry = self._entry(report.nodeid)
        if report.when == "call" or report.outcome != "passed":
            xfailed = hasattr(report, "wasxfail")
            entry["outcome"] = "expected to fail" if xfailed and report.outcome == "skipped" else report.outcome
            if entry["outcome"] == "expected to fail":
                entry["why"] = str(report.wasxfail)
            if report.outcome == "failed":
                entry["why"] = str(report.longrepr).strip().rsplit("\n", 1)[-1]

    def pytest_runtest_logfinish(self) -> None:
        """Writes the file after every test, so that an interrupted session has the results of the finished tests."""
        self.path.write_text(json.dumps(self.tests, indent=1), encoding="utf-8")

    def _entry(self, node: str) -> dict[str, Any]:
        return self.tests.setdefault(node, {"outcome": "not run", "cpu": 0.0, "held": {}, "why": "", "says": ""})


def _cpu() -> float:
    import resource

    own = time.process_time()
    below = resource.getrusage(resource.RUSAGE_CHILDREN)
    return own + below.ru_utime + below.ru_stime


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the option ``--recorded``."""
    parser.addoption("--recorded", type=Path, default=None)


def pytest_configure(config: pytest.Config) -> None:
    """Starts the recorder if the option ``--recorded`` is given."""
    path = config.getoption("--recorded")
    if path is not None:
        config.pluginmanager.register(Recorder(path), "recorder")
