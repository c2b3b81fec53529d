"""Bonds that break: energy in tension, shear and mixed mode; bonds of parts that fracture; independence of the domain
decomposition.
"""

from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pytest

from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.simulation import Simulation

from ..worker.joints import joint
from ..worker.kernels import FORMS, Form
from ..worker.simulations import kept_again, on
from .pulled import AREA, BOND, PARTS, drawn


class Ended(NamedTuple):
    """Results of a run."""

    spent: float
    """Energy absorbed by the bond, divided by its area, J/m^2."""
    broken: int
    residual: float
    digest: str | None
    fragments: int
    momentum: tuple[float, ...]


def run(sim: Simulation) -> Ended:
    return _run(sim, lambda sim: sim)


def _run(sim: Simulation, between: Any) -> Ended:
    step.prepare(sim)
    end, residual, half = sim.case.run.end_time, 0.0, True
    while sim.clock.t < end:
        if half and sim.clock.t > 0.5 * end:
            sim, half = between(sim), False
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        energy = sim.ledger.close(before)
        residual = max(residual, energy.residual)
        step.second_half(sim)
    assert sim.record is not None
    assert sim.fracture is not None
    sim.record.update()
    known = digest.digest(sim.model, sim.comm, sim.elements.nodal)
    return Ended(
        (energy.fracture + energy.cohesive) / AREA, sim.fracture.broken, residual, known, sim.record.count,
        tuple(sim.ledger.momentum.tolist()),
    )  # fmt: skip


def test_a_bond_in_tension_absorbs_its_energy() -> None:
    case = joint(("alumina", "steel"), BOND, boundaries=drawn("0 m/s", "2 m/s"), run={"end_time": "3 us"})
    (ended,) = on(1, case, PARTS, run)
    assert ended.spent == pytest.approx(10.0, rel=0.02)
    assert (ended.broken, ended.fragments) == (18, 2)
    assert ended.residual < 1e-4


@pytest.mark.parametrize(("x", "z", "least", "most"), [(1.0, 0.0, 25.0, 25.0), (1.0, 1.0, 10.0, 25.0)])
def test_a_bond_in_mixed_mode_absorbs_energy_by_its_share_of_shear(
    x: float, z: float, least: float, most: float
) -> None:
    """All nodes move along one line, so that no facet rotates and the traction that breaks a facet has one direction.
    The absorbed energy follows from w_n / 10 + w_s / 25 = 1, with the work w_n and w_s in the two modes.
    """
    slide = {"kind": "velocity", "y": 0, "low": [-1, -1, -1], "high": [1, 1, 1]}
    if z == 0.0:
        slide["z"] = 0
    ends = drawn(f"{2.0 * x} m/s", f"{2.0 * z} m/s")
    for end in ends if z == 0.0 else ():
        del end["z"]
    case = joint(("alumina", "steel"), BOND, boundaries=[slide, *ends], run={"end_time": "4 us"})
    ((ended, expected),) = on(1, case, PARTS, _with_shares)
    assert ended.fragments == 2
    assert ended.spent == pytest.approx(expected, rel=0.02)
    assert least * 0.999 <= expected <= most * 1.001


def _with_shares(sim: Simulation) -> tuple[Ended, float]:
    """Returns the results of a run and the mean energy, computed from the tractions that broke the facets."""
    found: list[float] = []
    assert sim.fracture is not None
    insertion = sim.fracture._insertion
    made = insertion.facets

    def noted(breaking: Any, *more: Any) -> Any:
        facets = made(breaking, *more)
        t, x, nodes = breaking.facets.traction[:, :3], sim.model.nodes.x, breaking.facets.nodes
        normal = np.cross(x[nodes[:, 1]] - x[nodes[:, 0]], x[nodes[:, 2]] - x[nodes[:, 0]])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        along = (normal * t).sum(axis=1)
        shear = (2.0 / 3.0) ** 2 * np.maximum((t * t).sum(axis=1) - along**2, 0.0)
        share = shear / (np.maximum(along, 0.0) ** 2 + shear)
        found.extend((facets.constants.area / ((1.0 - share) / 10.0 + share / 25.0)).tolist())
        return facets

    with patch.object(insertion, "facets", noted):
        return run(sim), sum(found) / AREA


@pytest.mark.parametrize("form", FORMS)
def test_ranks_and_a_restart_change_no_bit_where_a_bond_breaks(form: Form, tmp_path: Path) -> None:
    case = joint(
        ("soda_lime", "steel"), {**BOND, "strength": "8 MPa", "shear_strength": "8 MPa"}, numerics={"pressure": form},
        boundaries=drawn("3 m/s", "4 m/s"), run={"end_time": "2 us"}, lower={"fracture": {"model": "cohesive"}},
    )  # fmt: skip
    (one,) = on(1, case, PARTS, run)
    assert one.broken >= 18
    for ranks in (2, 3, 7):
        assert on(ranks, case, PARTS, run)[0] == one
    again = on(2, case, PARTS, lambda sim: _run(sim, lambda sim: kept_again(sim, case, tmp_path)))[0]
    assert again == one


def test_a_bond_without_energy_breaks_at_its_strength_and_one_without_strength_holds() -> None:
    """A bond behaves in the same way if its two parts fracture."""
    keys: dict[str, Any] = {"boundaries": drawn("0 m/s", "2 m/s"), "run": {"end_time": "1.5 us"}}
    (ended,) = on(1, joint(("alumina", "steel"), {"strength": "20 MPa"}, **keys), PARTS, run)
    assert (ended.broken, ended.fragments, ended.spent) == (18, 2, 0.0)
    fracture = {"fracture": {"delay": 0}}
    keys["boundaries"] = drawn("0 m/s", "8 m/s")
    glass = joint(("soda_lime", "soda_lime"), **keys, lower=fracture, upper=fracture)
    ((held, between),) = on(1, glass, PARTS, _torn)
    assert held.broken > 0
    assert between == 0


def _torn(sim: Simulation) -> tuple[Ended, int]:
    """Returns the results of a run and the number of broken facets between the two parts."""
    ended = run(sim)
    first, block = sim.model.part_starts[1], sim.model.blocks[0]
    return ended, int((block.bond[block.across // 4 >= first] != 0).sum())


def test_parts_of_a_broken_bond_are_in_contact() -> None:
    """The two parts are pulled apart and pushed back: contact transmits the pressure, without penetration."""
    course = [[0, 1], ["1.5 us", 1], ["1.6 us", -1], ["5 us", -1]]
    ends = drawn("0 m/s", "2 m/s")
    ends[1]["course"] = course
    case = joint(("alumina", "steel"), {**BOND, "energy": 0, "shear_energy": 0}, boundaries=ends,
                 run={"end_time": "4 us"})  # fmt: skip

    def gaps(sim: Simulation) -> tuple[Ended, float, float]:
        ended, nodes = run(sim), sim.model.nodes
        heights = []
        for block in sim.model.blocks:
            own = np.unique(block.tets)
            own = own[np.abs(nodes.x0[own, 2] - 3e-3) < 1e-9]
            heights.append(nodes.x[own[np.lexsort(nodes.x0[own, :2].T)], 2])
        return ended, float((heights[1] - heights[0]).min()), float(nodes.x[:, 2].max() - 6e-3)

    ((ended, gap, pushed),) = on(1, case, PARTS, gaps)
    assert ended.broken == 18
    assert pushed < -1e-6
    assert gap > -2e-8
