"""Speed against error: the Taylor bars with several mesh sizes, pressure forms and safety factors of the time step."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from conoid.cases.outcome import Check, from_json
from conoid.cases.output import layout

from .scene import FORMS, Form, Generator
from .table import Cell, table

BARS = ("taylor_copper", "taylor_42crmo4")
_PROBE = 0.7
"""Element size in mm above which no tet has its centre in the probes of the steel bar; on coarser meshes the boxes
of the probes are enlarged."""


@dataclass(frozen=True)
class Plan:
    """One run of a bar; ``size``: element size, mm."""

    bar: str
    size: float
    form: Form
    safety: float = 0.9
    generator: Generator = "structured"
    viscosity: bool = True

    def overrides(self) -> list[str]:
        """Returns the assignments for the command line of the worker."""
        more = [] if self.viscosity else ['numerics.viscosity="none"']
        if self.bar == "taylor_42crmo4" and self.size > _PROBE:
            more += [f"probes[{i}].high={[f'{0.85 * self.size:.3g} mm'] * 3}" for i in range(2)]
        return [
            f"parts[0].mesh.element_size={self.size:g} mm", f"parts[0].mesh.generator={self.generator}",
            f"numerics.pressure={self.form}", f"numerics.dt_safety={self.safety:g}", "run.frames=0",
            "run.max_steps=500000", *more,
        ]  # fmt: skip


@dataclass(frozen=True)
class Answer:
    """Result of a run with the wall time and the CPU time of the step loop, s."""

    plan: Plan
    tets: int
    steps: int
    wall: float
    cpu: float
    residual: float
    checks: tuple[Check, ...]
    problem: str = ""
    """Reason of an early end of the run; empty if the run reached its end time."""

    def value(self, quantity: str) -> float:
        """Returns a measured quantity by the first word of its name; NaN if the run ended before the measurement."""
        return next((check.value for check in self.checks if check.name.startswith(quantity)), float("nan"))


def grid(sizes: Iterable[float], safeties: Iterable[float], forms: Iterable[Form] = FORMS) -> list[Plan]:
    """Returns the plans of both bars with all combinations of mesh, pressure form and safety factor, the most expensive
    plan first.
    """
    plans = [Plan(bar, size, form, safety) for bar, size, form, safety in product(BARS, sizes, forms, safeties)]
    return sorted(plans, key=lambda plan: plan.size)


def variants(size: float) -> list[Plan]:
    """Returns the plans of the bars with another kind of mesh, and without viscosity."""
    averaged: tuple[Form, ...] = ("nodal", "split")
    others = [Plan(bar, size, form, generator="gmsh") for bar, form in product(BARS, averaged)]
    return others + [Plan(bar, size, form, viscosity=False) for bar, form in product(BARS, averaged)]


def measure(plans: Sequence[Plan]) -> list[Answer]:
    """Runs every plan by the command line of the worker; each run has one rank. The number of plans that run at the
    same time is the number of cores."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return sorted(pool.map(_run, plans), key=lambda a: (a.plan.bar, FORMS.index(a.plan.form), -a.plan.size))


def _run(plan: Plan) -> Answer:
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as out:
        command = [sys.executable, "-m", "conoid.worker", plan.bar, "--out", out]
        command += [word for override in plan.overrides() for word in ("--set", override)]
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=7200)
        outcome = from_json((Path(out) / layout.OUTCOME).read_bytes())
    return Answer(
        plan, outcome.elements or 0, outcome.steps or 0, outcome.elapsed - outcome.setup, outcome.cpu,
        outcome.worst_residual, tuple(outcome.reference), outcome.message,
    )  # fmt: skip


def report(answers: Sequence[Answer]) -> str:
    """Returns one table for each bar with the cost and the error of each reference quantity."""
    return "\n\n".join(_bar(bar, [a for a in answers if a.plan.bar == bar]) for bar in BARS)


def _bar(bar: str, answers: Sequence[Answer]) -> str:
    expected = next((a.checks for a in answers if a.checks), ())
    quantities = [check for check in expected if check.name != "worst_residual"]
    head = [
        "pressure",
        "mm",
        "tets",
        "dt safety",
        "variant",
        "steps",
        "wall s",
        "CPU s",
        "M upd/s",
        *map(_title, quantities),
        "residual",
    ]
    rows = [_cost(a) + [_measured(a, check) for check in quantities] + [a.residual] for a in answers]
    wanted = ", ".join(f"{_title(c)} {_shown(c, c.expected)} +- {_shown(c, c.tolerance)}" for c in quantities)
    return f"{bar}: {wanted}; in brackets the error in %, ! outside the tolerance.\n\n{table(head, rows)}"


def _cost(a: Answer) -> list[Cell]:
    kind = " ".join((["gmsh"] if a.plan.generator == "gmsh" else []) + ([] if a.plan.viscosity else ["no viscosity"]))
    speed = f"{a.tets * a.steps / a.cpu * 1e-6:.1f}"
    return [
        a.plan.form, a.plan.size, a.tets, a.plan.safety, a.problem or kind, a.steps, round(a.wall, 1), round(a.cpu, 1),
        speed,
    ]  # fmt: skip


def _title(check: Check) -> str:
    words = check.name.split()
    if words[0].startswith("probe"):
        return words[-1].replace("_", " ")
    return {"extent": "length mm", "radius": "radius mm", "plastic_strain_max": "largest strain"}[words[0]]


def _shown(check: Check, value: float) -> str:
    if check.name.startswith(("extent", "radius")):
        return f"{1000 * value:.3f}"
    return f"{value:.0f}" if check.expected > 100 else f"{value:.2f}"


def _measured(answer: Answer, wanted: Check) -> str:
    found = next((check for check in answer.checks if check.name == wanted.name), None)
    if found is None:
        return "-"
    error = 100 * (found.value / found.expected - 1)
    return f"{_shown(found, found.value)} ({error:+.1f}){'' if found.passed else ' !'}"


def as_data(answers: Sequence[Answer]) -> list[dict[str, object]]:
    """Returns the results as data for JSON."""
    import msgspec

    return [json.loads(msgspec.json.encode(answer)) for answer in answers]
