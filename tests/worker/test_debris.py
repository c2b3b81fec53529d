"""Contact of nodes without tets with the part to which their removed tets belonged."""

from typing import Any

import numpy as np
import pytest

from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.contact.checks.inside import look
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import STEEL, build
from .meshes import block
from .simulations import tick

MM = 1e-3
SPEED = 300.0
EROSION = schema.Erosion()


def fallen(
    contact: dict[str, Any], until: float = 7e-6, erosion: schema.Erosion = EROSION
) -> tuple[Simulation, int]:  # fmt: skip
    """Returns a simulation of a block of 4 x 4 x 4 mm and a node. The node is the upper middle node of the block, which
    has lost its tets and moves down and to the side."""
    beside = moved(block((1, 1, 1), MM), (9 * MM, 0.0, 0.0))
    case = meeting_of([{"erosion": erosion}, {}], contact, material=STEEL)
    sim = build(case, [block((4, 4, 4), MM, shake=0.0), beside])
    nodes, part = sim.model.nodes, sim.model.blocks[0]
    node = int(np.abs(nodes.x0 - np.array([2.0, 2.0, 4.0]) * MM).sum(axis=1).argmin())
    step.prepare(sim)
    tick(sim, part.id[(part.tets == node).any(axis=1)])
    nodes.v[node] = 0.2 * SPEED, 0.15 * SPEED, -SPEED
    while sim.clock.t < until:
        tick(sim)
    return sim, node


def test_a_node_without_tets_stays_outside_of_the_part_that_it_comes_from() -> None:
    """The node moves into the hole of the removed tets and comes to rest on the bottom of the hole."""
    sim, node = fallen({})
    assert sim.contact is not None
    assert sim.model.nodes.x[node, 2] > 2.9 * MM
    assert sim.model.nodes.v[node, 2] > -0.1 * SPEED
    found = look(sim.contact, sim.model, None, SerialComm())
    assert (found.nodes, found.own) == (0, 0)


@pytest.mark.parametrize(
    ("nodes", "until", "leaves"),
    [("strike", 2e-6, False), ("strike", 7e-6, True), ("particles", 7e-6, False)],
    ids=["in flight", "after it has struck", "for ever"],
)
def test_a_node_without_tets_leaves_after_it_has_struck(nodes: Any, until: float, leaves: bool) -> None:
    """The slope that the node hits gets most of the momentum of the node. The rest of the momentum, along the slope, is
    booked when the node is removed."""
    sim, node = fallen({}, until, schema.Erosion(nodes=nodes))
    state, erosion = sim.model.nodes, sim.erosion
    assert erosion is not None
    momentum = sim.ledger.momentum.copy()
    brought = np.abs(state.mass[node] * SPEED)
    assert erosion.removed.sum() == leaves
    assert erosion.removed[node] == leaves
    assert sim.ledger.eroded_mass == pytest.approx(state.mass[node] if leaves else 0.0)
    if leaves:
        assert not state.v[node].any()
        assert (state.mass * state.v[:, 2]).sum() < -0.6 * brought
    tick(sim)
    assert np.abs(sim.ledger.momentum - momentum).max() < 1e-9 * brought


def test_without_self_contact_it_passes_and_is_counted() -> None:
    sim, node = fallen({"self_contact": ()})
    assert sim.contact is not None
    assert sim.model.nodes.x[node, 2] == pytest.approx(4.0 * MM - SPEED * 7e-6, abs=0.1 * MM)
    found = look(sim.contact, sim.model, None, SerialComm())
    assert (found.nodes, found.own) == (1, 1)
    [line] = found.warnings
    assert "1 of them, which have no tets, in the part that they come from" in line


@pytest.mark.parametrize(
    ("contact", "meet"),
    [
        ({}, ("wears", "breaks")), ({"self_contact": ()}, ("breaks",)), (None, ()),
        ({"self_contact": ("stays",)}, ("breaks", "stays")), ({"parts": ("stays", "wears")}, ("wears",)),
    ],
)  # fmt: skip
def test_parts_that_erode_or_fracture_have_self_contact(contact: dict[str, Any] | None, meet: tuple[str, ...]) -> None:
    """Self-contact is the default for eroding parts; a list of parts replaces this default. Parts that fracture always
    have self-contact."""
    case = meeting_of([{"erosion": EROSION}, {"fracture": schema.Fracture()}, {}])
    named = zip(case.parts, ("wears", "breaks", "stays"), strict=True)
    parts = tuple(part.model_copy(update={"name": name}) for part, name in named)
    spec = schema.Contact(**contact) if contact is not None else None
    case = case.model_copy(update={"parts": parts, "contact": spec})
    assert case.self_contact == meet
    one = case.model_copy(update={"parts": parts[:1]})
    assert one.in_contact == ("wears" in meet)
