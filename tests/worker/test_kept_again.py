"""A run is stored and restored twice: every line of its history is that of the uninterrupted run. Between the two
restarts the run makes no step or some steps; the schedule and the halo of its searches may differ after a restart.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data, resolved_json
from conoid.cases.messages import Energy
from conoid.cases.model import schema
from conoid.cases.output.checkpoints import FORMAT, Manifest
from conoid.worker import simulation, step
from conoid.worker.accounts.digest import digest
from conoid.worker.errors import InputError
from conoid.worker.migration import checkpoint
from conoid.worker.parallel.comm import Comm

from ..contact.ranks import on_ranks
from .simulations import kept_again

BREAKING = Path(__file__).parents[1] / "parallel" / "breaking.toml"
STEPS = 32
"""Number of steps before the run is stored; the scene has 54 steps. Contact has taken energy, facets have broken, and
cohesive facets carry traction before the run is stored."""
OTHER = ("contact.skin=0.08", "contact.domain=box")


class Course(NamedTuple):
    """History of a run."""

    lines: list[Energy]
    """Lines of the energy balance, one for each step."""
    impulses: list[float]
    """Impulses of contact on each part, N s."""
    digest: str | None
    broken: tuple[int, float]


def case_of(*changes: str) -> schema.Case:
    return parse_case(apply_overrides(read_data(BREAKING), ["balance.weights=tets", *changes]))


def course(comm: Comm, folder: Path, cases: Sequence[schema.Case], stops: Sequence[int]) -> Course:
    """Returns the history of a run on one rank that is stored and restored before each of the ``stops``, with the next
    case of ``cases``."""
    sim, lines = simulation.build(cases[0], Path(), comm), list[Energy]()
    step.prepare(sim)
    for number in range(STEPS):
        for k in (k for k, stop in enumerate(stops) if stop == number):
            sim = kept_again(sim, cases[(k + 1) % len(cases)], folder)
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        lines.append(sim.ledger.close(before))
        step.second_half(sim)
    assert sim.contact is not None
    assert sim.fracture is not None
    broken = sim.fracture.broken, sim.fracture.first
    found = Course(lines, sim.contact.impulses().reshape(-1).tolist(), digest(sim.model, comm, []), broken)
    sim.free()
    return found


@pytest.fixture(scope="module")
def whole() -> Course:
    (found,) = on_ranks(1, lambda comm: course(comm, Path(), [case_of()], []))
    last = found.lines[-1]
    assert min(last.contact, last.friction, last.cohesive, *found.broken) > 0
    return found


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("stops", [(9, 9), (8, 20, 21)], ids=str)
@pytest.mark.parametrize("changes", [(), OTHER], ids=["as it is", "other searches"])
def test_a_run_saved_and_restored_repeatedly_is_the_same_run(
    changes: tuple[str, ...], stops: tuple[int, ...], ranks: int, whole: Course, tmp_path: Path
) -> None:  # fmt: skip
    cases = [case_of(), case_of(*changes)]
    for found in on_ranks(ranks, lambda comm: course(comm, tmp_path, cases, stops)):
        assert found == whole._replace(digest=found.digest)
        assert found.digest in (whole.digest, None)


def test_what_the_answer_depends_on_may_not_change() -> None:
    manifest = Manifest(FORMAT, 1, 0.0, json.loads(resolved_json(case_of())), [], {})
    checkpoint.require_same(case_of(*OTHER), manifest)
    with pytest.raises(InputError, match=r"^contact\.friction = 0\.3: the case of the checkpoint has 0\.2"):
        checkpoint.require_same(case_of("contact.friction=0.3"), manifest)
