"""Contact gives back at most the energy that it has taken, for any time step."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data, shipped_path
from conoid.worker import simulation
from conoid.worker.contact.account import Account
from conoid.worker.contact.solver import impulse_work
from conoid.worker.contact.solver.active import PUSH, ActiveNodes, Loaded
from conoid.worker.errors import EnergyError
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.simulation import Simulation

from ..worker.kernels import Floats, build, run
from ..worker.meshes import block
from .bodies import meeting_of, moved
from .ranks import on_ranks

SPHERES = (
    "run.frames=0", "run.end_time=27e-6", "parts[0].mesh.element_size=0.2e-3", "parts[1].mesh.element_size=0.2e-3"
)  # fmt: skip
"""Hertz's spheres, elastic and without viscosity, on a coarse mesh, up to the turning point."""


@pytest.mark.parametrize("safety", [1.0, 0.9, 0.5])
def test_spheres_that_meet_get_no_energy_from_contact(safety: float) -> None:
    """In an earlier version nodes penetrated under a small force and were pushed out under a large force, which added
    9e-4 of the energy.
    """
    data = apply_overrides(read_data(shipped_path("hertz_spheres")), [*SPHERES, f"numerics.dt_safety={safety}"])
    sim, lines = simulation.build(parse_case(data), Path(), SerialComm()), list[float]()

    def watch(sim: Simulation, before: Floats) -> None:
        if sim.clock.step % 5 == 0:
            lines.append(sim.ledger.close(before).contact / sim.ledger.initial)

    run(sim, watch)
    assert sim.ledger.worst < 1e-3
    assert min(lines) > -1e-12
    assert 0.0 < lines[-1] < 5e-3


@pytest.mark.parametrize("mu", [0.1, 0.8])
def test_the_ledger_has_the_same_half_of_friction_and_of_the_normal_impulse(mu: float) -> None:
    """A block slides over another block and is pressed on it. The history line of the first time has half of the work
    of the first impulses, with the initial velocities. The ratio of friction to contact is then mu times the sliding
    speed over the closing speed. After the second half of the last impulses all work is booked.
    """
    size, sliding, closing = 1e-3, 15.0, 5.0
    low, high = block((4, 4, 2), size, seed=1), block((3, 3, 2), size, seed=2)
    case = meeting_of([{}, {"velocity": (sliding, 0.0, -closing)}], {"friction": mu}, end=2e-6)
    sim = build(case, [low, moved(high, (0.5 * size, 0.5 * size, 2.0 * size))])
    lines = []
    run(sim, lambda sim, before: lines.append(sim.ledger.close(before)))
    assert sim.contact is not None
    assert lines[0].friction / lines[0].contact == pytest.approx(mu * sliding / closing, rel=1e-9)
    assert min(line.contact for line in lines) > 0.0
    books = sim.contact.books
    work, later = books.friction.total(SerialComm())
    assert lines[-1].friction == pytest.approx(work - later, rel=1e-12)
    sim.contact.note(sim.model.nodes)
    assert books.friction_work(books.friction.total(SerialComm())) == pytest.approx(work, rel=1e-12)


def test_contact_that_makes_energy_ends_the_run() -> None:
    """The energy from contact is above run.made_limit, relative to the energy that enters."""
    low, high = block((2, 2, 2), 1e-3), block((2, 2, 2), 1e-3)
    case = meeting_of([{}, {"velocity": (0.0, 0.0, -5.0)}], {}, end=1e-7)
    sim = build(case, [low, moved(high, (0.0, 0.0, 2.1e-3))])
    assert sim.contact is not None
    v = sim.model.nodes.v
    sim.ledger.close(v)
    sim.ledger.require(sim.case.run, 0.9, "at the start")
    assert sim.ledger.making.worst == {}
    sim.contact.books.contact_loss[0] = -0.015 * sim.ledger.initial
    sim.ledger.close(v)
    sim.ledger.require(sim.case.run, 0.9, "soon")
    assert sim.ledger.making.worst["contact"].share == pytest.approx(0.015, rel=1e-9)
    assert any("the term contact of the energy ledger has created 0.015" in text for text in sim.ledger.warnings(0.9))
    sim.contact.books.contact_loss[1] = -0.02 * sim.ledger.initial
    sim.ledger.close(v)
    message = (
        r"the term contact of the energy ledger has created 0\.035 of the largest energy, above run\.made_limit 0\.02, "
        r"at the"
    )
    with pytest.raises(EnergyError, match=message):
        sim.ledger.require(sim.case.run, 0.9, "at the end")


def test_the_cost_of_an_impulse_is_the_work_between_two_half_steps() -> None:
    """The first contact and the second contact have nodes of 1 and 3 kg and two nodes of infinite mobility; the second
    contact has no impulse.
    """
    before, v = np.zeros((4, 3)), np.zeros((4, 3))
    before[:2, 0], v[:2, 0] = (2.0, -1.0), (-1.0, 0.0)
    loaded, active, account = Loaded.of(2, 1), ActiveNodes.of(4), Account(1.0)
    loaded.normal[:, :3], loaded.normal[:, PUSH], loaded.many[0] = (-1.0, 0.0, 0.0), (3.0, 0.0), 2
    loaded.tangent[:, :4], loaded.slots[:] = (1.0, -1.0, 0.0, 0.0), [[0, 1, 2, 3], [1, 0, 2, 3]]
    active.moving[:, :3] = v
    impulse_work.cost(account.words, loaded, active, before, np.arange(4, dtype=np.int32), account.scale, 0)
    account.settle(account.words)
    _, taken, early, _ = account.known()
    kinetic = 0.5 * np.array([1.0, 3.0, 0.0, 0.0]) @ (before[:, 0] ** 2 - v[:, 0] ** 2)
    assert taken == pytest.approx(kinetic, rel=1e-12)
    assert early == pytest.approx(-0.5 * 3.0 * 3.0, rel=1e-12)


def booked(account: Account, taken: float, early: float = 0.0) -> None:
    """Adds the energies of a step, J, to the account: ``taken`` and ``early``."""
    account.words[0] += np.rint(np.array([taken, early]) * account.scale).astype(np.int64)


def test_contact_gives_back_no_energy_that_it_has_not_taken() -> None:
    """Contact gives back energy only while the balance of taken energy is at least twice the largest energy given back
    in one step.
    """
    account = Account(1.0)
    assert account.settle(account.words)
    for taken, early, may in (
        (0.25, 0.0, True), (-0.0625, 0.0, True), (-0.09375, 0.0, False), (0.125, 0.0, True), (0.0, 0.125, False),
    ):  # fmt: skip
        booked(account, taken, early)
        assert account.settle(account.words) == may


@pytest.mark.parametrize("ranks", [2, 3])
def test_all_ranks_and_a_restarted_run_decide_equally(ranks: int) -> None:
    def decide(comm: Comm) -> tuple[bool, bool, float]:
        account = Account(1.0)
        booked(account, 1.0 if comm.rank == 0 else -0.03125)
        first = account.settle(comm.sum(account.words))
        other = Account(7.0)
        other.resume(account.words, account.known())
        booked(other, -0.03125)
        return first, other.settle(comm.sum(other.words)), other.known()[1]

    assert on_ranks(ranks, decide) == [(True, True, 1.0 - 0.03125 * (2 * ranks - 1))] * ranks
