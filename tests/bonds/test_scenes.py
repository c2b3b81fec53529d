"""Tied bonds in minimal cases: no contact, an interface that erodes completely, two different velocities at the
start.
"""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases import load
from conoid.worker.errors import InputError
from conoid.worker.scene.assembly import assemble

from .scenes import BOND, block, built, moved, run, start

DRIVEN = moved(0.9e-3, 1.1e-3, (0.0, 0.0, 50.0))
HELD = moved(-1.1e-3, -0.9e-3, (0.0, 0.0, 0.0))


def joint(more: str = "", below: str = "") -> str:
    """Returns two bonded blocks of a cubic millimetre."""
    lower, upper = block("below", (0, 0, -1), (1, 1, 0), 1, below), block("above", (0, 0, 0), (1, 1, 1), 0.5)
    return start(2e-6) + lower + upper + BOND + more


def test_bonds_need_no_contact() -> None:
    met, free = built(joint(DRIVEN)), built('contact = "none"\n' + joint(DRIVEN))
    for sim in (met, free):
        run(sim)
    assert free.contact is None
    assert np.ptp(free.model.nodes.v[:, 2]) > 10.0
    np.testing.assert_array_equal(free.model.nodes.x, met.model.nodes.x)


def test_an_interface_that_has_eroded_ties_nothing() -> None:
    soft = 'strength = { model = "linear_hardening", yield_stress = 1e6 }\n[numerics]'
    sim = built(joint(DRIVEN + HELD, "erosion = { plastic_strain = 0.001 }").replace("[numerics]", soft))
    assert sim.bonds is not None
    assert sim.bonds.tied == 9
    energy = run(sim)
    assert (sim.model.elements_global, sim.bonds.tied) == (48, 0)
    assert abs(energy.residual) < 1e-3


@pytest.mark.parametrize(("velocity", "warned"), [("velocity = [0, 0, 3]", 1), ("", 0)])
def test_bonded_parts_of_two_velocities_are_reported(velocity: str, warned: int) -> None:
    found = assemble(load.parse_toml(joint(below=velocity)), Path()).warnings
    assert (
        sum(
            "'below' and 'above' start with different velocities at their bond; the difference is up to 3" in w
            for w in found
        )
        == warned
    )


@pytest.mark.parametrize("third", ["shared", "tied", ""])
def test_three_parts_of_one_body_have_a_bond_at_each_interface(third: str) -> None:
    """Without a bond two of the parts would separate at their interface, without contact."""
    corners = {"a": ((0, 0, 0), (2, 1, 1)), "b": ((0, 0, 1), (1, 1, 2)), "c": ((1, 0, 1), (2, 1, 2))}
    blocks = "".join(block(name, *both, 0.5) for name, both in corners.items())
    bonds = [("a", "b", "shared"), ("b", "c", "shared"), *([("a", "c", third)] if third else [])]
    made = "".join(f'\n[[bond]]\nparts = ["{i}", "{j}"]\nkind = "{kind}"\n' for i, j, kind in bonds)
    case = load.parse_toml(start(1e-7) + blocks + made)
    if third:
        assemble(case, Path())
    else:
        with pytest.raises(InputError, match="'a' and 'c' have faces of one body in common and no bond; give them"):
            assemble(case, Path())


@pytest.mark.parametrize("sizes", [(0.5, 0.4, 0.3), (0.5, 0.33, 0.25)])
def test_three_parts_tied_in_a_ring_lose_no_energy(sizes: tuple[float, float, float]) -> None:
    """A node on the common line has one row, because two rows would be nearly linearly dependent."""
    corners = {"a": ((0, 0, 0), (2, 1, 1)), "b": ((0, 0, 1), (1, 1, 2)), "c": ((1, 0, 1), (2, 1, 2))}
    blocks = "".join(block(name, *both, size) for (name, both), size in zip(corners.items(), sizes, strict=True))
    bonds = "".join(f'\n[[bond]]\nparts = ["{i}", "{j}"]\nkind = "tied"\n' for i, j in ("ab", "ac", "bc"))
    pull = '\n[[boundaries]]\nkind = "traction"\nparts = ["b", "c"]\nlow = [-1, -1, 1.99e-3]\nhigh = [1, 1, 2.01e-3]\n'
    sim = built(start(3e-6) + blocks + bonds + pull + "stress = [1e7, 0, 1e8]\n" + moved(-1e-5, 1e-5, (0.0, 0.0, 0.0)))
    assert sim.bonds is not None
    held = sim.bonds.ties.rows.node
    assert len(held) > len(np.unique(held)), "nodes of the line are tied in two bonds"
    energy = run(sim)
    assert abs(energy.fracture) < 1e-9 * energy.external
    assert abs(energy.residual) < 1e-5
    corner = np.flatnonzero(np.abs(sim.model.nodes.x0 - [1e-3, 0.0, 1e-3]).max(axis=1) < 1e-9)
    assert len(corner) == 3
    assert np.ptp(sim.model.nodes.v[corner], axis=0).max() < 0.05 * np.abs(sim.model.nodes.v[corner]).max()


def test_a_part_that_fractures_beside_a_bond_keeps_the_momentum() -> None:
    """A tied node loses mass to copies that have no face of the interface; the impulses of the bond act on the mass
    that the node has left.
    """
    brittle = "density = 7850\nbrittle = { strength = 150e6, energy = 200 }\n"
    above = block("above", (0.5, 0.5, 0), (4.5, 4.5, 4), 1, "velocity = [0, 0, -30]\nfracture = { model = 'cohesive' }")
    text = start(4e-6, 0.3).replace("density = 7850\n", brittle) + block("below", (0, 0, -4), (5, 5, 0), 1.3)
    sim = built(text + "[contact]\n" + above + BOND)
    momenta: list[np.ndarray] = []

    def look() -> None:
        sim.ledger.close(sim.model.nodes.v)
        momenta.append(np.array(sim.ledger.momentum))

    run(sim, look)
    assert sim.fracture is not None
    assert sim.model.nodes_global > 300
    assert np.abs(np.array(momenta) - momenta[0]).max() < 1e-13 * np.abs(momenta[0]).max()
