"""The command ``python -m tests.bench.energy_lines [NAME]...`` runs every hard and every shipped case. For each case it
writes into docs/verification/energy_lines.md the term of the energy balance that has created the most energy, the
created energy and the limit.

Each case is a run on one rank without frames. Results are stored in build/energy_lines, one file for each case. Cases
with a stored result are not run again, and cheap cases run first. The argument ``write`` only writes the page.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

from conoid.cases.estimates.estimate import Estimate, estimate
from conoid.cases.load import apply_overrides, parse_case, read_data, shipped
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.suite import suite

from .table import Cell, table

ROOT = Path(__file__).parents[2]
OUT, PAGE = ROOT / "build" / "energy_lines", ROOT / "docs" / "verification" / "energy_lines.md"
_QUIET = ("run.ranks=1", "run.frames=0", "run.snapshots=0", "run.checkpoint_every=none")
_COLUMNS = ("case", "state", "worst line", "made", "at, s", "limit", "residual", "tets", "steps", "estimated", "CPU s")


@dataclass(frozen=True)
class Row:
    """End of a run, and the term of the energy balance that has created the most energy."""

    case: str
    state: str
    message: str
    line: str
    made: float
    at: float | None
    limit: float
    residual: float
    tets: int
    steps: int
    cpu: float

    @property
    def bad(self) -> bool:
        """True if a run succeeded although a term of the energy balance is above its limit."""
        return self.state == "succeeded" and self.made > self.limit


@dataclass(frozen=True)
class Plan:
    """A case with its changed keys."""

    name: str
    path: Path
    changes: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """Estimated cost of the run, core s."""
        return self._estimate.core_seconds or 0.0

    @property
    def steps(self) -> int | None:
        """Estimated number of steps of the run."""
        return self._estimate.steps

    @cached_property
    def _estimate(self) -> Estimate:
        return estimate(parse_case(apply_overrides(read_data(self.path), self.changes)), self.path.parent)


def plans() -> list[Plan]:
    """Returns all cases, the cheapest case first."""
    found = [Plan(f"hard/{each.name}", each.path, (*each.changes, *_QUIET)) for each in suite()]
    found += [Plan(f"shipped/{name}", path, _QUIET) for name, path in sorted(shipped().items())]
    return sorted(found, key=lambda plan: plan.seconds)


def measured(plan: Plan) -> Row:
    """Runs a case."""
    with tempfile.TemporaryDirectory() as passing:
        sets = [word for change in plan.changes for word in ("--set", change)]
        command = [sys.executable, "-m", "conoid.worker", str(plan.path), "--out", passing, *sets]
        subprocess.run(command, check=False, capture_output=True)
        outcome = from_json((Path(passing) / "outcome.json").read_bytes())
    case = parse_case(apply_overrides(read_data(plan.path), plan.changes))
    return row_of(plan.name, outcome, case.run.made_limit)


def row_of(name: str, outcome: Outcome, limit: float) -> Row:
    """Returns the table row of a finished run."""
    worst = outcome.made[0] if outcome.made else None
    return Row(
        name, outcome.state, outcome.message, worst.line if worst else "none", worst.share if worst else 0.0,
        worst.time if worst else None, limit, outcome.worst_residual, outcome.elements or 0, outcome.steps or 0,
        outcome.cpu,
    )  # fmt: skip


def rows() -> Iterator[Row]:
    """Yields the table rows of the finished cases, hard cases first."""
    for path in sorted(OUT.glob("*.json")):
        yield Row(**json.loads(path.read_text(encoding="utf-8")))


def page(found: Sequence[Row]) -> str:
    """Returns the page with a table and the list of errors."""
    expected = {plan.name: plan.steps for plan in plans()}
    lines: list[list[Cell]] = [
        [r.case, r.state, r.line, r.made, r.at, r.limit, r.residual, r.tets, r.steps, expected[r.case], round(r.cpu, 1)]
        for r in found
    ]
    wrong = [f"- {r.case}: {r.line} has made {r.made:.3g}" for r in found if r.bad]
    wrong += [f"- {r.case}: {r.message}" for r in found if r.state != "succeeded"]
    known = [plan.name for plan in plans()]
    left = sorted(set(known) - {r.case for r in found})
    return "\n\n".join([
        "# Energy created by single terms of the energy balance",
        "The table contains every hard and every shipped case, each run on one rank. The command `python -m "
        "tests.bench.energy_lines` writes this table. The column \"worst line\" is the term of the energy balance that "
        "has created the most energy at any time of the run. The column \"made\" is the created energy over the "
        "largest energy of the run up to this time, \"at\" is the time, and \"limit\" is `run.made_limit`. The column "
        "\"estimated\" is the number of steps that `conoid validate` expects. The page "
        "[theory/energy.md](../theory/energy.md), \"Energy created by a term of the balance\", explains how the "
        "created energy is counted.",
        f"{len(found)} of {len(known)} cases; {sum(r.bad for r in found)} succeeded above the limit."
        + (f" Not measured: {', '.join(left)}." if left else ""),
        *(["\n".join(wrong)] if wrong else []),
        table(_COLUMNS, lines),
    ]) + "\n"  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Runs the named cases, or all cases without a stored result, and writes the page."""
    known = plans()
    unknown = [name for name in arguments if name != "write" and name not in [plan.name for plan in known]]
    if unknown:
        print(f"{' '.join(unknown)}: cases are {', '.join(plan.name for plan in known)}")
        return 2
    OUT.mkdir(parents=True, exist_ok=True)
    for plan in known if "write" not in arguments else ():
        file = OUT / f"{plan.name.replace('/', '-')}.json"
        if file.is_file() if not arguments else plan.name not in arguments:
            continue
        row = measured(plan)
        file.write_text(json.dumps(asdict(row), indent=1), encoding="utf-8")
        print(f"{row.case}: {row.state}, {row.line} {row.made:.2g}, {row.cpu:.1f} s {row.message}", flush=True)
    found = list(rows())
    PAGE.write_text(page(found), encoding="utf-8")
    print(f"{PAGE.relative_to(ROOT)}: {len(found)} of {len(known)}, {sum(row.bad for row in found)} above the limit")
    return any(row.bad for row in found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
