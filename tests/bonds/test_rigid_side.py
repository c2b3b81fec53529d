"""Tied bonds with a rigid part: the nodes of the other part follow the motion of the rigid part, and their impulses
move the rigid part.
"""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases import load
from conoid.worker import simulation, step
from conoid.worker.accounts import digest
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..contact.ranks import on_ranks
from ..worker.simulations import kept_again, tick
from .scenes import BOND, area, block, built, moved, run, start

SPIN = "spin = { centre = [0, 0, 0], rate = [2000, -3000, 5000] }"
LAW = 'strength = "50 MPa"\nshear_strength = "70 MPa"\nenergy = "2 kJ/m^2"\nshear_energy = "4 kJ/m^2"\n'
DRIVE = '\n[[boundaries]]\nkind = "velocity"\nparts = ["below"]\nx = {}\ny = {}\nz = {}\n'


def pair(end: float, below: str, above: str = "", sizes: tuple[float, float] = (2.0, 1.3)) -> str:
    """A rigid block below z = 0, and a block of steel above it, bonded."""
    lower = block("below", (0, 0, -4), (6, 6, 0), sizes[0], f"rigid = true\n{below}")
    return start(end, 0.3) + lower + block("above", (0, 0, 0), (6, 6, 3), sizes[1], above) + BOND


def gap(sim: Simulation) -> float:
    """Largest distance of a tied node from its point of the rigid body, m."""
    assert sim.bonds is not None
    assert sim.rigid is not None
    rows, bodies, nodes = sim.bonds.ties.rows, sim.rigid.bodies, sim.model.nodes
    points = sim.rigid.points(rows.row, rows.master, rows.weight, nodes.id, sim.comm)
    arm = (bodies.rotation[points.body] @ points.arm[:, :, None])[:, :, 0]
    return float(np.abs(nodes.x[nodes.places(rows.node)] - bodies.centre[points.body] - arm).max())


@pytest.mark.parametrize("sizes", [(2.0, 1.3), (1.3, 2.0)])
def test_a_tumbling_body_keeps_energy_and_momenta_and_holds_its_nodes(sizes: tuple[float, float]) -> None:
    """The rigid part is the mortar side, also if its faces are smaller than those of the other part."""
    sim = built('contact = "none"\n' + pair(20e-6, SPIN, SPIN, sizes))
    momenta = list[np.ndarray]()
    step.prepare(sim)
    while not sim.clock.done:
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        end = sim.ledger.close(before)
        momenta.append(np.concatenate([sim.ledger.momentum, sim.ledger.angular_momentum]))
        step.second_half(sim)
    linear, angular = np.split(np.array(momenta), 2, axis=1)
    assert np.abs(linear - linear[0]).max() < 1e-13 * np.abs(linear[0]).max()
    assert np.abs(angular - angular[0]).max() < 1e-8 * np.abs(angular[0]).max()
    assert abs(end.fracture) < 1e-7 * end.kinetic
    assert end.residual < 1e-6
    assert gap(sim) < 1e-9


def of_above(drive: str) -> str:
    """Drives only nodes of the upper part."""
    return drive.replace('kind = "velocity"', 'kind = "velocity"\nparts = ["above"]')


def bar(end: float, below: str, drives: str) -> Simulation:
    """A bar of steel on a rigid foot, or without a foot, after its run."""
    text = start(end) + below + block("above", (0, 0, 0), (3, 3, 12), 1) + drives
    sim = built(text)
    run(sim)
    return sim


@pytest.mark.parametrize("wall", [False, True])
def test_a_rigid_foot_is_a_clamp(wall: bool) -> None:
    """A foot that is driven, and a free foot that a wall stops while the bar presses the foot, act like prescribed
    nodes.
    """
    top = of_above(moved(11.9e-3, 1, (0.0, 0.0, -20.0)))
    clamp = moved(-1, 0.1e-3, (0.0, 0.0, 0.0))
    foot = block("below", (-1, -1, -2), (4, 4, 0), 1, "rigid = true") + BOND
    stop = '\n[[boundaries]]\nkind = "wall"\npoint = [0, 0, -2e-3]\nnormal = [0, 0, 1]\nparts = ["below"]\n'
    hold = stop if wall else DRIVE.format(0.0, 0.0, 0.0)
    held, tied = bar(8e-6, "", top + clamp), bar(8e-6, foot, top + hold)
    x = tied.model.nodes.x[tied.model.nodes.part == 1]
    moved_by = np.abs(held.model.nodes.x - held.model.nodes.x0).max()
    assert np.abs(x - held.model.nodes.x).max() < 1e-4 * moved_by


@pytest.mark.parametrize(("way", "energy"), [((0.0, 0.0, -5.0), 2000.0), ((5.0, 0.0, 0.0), 4000.0)])
def test_a_rigid_part_that_is_torn_off_takes_the_energy_of_the_bond(
    way: tuple[float, float, float], energy: float
) -> None:
    """The absorbed energy is G A within 2 %."""
    sim = built(pair(40e-6, "") + LAW + of_above(moved(2.9e-3, 1, (0.0, 0.0, 0.0))) + DRIVE.format(*way))
    spent = area(sim) * energy
    end = run(sim)
    assert sim.bonds is not None
    assert sim.bonds.tied == 0
    assert end.fracture == pytest.approx(spent, rel=0.02)
    assert end.residual < 1e-4


STRUCK = (
    pair(1e-5, "velocity = [3, 0, -35]\n" + SPIN, "velocity = [3, 0, -35]\n" + SPIN)
    + LAW
    + '\n[[boundaries]]\nkind = "wall"\npoint = [0, 0, -4.01e-3]\nnormal = [0, 0.1, 1]\nfriction = 0.3\n[contact]\n'
)


def ended(sim: Simulation, many: int) -> tuple[str | None, int]:
    for _ in range(many):
        tick(sim)
    assert sim.bonds is not None
    assert sim.rigid is not None
    return digest.digest(sim.model, sim.comm, [], sim.rigid.words()), sim.bonds.tied


def test_a_bond_that_breaks_at_an_impact_gives_one_answer(tmp_path: Path) -> None:
    """The result is the same on 1, 2, 3 and 7 ranks, and from a checkpoint; the body slides along the wall while the
    bond breaks."""
    case = load.parse_toml(STRUCK)

    def stepped(sim: Simulation, many: int = 120) -> tuple[str | None, int]:
        step.prepare(sim)
        return ended(sim, many)

    def halves(sim: Simulation) -> tuple[str | None, int]:
        stepped(sim, 60)
        return ended(kept_again(sim, case, tmp_path), 60)

    alone = stepped(simulation.build(case, Path(), SerialComm()))
    assert 0 < alone[1] < 36
    for ranks in (2, 3, 7):
        assert on_ranks(ranks, lambda comm: stepped(simulation.build(case, Path(), comm)))[0] == alone
    assert on_ranks(2, lambda comm: halves(simulation.build(case, Path(), comm)))[0] == alone
