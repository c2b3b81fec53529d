"""The answer does not depend on the steps at which a broad phase is made, nor on the pairs that it includes in addition
to active contacts.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data
from conoid.worker import simulation, step
from conoid.worker.accounts.digest import digest
from conoid.worker.contact.broad_phase import searches
from conoid.worker.contact.narrow_phase import crack_contact
from conoid.worker.contact.scene import surface_motion
from conoid.worker.contact.surface import exposure
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.simulation import Simulation

from .ranks import on_ranks

SCENES = Path(__file__).parents[1] / "parallel"
STEPS = {"breaking": 54, "eroding": 100, "colliding": 120}
CRUSHED = "../../cases/hard/crush_cohesive"


def stepping(name: str, steps: int, comm: Comm, every: int = 0, *changes: str) -> Iterator[Simulation]:
    """Yields a scene after each of its first ``steps``; ``every``: number of steps after which a broad phase is made at
    the latest.
    """
    case = parse_case(apply_overrides(read_data(SCENES / f"{name}.toml"), ["run.frames=0", *changes]))
    sim = simulation.build(case, Path(), comm)
    assert sim.contact is not None
    step.prepare(sim)
    for number in range(steps):
        sim.contact.searches.due |= every > 0 and number % every == 0
        step.first_half(sim)
        step.second_half(sim)
        yield sim
    sim.free()


def ran(name: str, comm: Comm, every: int = 0, *changes: str) -> tuple[str | None, int]:
    """Returns the digest and the number of broad phases at the end of the run."""
    *_, sim = stepping(name, STEPS[name], comm, every, *changes)
    assert sim.contact is not None
    return digest(sim.model, comm, []), sim.contact.searches.many


@cache
def alone(name: str) -> tuple[str | None, int]:
    """Returns the result of a run on one rank."""
    return ran(name, SerialComm())


@pytest.mark.parametrize("name", STEPS)
@pytest.mark.parametrize("skin", [0.05, 0.15, 0.39, 0.401, 0.8])
def test_no_answer_depends_on_the_skin(name: str, skin: float) -> None:
    assert ran(name, SerialComm(), 0, f"contact.skin={skin}")[0] == alone(name)[0]


@pytest.mark.parametrize("name", STEPS)
def test_no_answer_depends_on_how_often_is_searched(name: str) -> None:
    one, many = alone(name)
    for every in (1, 7):
        other, more = ran(name, SerialComm(), every)
        assert other == one
        assert more > many


def doubled(sim: Simulation) -> int:
    """Returns the number of candidate pairs of a rank that are in its tables more than once."""
    assert sim.contact is not None
    scene = sim.contact.searches.scene
    assert scene is not None
    every = scene.node_face.rows, np.sort(scene.edge_edge.rows, axis=1)
    return sum(len(rows) - len(np.unique(rows, axis=0)) for rows in every)


@pytest.mark.parametrize("ranks", [1, 3])
def test_no_pair_is_listed_twice(ranks: int) -> None:
    """A pair listed twice would have two impulses until the next broad phase. In an earlier version edges of opposite
    direction between two separated nodes were listed twice.
    """
    found = on_ranks(ranks, lambda comm: [doubled(sim) for sim in stepping(CRUSHED, 40, comm)])
    assert found == [[0] * 40] * ranks


@pytest.mark.parametrize("foreseen", [0.0, 0.9])
def test_no_answer_depends_on_which_cracks_a_search_foresees(monkeypatch: pytest.MonkeyPatch, foreseen: float) -> None:
    one = alone("breaking")[0]
    monkeypatch.setattr(crack_contact, "_FORESEEN", foreseen)
    assert ran("breaking", SerialComm())[0] == one


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("share", [0.0, 0.9, 2.0])
def test_no_answer_depends_on_which_tets_a_search_expects_to_leave(
    monkeypatch: pytest.MonkeyPatch, ranks: int, share: float
) -> None:
    """The broad phase includes the inner faces of all tets, of few tets or of no tet. Faces that are exposed by an
    unexpected erosion of a tet are added by another broad phase.
    """
    usual, many = exposure.NEAR_EROSION, on_ranks(ranks, lambda comm: ran("eroding", comm))[0][1]
    monkeypatch.setattr(exposure, "NEAR_EROSION", share)
    other, more = on_ranks(ranks, lambda comm: ran("eroding", comm))[0]
    assert other == alone("eroding")[0]
    assert (more > many) == (share > usual)


@pytest.mark.parametrize("name", STEPS)
def test_no_answer_depends_on_the_horizon(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    one = alone(name)[0]
    monkeypatch.setattr(surface_motion, "_HORIZONS", surface_motion._HORIZONS[:1])
    assert ran(name, SerialComm())[0] == one


@pytest.mark.parametrize(("ranks", "changes"), [(2, ("contact.skin=0.15",)), (3, ("contact.domain=box",))])
def test_no_answer_on_several_ranks_depends_on_the_skin_or_the_domain(ranks: int, changes: tuple[str, ...]) -> None:
    """Every rank makes a broad phase if one of them must; the ghosts depend on the skin and the contact domain."""
    one = alone("breaking")[0]
    assert on_ranks(ranks, lambda comm: ran("breaking", comm, 5, *changes))[0][0] == one


def test_a_horizon_ends_with_one_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the end of a horizon there is one broad phase, and not a second one one or two steps later."""
    monkeypatch.setattr(surface_motion, "_HORIZONS", surface_motion._HORIZONS[:1])
    good_for = surface_motion._HORIZONS[0] - searches._AHEAD
    assert ran("colliding", SerialComm())[1] <= 1 + STEPS["colliding"] / good_for
