"""Erosion of tets from bodies whose facets break: energy of a bond, balances, surface, stars, and one answer."""

from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.mesh.faces import across
from conoid.worker.model.state import WIDE
from conoid.worker.simulation import Simulation

from ..worker.joints import joint
from ..worker.kernels import FORMS, Form
from ..worker.simulations import kept_again, on, tick
from .pulled import AREA, BOND, PARTS, WHOLE, drawn

Ints = np.ndarray
LOWER = len(PARTS[0].tets)
"""Number of tets below the bond, which have the smaller ids."""


def at_the_bond() -> Ints:
    """Returns the ids of the tets above the bond that have a face on it, in the order of the faces below."""
    other = across(WHOLE.tets)[:LOWER] // 4
    return other[other >= LOWER]


class Torn(NamedTuple):
    """Energies, J, of a bond that is pulled apart while tets erode at it, and further results."""

    spent: float
    """Energy that the bond has absorbed."""
    closed: float
    """Work on the facets whose tets eroded while they softened, up to the erosion."""
    last: float
    """Work of the last traction of these facets, half of it times the change of the opening."""
    whole: float
    """Fracture energy of these facets."""
    residual: float
    fragments: int


def torn(sim: Simulation) -> Torn:
    """Pulls a bond apart; tets erode at a third of its facets while they soften, and at all others after they have
    failed.
    """
    step.prepare(sim)
    assert sim.fracture is not None
    assert sim.fracture.cohesion is not None
    assert sim.record is not None
    first, rest, worst, found = at_the_bond()[:6], at_the_bond()[6:], 0.0, (0.0, 0.0, 0.0)
    while sim.clock.t < sim.case.run.end_time:
        facets, gone = sim.fracture.cohesion.facets, None
        some = facets.take(np.asarray(np.isin(facets.tets, first).any(axis=1)))
        work, whole = float(some.state.work.sum()), float((some.constants.energy * some.constants.area).sum())
        now = len(some.tets) == 6 and work > 0.5 * whole
        if now:
            gone, first = first, first[:0]
        elif not len(first) and len(rest) and sim.fracture.broken == 18 and not len(facets.tets):
            gone, rest = rest, rest[:0]
        worst = max(worst, tick(sim, gone))
        if now:
            x = sim.model.nodes.x[some.nodes]
            moved = x[:, 3:] - x[:, :3] - some.state.opening
            found = work, 0.5 * float((some.state.pull * moved).sum()), whole
    assert not len(rest)
    sim.record.update()
    before = sim.model.nodes.v.copy()
    step.first_half(sim)
    energy = sim.ledger.close(before)
    return Torn(energy.fracture + energy.cohesive, *found, worst, sim.record.count)


def test_a_bond_absorbs_its_energy_where_its_facets_open_before_their_tets_erode() -> None:
    """A facet whose tet erodes earlier keeps the work that was done on it."""
    case = joint(
        ("alumina", "steel"), BOND, upper={"erosion": {}}, boundaries=drawn("0 m/s", "2 m/s"), run={"end_time": "3 us"}
    )
    (ended,) = on(1, case, PARTS, torn)
    assert 0.5 * ended.whole < ended.closed < 0.9 * ended.whole
    assert ended.whole == pytest.approx(10.0 * AREA / 3.0, rel=0.2)
    assert ended.spent - ended.closed - ended.last == pytest.approx(10.0 * AREA - ended.whole, rel=0.02)
    assert ended.residual < 1e-4
    assert ended.fragments == 2


STRETCH = {"rate": [0.0, 2e3, 6e3], "centre": [0, 0, "3 mm"]}
SPIN = {"centre": [0, 0, "3 mm"], "rate": [2e3, 3e3, 0.0]}


def flying(contact: bool, form: Form = "nodal", nodes: str = "strike") -> Any:
    """Returns a bonded bar that stretches and spins in free flight; both parts may erode, and the lower one breaks."""
    wears = {"erosion": {"nodes": nodes}, "velocity": [30, 0, 0], "stretch": STRETCH, "spin": SPIN}
    keys: dict[str, Any] = {} if contact else {"contact": "none"}
    return joint(
        ("soda_lime", "steel"), {**BOND, "strength": "8 MPa"}, lower={**wears, "fracture": {"model": "cohesive"}},
        upper=wears, numerics={"pressure": form}, run={"end_time": "5 us"}, **keys,
    )  # fmt: skip


def rounds() -> list[Ints]:
    """Returns the ids of the tets that are removed, one list for each removal: single tets, and neighbours."""
    random, left, found = np.random.default_rng(5), np.arange(len(WHOLE.tets)), []
    for _ in range(5):
        first = random.integers(0, len(left))
        gone = np.isin(left, np.r_[random.choice(left, len(left) // 20, replace=False), left[first : first + 8]])
        found.append(left[gone])
        left = left[~gone]
    return found


def require_connected_stars(sim: Simulation) -> None:
    """Requires that the tets at every node are connected through faces that are not broken."""
    assert sim.fracture is not None
    separation = sim.fracture.separation
    held = np.unique(np.concatenate([block.tets.reshape(-1) for block in sim.model.blocks])).astype(np.int64)
    rows, _, begins = separation._stars(held)
    assert not len(separation._pieces.of(rows, begins)[1])


def require_surface(sim: Simulation) -> None:
    """Requires that the surface is the faces without a neighbour, and the sides of open cracks."""
    assert sim.contact is not None
    faces, behind = sim.contact.exterior.surface.faces, across(WHOLE.tets)
    there = np.concatenate([block.id for block in sim.model.blocks])
    expected = []
    for block in sim.model.blocks:
        other = behind[block.id]
        bare = (other < 0) | ~np.isin(other // 4, there) | (block.bond == WIDE)
        expected.append((4 * block.id[:, None] + np.arange(4))[bare])
    assert np.array_equal(np.sort(faces.id[faces.exposed]), np.sort(np.concatenate(expected)))


@pytest.mark.parametrize("contact", [True, False])
@pytest.mark.parametrize(("form", "nodes"), [("standard", "remove"), ("nodal", "strike"), ("split", "particles")])
def test_the_balances_close_and_no_hinge_remains(form: Form, nodes: str, contact: bool) -> None:
    """Removed tets cut the stars of their nodes; no piece of a body hangs on an edge or on a node."""

    def work(sim: Simulation) -> tuple[float, float, int]:
        nodes = sim.model.nodes
        mass, momentum = nodes.mass.sum(), (nodes.mass[:, None] * nodes.v).sum(axis=0)
        largest = (nodes.mass[:, None] * np.abs(nodes.v)).sum()
        step.prepare(sim)
        worst, wrong = 0.0, 0.0
        for gone in [*rounds(), None]:
            for some in (None, None, gone):
                worst = max(worst, tick(sim, some))
                wrong = max(wrong, float(np.abs(sim.ledger.momentum - momentum).max() / largest))
            require_connected_stars(sim)
            if contact and gone is not None:
                require_surface(sim)
        assert sim.erosion is not None
        assert sim.fracture is not None
        assert sim.ledger.eroded_mass + nodes.mass[~sim.erosion.removed].sum() == pytest.approx(mass, rel=1e-14)
        return worst, wrong, sim.fracture.broken

    ((worst, wrong, broken),) = on(1, flying(contact, form, nodes), PARTS, work)
    assert broken > 10
    assert worst < 1e-4
    assert wrong < 1e-12


@pytest.mark.parametrize("form", FORMS)
def test_ranks_and_restarts_change_no_bit(form: Form, tmp_path: Path) -> None:
    case, gone = flying(True, form), rounds()

    def work(sim: Simulation, restarts: bool = False) -> tuple[Any, ...]:
        step.prepare(sim)
        for number in range(3 * len(gone)):
            if restarts and number in (4, 5, 10):
                sim = kept_again(sim, case, tmp_path)
            tick(sim, gone[number // 3] if number % 3 == 2 else None)
        assert sim.fracture is not None
        known = digest.digest(sim.model, sim.comm, sim.elements.nodal), sim.fracture.broken, sim.ledger.parts
        sim.free()
        return known

    one = on(1, case, PARTS, work)[0]
    assert one[1] > 10
    for ranks in (3, 7):
        assert on(ranks, case, PARTS, work)[0] == one
    assert on(2, case, PARTS, partial(work, restarts=True))[0] == one
