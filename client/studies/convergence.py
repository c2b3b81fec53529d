"""Execution of a convergence study: each point is a run on a server, several at a time; the results are sorted by
quantity.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

from conoid.cases.load import apply_overrides, parse_case
from conoid.cases.model.schema import Case
from conoid.cases.run import State

from ..errors import ClientError
from ..remote.session import Session
from ..run import Run
from .quantities import Number, of_run
from .richardson import Limit, Trend, limit
from .scatter import Sample, differ
from .variants import Plan, Point, Variant


@dataclass(frozen=True)
class Done:
    """A finished run of the study."""

    point: Point
    run: str
    tets: int = 0
    steps: int = 0
    cpu: float = 0.0
    """CPU time of all ranks in the time steps, s."""
    numbers: tuple[Number, ...] = ()
    problem: str = ""
    """Reason why the run failed; empty for a successful run."""


@dataclass(frozen=True)
class Mesh:
    """All members of the ensemble of a variant on one mesh."""

    factor: float
    tets: int
    size: float
    """Representative element size relative to the case: (tets of the case / tets)^(1/3)."""
    steps: float
    cpu: float
    """CPU time of one run, s, as a mean over the members of the ensemble."""
    samples: Mapping[str, Sample]


@dataclass(frozen=True)
class Series:
    """A variant on all its meshes, the finest mesh first, and the limit of each quantity."""

    variant: Variant
    meshes: Sequence[Mesh]
    limits: Mapping[str, Limit]


def run_all(session: Session, data: Mapping[str, Any], plan: Plan, folder: Path) -> Iterator[Done]:
    """Submits the runs of all points, and yields each run after its end, in the order of the points.

    A point that the same server has computed before is not computed again. Relative paths of files are relative to
    ``folder``. Raises CaseError, before any run is submitted, if a point is not a valid case.
    """
    points = plan.points(parse_case(data))
    cases = [apply_overrides(data, point.changes) for point in points]
    for each in cases:
        parse_case(each)
    ready = [session.outbox.ready(each, folder) for each in cases]
    runs = [session.submit(each, key=_key(each), folder=folder) for each in ready]
    try:
        for point, each, run in zip(points, cases, runs, strict=True):
            yield _ended(point, parse_case(each), run)
    except BaseException:
        for run in runs:
            run.cancel()
        raise


def _key(case: Mapping[str, Any]) -> str:
    """Returns the idempotency key of a point. Equal cases and versions give equal keys, so that an interrupted study
    continues.
    """
    text = json.dumps([metadata.version("conoid"), case], sort_keys=True, default=str)
    return f"converge-{hashlib.sha256(text.encode()).hexdigest()[:40]}"


def _ended(point: Point, case: Case, run: Run) -> Done:
    info = run.wait()
    outcome = info.outcome
    if outcome is None or info.state is not State.SUCCEEDED:
        return Done(point, run.id, problem=f"{info.state.value}: {info.message or info.cause}")
    numbers = of_run(case, outcome, run.result().history)
    return Done(point, run.id, outcome.elements or 0, outcome.steps or 0, outcome.cpu, tuple(numbers))


def series(done: Sequence[Done]) -> list[Series]:
    """Sorts the runs by variant and mesh. Raises ClientError if no run has succeeded."""
    good = [each for each in done if not each.problem]
    if not good:
        raise ClientError(
            f"no run has succeeded; problem of the first run: {done[0].problem if done else 'there is none'}"
        )
    own = min(good, key=lambda each: abs(each.point.factor - 1.0))
    known = {number.name: number for each in good for number in each.numbers}
    variants = dict.fromkeys(each.point.variant for each in done)
    return [_series(variant, [g for g in good if g.point.variant == variant], own, known) for variant in variants]


def _series(variant: Variant, done: Sequence[Done], own: Done, known: Mapping[str, Number]) -> Series:
    factors = sorted({each.point.factor for each in done})
    meshes = [_mesh(factor, [each for each in done if each.point.factor == factor], own) for factor in factors]
    return Series(variant, meshes, {name: _limit(name, meshes, number.floor) for name, number in known.items()})


def _mesh(factor: float, members: Sequence[Done], own: Done) -> Mesh:
    first = members[0]
    values = [{number.name: number.value for number in each.numbers} for each in members]
    common = [name for name in values[0] if all(name in each for each in values)]
    n = len(members)
    return Mesh(
        factor, first.tets, own.point.factor * (own.tets / first.tets) ** (1.0 / 3.0),
        sum(each.steps for each in members) / n, sum(each.cpu for each in members) / n,
        {name: Sample(tuple(each[name] for each in values)) for name in common},
    )  # fmt: skip


def _limit(name: str, meshes: Sequence[Mesh], floor: float) -> Limit:
    """Returns the limit of the means of a quantity. The trend is SCATTERS, without an order, if the scatter is
    larger than the differences between the meshes.
    """
    there = [mesh for mesh in meshes if name in mesh.samples]
    samples = [mesh.samples[name] for mesh in there]
    found = limit([mesh.size for mesh in there], [sample.mean for sample in samples], floor)
    if found.trend is Trend.UNKNOWN or not any(sample.error for sample in samples):
        return found
    if found.trend is not Trend.SETTLED and not any(differ(samples[0], other) for other in samples[1:]):
        return Limit(Trend.SCATTERS, samples[0].mean, 2.0 * samples[0].error)
    return replace(found, uncertainty=found.uncertainty + 2.0 * samples[0].error)
