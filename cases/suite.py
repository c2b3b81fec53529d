"""The suite of hard cases: the list of its cases, and the check of their runs."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .estimates.estimate import estimate
from .load import shipped
from .model.schema import Case
from .outcome import Outcome

_TABLE = Path(__file__).with_name("hard.toml")
RESIDUAL, DRIFT = 0.01, 1e-9
"""Largest energy residual of a correct run, and largest drift of the momentum divided by the sum of |m v| over the
parts (chosen values). The second value is above rounding errors of single bodies (1e-10), because sums of impulses are
rounded, too."""


@dataclass(frozen=True)
class Hard:
    """A case of the suite."""

    name: str
    rows: tuple[str, ...]
    case: str
    """Name of a shipped case, or of a case file in the folder cases/hard."""
    changes: tuple[str, ...] = ()
    limit: float = RESIDUAL
    """Limit of the energy residual of the case."""
    refused: str = ""
    """Term of the energy ledger that is expected to create more energy than ``run.made_limit`` allows, so that the run
    fails. If ``refused`` is empty, the run must succeed."""

    @property
    def path(self) -> Path:
        """Path of the case file."""
        return shipped().get(self.case, _TABLE.parent / "hard" / f"{self.case}.toml")


def suite() -> list[Hard]:
    """Returns the cases of the suite in the order of the list."""
    listed = tomllib.loads(_TABLE.read_text(encoding="utf-8"))["hard"]
    return [
        Hard(
            e["name"], tuple(e["rows"]), e["case"], tuple(e.get("set", ())), float(e.get("limit", RESIDUAL)),
            e.get("refused", ""),
        )
        for e in listed
    ]  # fmt: skip


def is_free(case: Case) -> bool:
    """Whether no external force acts in the case, so that the momentum, including that of deleted nodes, is
    constant.
    """
    return not case.boundaries


def drift(case: Case, momenta: Sequence[tuple[float, float, float]]) -> float:
    """Largest change of the momentum during the run, divided by the sum of sqrt(2 m E) over the parts (m: mass, E:
    kinetic energy); NaN without motion.
    """
    brought = [part.bulk for part in estimate(case).parts if part.bulk is not None]
    scale = math.fsum(math.sqrt(2.0 * bulk.mass * bulk.energy) for bulk in brought)
    if not momenta or scale == 0.0:
        return math.nan
    return max(math.dist(each, momenta[0]) for each in momenta) / scale


def faults(hard: Hard, outcome: Outcome, drifted: float | None) -> list[str]:
    """Returns one text for each error of a run of the case; empty for a correct run."""
    found = []
    if hard.refused:
        if outcome.cause != "energy" or f"the term {hard.refused} of the energy ledger" not in outcome.message:
            found.append(f"not refused for the energy that {hard.refused} creates: {outcome.state}, {outcome.message}")
    elif outcome.state != "succeeded":
        found.append(f"{outcome.state}: {outcome.message}")
    if not outcome.worst_residual <= hard.limit:
        found.append(f"energy residual {outcome.worst_residual:.2g} above {hard.limit:g}")
    if drifted is not None and not drifted <= DRIFT:
        found.append(f"momentum drift {drifted:.2g} above {DRIFT:g}")
    return found + [f"{check.name} = {check.value:.6g}, expected {check.expected:.6g} +- {check.tolerance:.2g}"
                    for check in outcome.reference if not check.passed]  # fmt: skip
