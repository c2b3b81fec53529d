"""``make accuracy``: writes docs/verification/accuracy.md with the measured result of every row of the catalogue.

With ``ACCURACY=quick`` the program leaves out studies of minutes, and the page reports the missing studies. Arguments
name single parts of the work: shipped, tests, hard. The results of each part are stored in build/accuracy, and the page
is written from the stored results of all parts. The argument ``write`` only writes the page.
"""

import json
import os
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import count, groupby, repeat
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.estimates.estimate import estimate
from conoid.cases.load import CaseError, apply_overrides, parse_case, read_data, shipped
from conoid.cases.model.schema import Case
from conoid.cases.suite import suite
from conoid.client.commands import hard
from conoid.client.errors import ClientError
from conoid.client.local.own_server import LocalServer
from conoid.client.run import Run
from conoid.client.studies.scaling import CORES
from conoid.client.studies.variants import sizes

from . import machine, pages

ROOT = Path(__file__).parents[2]
OUT = ROOT / "build" / "accuracy"
_QUIET = {"run.ranks": 1, "run.frames": 0, "run.snapshots": 0, "run.checkpoint_every": "none"}
_COARSE = 2.0
"""Factor of the element sizes in the second, cheaper run of a case (chosen value)."""
_RANKS = ("tests/parallel/", "tests/server/", "tests/client/")
"""Folders of tests that start processes for their work."""
_QUICK = 60.0
"""Estimated CPU time, s, above which ``quick`` leaves out a case (chosen value)."""


def catalogue() -> list[dict[str, Any]]:
    """Returns the rows of the catalogue in the order of the file."""
    text = Path(__file__).with_name("catalogue.toml").read_text(encoding="utf-8")
    return list(tomllib.loads(text)["row"])


def shipped_cases(quick: bool) -> dict[str, Any]:
    """Runs every shipped case that a row names, with the elements of the case and with coarser elements; returns the
    outcomes by name."""
    plans = {name: row.get("coarse", ()) for row in catalogue() for name in row.get("cases", ())}
    data = {f"{name}|{label}": made for name, coarse in plans.items() for label, made in _costs(name, coarse).items()}
    cases = {key: parse_case(made) for key, made in data.items()}
    left = [key for key, case in cases.items() if quick and _seconds(case) > _QUICK]
    chosen = sorted((key for key in data if key not in left), key=lambda key: -_seconds(cases[key]))
    with LocalServer(OUT / "runs", CORES) as server:
        folders = {key: shipped()[key.partition("|")[0]].parent for key in chosen}
        runs = {key: server.session.submit(data[key], folder=folders[key]) for key in chosen}
        return {"left": left, "runs": {key: _plain(key, run) for key, run in runs.items()}}


def _costs(name: str, coarse: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Returns the case itself, and the case with coarser elements if this is possible."""
    data = apply_overrides(read_data(shipped()[name]), _QUIET)
    found = {"as it is": data}
    try:
        changes = list(coarse) or sizes(parse_case(data), _COARSE)
        made = apply_overrides(data, changes)
        parse_case(made)
        found["coarser"] = made
    except (CaseError, ClientError):
        pass
    return found


def _seconds(case: Case) -> float:
    return estimate(case).core_seconds or 0.0


def _plain(key: str, run: Run) -> Any:
    info = run.wait()
    print(f"{key}: {info.state.value}", flush=True)
    outcome = info.outcome
    return msgspec.to_builtins(outcome) if outcome is not None else {"state": info.state.value, "message": info.message}


def tests(quick: bool) -> dict[str, Any]:
    """Runs every test that a row of the catalogue names, and returns the assertions of the tests. Tests that start
    ranks run first and alone, because their ranks wait for each other with a time limit. The tests without ranks run
    afterwards, one file on each core.
    """
    nodes = sorted({f"tests/{node}" for row in catalogue() for node in row.get("tests", ())})
    ranked = [node for node in nodes if node.startswith(_RANKS)]
    others = [node for node in nodes if node not in ranked]
    files = [list(group) for _, group in groupby(others, lambda node: node.partition("::")[0])]
    with ThreadPoolExecutor(CORES) as pool:
        return _recorded(ranked, "ranks", quick) | {
            node: entry for found in pool.map(_recorded, files, count(), repeat(quick)) for node, entry in found.items()
        }


def _recorded(nodes: list[str], name: object, quick: bool) -> dict[str, Any]:
    """Runs tests in a separate process; returns the assertions of the tests by node id."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(OUT / "bytecode"), "PYTHONPATH": str(ROOT)}
    file = OUT / f"recorded-{name}.json"
    command = [
        sys.executable, "-m", "pytest", "-q", "-p", "tests.bench.recorder", "-o", "enable_assertion_pass_hook=true",
        "--recorded", str(file), "--timeout", "3600", *(["-m", "not slow"] if quick else []), *nodes,
    ]  # fmt: skip
    file.unlink(missing_ok=True)
    subprocess.run(command, cwd=ROOT, env=environment, check=False)
    return dict(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else {}


def hard_cases(_: bool) -> list[Any]:
    """Runs the suite of hard cases."""
    verdicts = []
    with LocalServer(OUT / "runs", CORES) as server:
        for verdict in hard.run_all(server.session, suite(), 1):
            verdicts.append(msgspec.to_builtins(verdict))
            print(f"{verdict.hard.name}: {'; '.join(verdict.faults) or 'ended well'}", flush=True)
    return verdicts


PARTS: dict[str, Callable[[bool], Any]] = {"shipped": shipped_cases, "tests": tests, "hard": hard_cases}


def main(arguments: Sequence[str]) -> int:
    """Runs the named parts of the work, or all parts, and writes the page."""
    unknown = [name for name in arguments if name not in (*PARTS, "write")]
    if unknown:
        print(f"{' '.join(unknown)}: parts are {', '.join(PARTS)}; write writes what they have found")
        return 2
    quick = os.environ.get("ACCURACY") == "quick"
    OUT.mkdir(parents=True, exist_ok=True)
    for name in [each for each in arguments or PARTS if each in PARTS]:
        began = time.monotonic()
        found = PARTS[name](quick)
        part = {"found": found, "wall": time.monotonic() - began, "quick": quick, "machine": machine.describe()}
        (OUT / f"{name}.json").write_text(json.dumps(part, indent=1), encoding="utf-8")
    parts = {name: json.loads((OUT / f"{name}.json").read_text()) for name in PARTS if (OUT / f"{name}.json").is_file()}
    text, failed = pages.book(catalogue(), parts)
    (ROOT / "docs" / "verification" / "accuracy.md").write_text(text, encoding="utf-8")
    print(f"docs/verification/accuracy.md: {failed} rows fail")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
