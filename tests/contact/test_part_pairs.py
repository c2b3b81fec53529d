"""Quantum of the impulses of contact: set by the lighter of two parts in contact, independent of all other parts."""

import numpy as np
import pytest

from conoid.worker.contact.part_pairs import lighter
from conoid.worker.parallel.comm import SerialComm

from ..worker.kernels import build, run
from ..worker.meshes import Floats, block
from .bodies import meeting_of, moved

SMALL, SPEED = block((2, 2, 2), 0.5e-3), -50.0
ABOVE = moved(SMALL, (0.13e-3, 0.07e-3, 1.01e-3))


def losses(size: float, away: float, hit: bool) -> Floats:
    """Returns (3,) kinetic energy, energy taken by contact, and energy taken by viscosity, of a block that falls onto
    another block. With ``hit`` the block falls onto a cube of six tets of the given ``size``, m; else the cube is
    ``away`` below both blocks, m.
    """
    top = 1e-3 if hit else -away
    cube = moved(block((1, 1, 1), size), (-0.4 * size, -0.4 * size, top - size))
    meshes = [ABOVE, cube] if hit else [ABOVE, SMALL, cube]
    motions = [{"velocity": (0.0, 0.0, SPEED)}, *[{}] * (len(meshes) - 1)]
    case = meeting_of(motions, {}, end=1e-6, viscosity={})
    seen: list[Floats] = []

    def watch(sim, before):  # type: ignore[no-untyped-def]
        energy = sim.ledger.close(before)
        seen.append(np.array([energy.kinetic, energy.contact, energy.viscous]))

    run(build(case, meshes), watch)
    return seen[-1]


def test_a_huge_body_elsewhere_does_not_change_an_impact() -> None:
    near, far = (losses(size, 0.2, hit=False) for size in (1e-3, 10.0))
    assert near[1] > 0.01 * near[0]
    assert far == pytest.approx(near, rel=1e-9)


def test_a_huge_body_is_hit_as_a_large_one() -> None:
    large, huge = (losses(size, 0.0, hit=True) for size in (0.3, 30.0))
    assert large[1] > 0.01 * large[0]
    assert huge == pytest.approx(large, rel=1e-6)


def test_the_lighter_of_two_parts_in_contact_counts() -> None:
    """Parts 0 and 1 are in contact with each other, part 2 with itself, and part 3 with no part; held nodes transmit
    any impulse.
    """
    sizes = enumerate((1.0, 3.0, 2.0, 9.0))
    sim = build(meeting_of([{}] * 4), [moved(block((1, 1, 1), size), (20.0 * k, 0.0, 0.0)) for k, size in sizes])
    nodes = sim.model.nodes
    most = [float(nodes.mass[nodes.part == k].max()) for k in range(4)]
    mu = np.full((4, 4), np.nan)
    free = np.ones((nodes.n, 3))
    assert lighter(mu, nodes, free, SerialComm()) == 0.0
    mu[0, 1] = mu[1, 0] = 0.0
    assert lighter(mu, nodes, free, SerialComm()) == most[0]
    held = free.copy()
    held[np.flatnonzero(nodes.part == 0)[0], 2] = 0.0
    assert lighter(mu, nodes, held, SerialComm()) == most[1]
    held[nodes.part == 1] = 0.0
    assert lighter(mu, nodes, held, SerialComm()) == most[1]
    mu[2, 2] = 0.0
    assert lighter(mu, nodes, free, SerialComm()) == most[2]
