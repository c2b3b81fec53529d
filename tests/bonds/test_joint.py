"""Tied bodies: waves, energy, momentum; bonds that are torn, and contact after the failure of a bond."""

from typing import Any

import numpy as np
import pytest

from conoid.worker.bonds import law as bond_law
from conoid.worker.bonds.records import DAMAGE, NORMAL, PUSH, TiedRows
from conoid.worker.contact.checks import inside
from conoid.worker.simulation import Simulation

from . import scenes
from .scenes import BOND, SYMMETRY, area, block, built, moved, run, start

PULL = '\n[[boundaries]]\nkind = "traction"\npressure = "-100 MPa"\n' + scenes.EVERYWHERE.format(low=19.9e-3, high=1)
PROBE = """
[[probes]]
name = "stress"
part = "below"
field = "stress_zz"
low = [0, 0, -2e-3]
high = [1, 1, 0]
"""


def pulled(parts: str) -> tuple[np.ndarray, Simulation, float, float]:
    """Returns three results of a bar that is pulled at its upper end: time, s, and stress under the interface, Pa; the
    simulation; at the end the energy residual and the fraction of the external work that the bond has taken.
    """
    sim = built(start(8e-6) + parts + PULL + SYMMETRY + PROBE)
    record = list[tuple[float, float]]()
    end = run(sim, lambda: record.append((sim.clock.t, sim.probes.measure()[0])))
    return np.array(record), sim, end.residual, abs(end.fracture) / end.external


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    return pulled(block("below", (0, 0, -20), (4, 4, 20), 1))[0]


def plateau(record: np.ndarray) -> float:
    return float(record[record[:, 0] > 5.5e-6, 1].mean())


def arrival(record: np.ndarray) -> float:
    """Returns the time at which half of the traction arrives, s."""
    k = int(np.argmax(record[:, 1] > 50e6))
    return float(np.interp(50e6, record[k - 1 : k + 1, 1], record[k - 1 : k + 1, 0]))


def test_a_bar_of_two_like_meshes_is_one_bar(whole: np.ndarray) -> None:
    record, _, residual, taken = pulled(
        block("below", (0, 0, -20), (4, 4, 0), 1) + block("above", (0, 0, 0), (4, 4, 20), 1) + BOND
    )
    np.testing.assert_allclose(record[:, 1], whole[:, 1], rtol=0.0, atol=100.0)  # 1e-6 of the traction
    assert residual < 1e-5
    assert taken < 1e-9


@pytest.mark.parametrize(("below", "above"), [(1.0, 0.77), (0.77, 1.0), (1.0, 0.5)])
def test_a_wave_passes_meshes_that_do_not_match(below: float, above: float, whole: np.ndarray) -> None:
    parts = block("below", (0, 0, -20), (4, 4, 0), below) + block("above", (0, 0, 0), (4, 4, 20), above)
    record, sim, residual, taken = pulled(parts + BOND)
    assert plateau(record) == pytest.approx(plateau(whole), rel=0.01)
    assert arrival(record) == pytest.approx(arrival(whole), rel=0.01)
    assert residual < 1e-5
    assert taken < 1e-9
    assert sim.ledger.momentum[2] == pytest.approx(100e6 * 16e-6 * sim.clock.t, rel=1e-12)


def test_a_spinning_joint_keeps_its_momenta() -> None:
    motion = "velocity = [3, 4, 50]\nspin = { centre = [0, 0, 0], rate = [900, 0, 5000] }"
    parts = [block("below", (0, 0, -4), (4, 4, 0), 2, motion), block("above", (1, 1, 0), (5, 4, 4), 1.3, motion)]
    sim = built(start(30e-6, 0.3) + "[contact]\n" + "".join(parts) + BOND)
    momenta: list[np.ndarray] = []

    def look() -> None:
        if sim.clock.step % 20 == 1:
            sim.ledger.close(sim.model.nodes.v)
            momenta.append(np.concatenate([sim.ledger.momentum, sim.ledger.angular_momentum]))

    end = run(sim, look)
    linear, angular = np.split(np.array(momenta), 2, axis=1)
    assert np.abs(linear - linear[0]).max() < 1e-14 * np.abs(linear[0]).max()
    assert np.abs(angular - angular[0]).max() < 1e-9 * np.abs(angular[0]).max()
    assert abs(end.fracture) < 1e-9 * end.kinetic
    assert end.contact == 0.0, "no contact within the joint"


@pytest.mark.parametrize(
    ("way", "energy"), [((0.0, 0.0, 5.0), 2000.0), ((5.0, 0.0, 0.0), 4000.0), ((3.0, 2.0, 3.6), 2670.0)]
)
def test_a_torn_joint_absorbs_its_energy(way: tuple[float, float, float], energy: float) -> None:
    """In tension, in shear, and in a combination of tension and shear, the absorbed energy is G A within 2 %."""
    law = 'strength = "50 MPa"\nshear_strength = "70 MPa"\nenergy = "2 kJ/m^2"\nshear_energy = "4 kJ/m^2"\n'
    parts = block("below", (0, 0, -4), (8, 8, 0), 2) + block("above", (0, 0, 0), (8, 8, 4), 1.3)
    drives = moved(3.9e-3, 1, way) + moved(-1, -3.9e-3, (0.0, 0.0, 0.0))
    sim = built(start(40e-6) + parts + BOND + law + drives)
    assert area(sim) == pytest.approx(64e-6, rel=1e-12)
    end = run(sim)
    assert sim.bonds is not None
    assert sim.bonds.tied == 0
    assert end.fracture == pytest.approx(energy * 64e-6, rel=0.02)
    assert end.residual < 1e-4


@pytest.mark.parametrize("way", [(0.0, 0.0, 50.0), (50.0, 0.0, 0.0), (30.0, 20.0, 36.0)])
def test_a_joint_that_opens_in_twenty_steps_absorbs_the_energy_of_its_law(
    way: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reference energy is the sum of 2 G(B) (1 - D) dD A over rows and steps, with the fraction B of shear of a row
    in a step. At this speed waves bend the blocks, so that a joint in shear also has tension.
    """
    taken = 0.0
    plain = bond_law.open_bonds

    def opened(rows: TiedRows, *arguments: Any) -> int:
        nonlocal taken
        before = rows.state.copy()
        apart = int(plain(rows, *arguments))
        push, out = before[:, PUSH : PUSH + 3], before[:, NORMAL : NORMAL + 3]
        along = (push * out).sum(axis=1)
        shear, tension = ((push - along[:, None] * out) ** 2).sum(axis=1), np.maximum(along, 0.0) ** 2
        mixed = shear / np.maximum(shear + tension, 1e-300)
        left = (1.0 - before[:, DAMAGE]) ** 2 - (1.0 - rows.state[:, DAMAGE]) ** 2
        taken += float((left * rows.area / ((1.0 - mixed) / 2000.0 + mixed / 4000.0)).sum())
        return apart

    monkeypatch.setattr(bond_law, "open_bonds", opened)
    law = 'strength = "50 MPa"\nshear_strength = "70 MPa"\nenergy = "2 kJ/m^2"\nshear_energy = "4 kJ/m^2"\n'
    parts = block("below", (0, 0, -4), (8, 8, 0), 2) + block("above", (0, 0, 0), (8, 8, 4), 1.3)
    end = run(built(start(8e-6) + parts + BOND + law + moved(3.9e-3, 1, way) + moved(-1, -3.9e-3, (0.0, 0.0, 0.0))))
    assert 1800.0 * 64e-6 < taken < 4000.0 * 64e-6
    assert end.fracture == pytest.approx(taken, rel=0.01)


def test_a_torn_joint_is_in_contact_again() -> None:
    course = 'course = [["0 us", 1], ["6 us", 1], ["8 us", -2]]'
    parts = block("below", (0, 0, -6), (8, 8, 0), 2) + block("above", (0.7, 0.7, 0), (7.3, 7.3, 6), 1.3)
    law = 'strength = "30 MPa"\nenergy = "100 J/m^2"\n'
    drives = moved(5.9e-3, 1, (0.0, 0.0, 5.0), course) + moved(-1, -5.9e-3, (0.0, 0.0, 0.0))
    sim = built(start(16e-6, 0.3) + "[contact]\n" + parts + BOND + law + drives)
    assert sim.contact is not None
    torn: list[tuple[float, float]] = []
    bonds, contact = sim.bonds, sim.contact
    assert bonds is not None

    def look() -> None:
        if sim.clock.step % 10 == 0 and sim.clock.t < 7e-6:
            torn.append((bonds.tied, float(np.abs(contact.impulses()).max())))

    run(sim, look)
    assert torn[0][0] == 36
    assert torn[-1] == (0, 0.0), "torn, and contact has done nothing so far"
    assert contact.impulses()[1, 2] > 0.0
    assert inside.look(contact, sim.model, None, sim.comm).nodes == 0


def test_a_bond_that_breaks_at_once_gives_no_energy_back() -> None:
    parts = block("below", (0, 0, -4), (4, 4, 0), 2) + block("above", (0, 0, 0), (4, 4, 4), 1.3)
    drives = moved(3.9e-3, 1, (1.0, 0.0, 5.0)) + moved(-1, -3.9e-3, (0.0, 0.0, 0.0))
    sim = built(start(10e-6) + parts + BOND + 'strength = "50 MPa"\n' + drives)
    end = run(sim)
    assert sim.bonds is not None
    assert sim.bonds.tied == 0
    assert 0.0 <= end.fracture < 0.2 * end.external
