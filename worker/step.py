"""The time step, in order. A new developer reads this file first.

Leapfrog: positions, stresses and forces live at n, velocities at n-1/2. One pass over the elements makes stress(n+1)
and at once f(n+1) from it, so a step begins with forces that are already at hand:

==  =====================================================  ==========================
 1  choose dt (the first once more, after 4)               from the limits at n
 2  second half of the work of the last impulses           v(n-1/2)
 3  erosion: worn tets leave the body                      topology(n)
 4  contact: search, when it is due                        candidate pairs
 5  cohesive facets let go; velocities                     f(n); v(n-1/2) -> v*(n+1/2)
 6  gravity, tractions, symmetry, prescribed motion        v*(n+1/2)
 7  erosion: removed nodes stop                            v*(n+1/2)
 8  contact: impulses of active contacts; tied bonds       v*(n+1/2)
 9  walls, mirror images behind symmetry planes            v*(n+1/2) -> v(n+1/2)
10  output at time n: ledger, probes, frames               x(n), stress(n)
11  positions; debris past a plane becomes its image       x(n) -> x(n+1)
12  velocity gradient at x(n+1/2), stress, pressure        stress(n) -> stress(n+1)
13  internal forces, limits of the next step               f(n+1)
14  complete shared nodes, step reduction                  the exchange of the step
15  facets that pass break, nodes separate                 topology(n+1), f(n+1)
==  =====================================================  ==========================

After the last step 1 to 10 are done once more, and ``end`` takes the velocities at n.

Rigid bodies (rigid/stage.py) and walls that move take part in 2, 6, 8, 9 and 11, and in no other.

What erosion uncovers meets in the same step. 12 and 13 are one pass over each chunk of tets (two with an averaged
pressure, with the exchange of the nodal volumes between them); 14 is started after the border tets and finished after
the interior ones, before the criterion. Which facets pass it is found before the reduction, which says whether any rank
has some and whom they concern; which cracks open is found in 8, and they open after the reduction.
"""

import math

import numpy as np

from .boundaries.boundaries import Acts
from .elements import failed
from .errors import PhysicsError
from .fracture.stage import BREAKS, NOTHING, OVERSTRESSED, Fracture
from .model.state import Floats
from .parallel import fixed_point
from .simulation import Simulation


def prepare(sim: Simulation) -> None:
    """Forces and limits of the initial state: a pass over the elements in no time at all."""
    sim.model.nodes.force[:] = 0
    _elements(sim, 0.0, None)
    if sim.erosion is not None:
        sim.erosion.begin(sim.reduction.limit)
    sim.timers.switch("rest")


def first_half(sim: Simulation) -> None:
    """1 to 9: from f(n) to v(n+1/2)."""
    nodes, clock = sim.model.nodes, sim.clock
    sim.timers.switch("nodes")
    mean_dt = clock.choose(sim.limit)  # 1: dt between n and n+1
    if clock.collapsed:
        raise PhysicsError(
            f"{_when(sim)}: {sim.limiting_tet()} is crushed; the stable step is {clock.stable:.3g} s. Where its "
            "part erodes (parts[].erosion) such a tet leaves"
        )
    acts = sim.acts
    _before_kick(sim, acts)  # 2 to 4
    if sim.contact is not None and clock.step == 0 and sim.contact.look_ahead(nodes):
        mean_dt = clock.choose_again(sim.limit)
    if sim.fracture is not None:
        sim.fracture.let_go()  # 5: f(n), less where cohesive facets would give what nobody has paid
    # v*(n+1/2) = v(n-1/2) + dt f(n) / m
    sim.leapfrog.kick(nodes, mean_dt / nodes.scale, clock.shorter / nodes.scale)
    _after_kick(sim, acts)  # 6 to 9: v(n+1/2)


def end(sim: Simulation, before: Floats) -> None:
    """After the first half of the step that would follow the last one: v(n), between v(n-1/2), ``before`` (nodes, 3),
    and v(n+1/2), in which walls and contact have had their part as in any step.
    """
    nodes = sim.model.nodes
    nodes.v[:] = between(sim, before)
    if sim.erosion is not None:
        nodes.v[sim.erosion.removed] = 0.0
    if sim.rigid is not None:
        sim.rigid.share = 0.5 * sim.clock.last_dt / sim.clock.mean_dt


def between(sim: Simulation, before: Floats) -> Floats:
    """(nodes, 3) v(n), m/s, between v(n-1/2), ``before`` (nodes, 3), and v(n+1/2) of the model."""
    v = sim.model.nodes.v
    return np.asarray(before + 0.5 * sim.clock.last_dt / sim.clock.mean_dt * (v - before))


def _before_kick(sim: Simulation, acts: Acts) -> None:
    """2 to 4, with v(n-1/2)."""
    nodes, erosion, contact, bonds = sim.model.nodes, sim.erosion, sim.contact, sim.bonds
    for boundary in acts.noting:
        boundary.note(nodes)  # 2: half of the impulse times v(n-1/2)
    if erosion is not None:
        erosion.note(nodes)
    if contact is not None:
        contact.note(nodes)
    if sim.rigid is not None:
        sim.rigid.note()
    sim.walls.note()
    if erosion is not None:
        removes = erosion.due
        erosion.remove(nodes)  # 3: what the tets covered is surface now
        if bonds is not None and removes:
            bonds.follow()
    if bonds is not None:
        bonds.note(nodes)  # 2, of the nodes that are tied now
    if contact is not None:
        contact.search_if_due(nodes)  # 4: candidate pairs of the surface as it is now


def _after_kick(sim: Simulation, acts: Acts) -> None:
    """6 to 9: from v*(n+1/2) to v(n+1/2)."""
    nodes, dt, t = sim.model.nodes, sim.clock.dt, sim.clock.t
    for boundary in acts.before_contact:
        boundary.apply(nodes, dt, t)  # 6
    sim.walls.kick(dt, t)
    if sim.rigid is not None:
        sim.rigid.kick(nodes, dt, t)
    if sim.erosion is not None:
        sim.erosion.stop_removed(nodes)  # 7
    if sim.bonds is not None:
        sim.bonds.predict(nodes)  # 8: contact sees bodies that hold together
    if sim.contact is not None:
        sim.contact.solve(nodes, dt, t)  # 8
    if sim.bonds is not None:
        sim.bonds.solve(nodes, touched=sim.contact is not None)  # 8
    for boundary in acts.after_contact:
        boundary.apply(nodes, dt, t)  # 9
    if sim.rigid is not None:
        sim.rigid.settle(nodes, t)


def second_half(sim: Simulation) -> None:
    """11 to 15: from v(n+1/2) to f(n+1)."""
    nodes, clock = sim.model.nodes, sim.clock
    # 11: x(n+1) = x(n) + dt v(n+1/2)
    sim.leapfrog.move(nodes, clock.dt, clock.shorter / nodes.scale)
    for boundary in sim.acts.moving:
        boundary.after_move(nodes)  # images of debris that passes a symmetry plane
    sim.walls.move(clock.dt)
    if sim.rigid is not None:
        sim.rigid.move(nodes, clock.dt)
    clock.advance()
    if sim.contact is not None:
        own = sim.reduction.own
        own.search, own.approach, own.opening = sim.contact.spent(nodes), sim.contact.approach, sim.contact.opening
        own.stray = sim.contact.stray
        own.costs[:], own.unsettled[:] = sim.contact.costs, sim.contact.need.unsettled
    _elements(sim, clock.dt, sim.fracture)  # 12 to 14
    if sim.fracture is not None and sim.reduction.breaking != NOTHING:
        sim.timers.switch("fracture")
        # 15: facets break, nodes separate, f(n+1) goes with them
        sim.fracture.advance(sim.reduction.breaking, sim.reduction.touched)
        if sim.bonds is not None and sim.reduction.breaking == BREAKS:
            sim.bonds.follow()
    sim.timers.switch("rest")


def _elements(sim: Simulation, dt: float, fracture: Fracture | None) -> None:
    """12 to 14, and which facets break; repeats the sum of forces in a coarser quantum when they have outgrown the
    present one.
    """
    elements, reduction, own = sim.elements, sim.reduction, sim.reduction.own
    scale = sim.scale = sim.next_scale()
    sim.timers.switch("elements")
    elements.advance(dt, scale)
    if sim.crushing is not None:
        sim.crushing.look()
    own.breaking = OVERSTRESSED if elements.hot else NOTHING
    sim.timers.switch("exchange")
    if fracture is not None:
        elements.finish()
        sim.timers.switch("fracture")
        own.breaking = fracture.find(own.touched)
        sim.timers.switch("exchange")
    own.limit, own.force, own.worn = elements.limit, elements.force, elements.worn
    if sim.rigid is not None:
        own.limit = max(own.limit, sim.rigid.limit)
    if sim.erosion is not None:
        own.worn = max(own.worn, sim.erosion.strikes())
    own.apart = sim.bonds is not None and sim.bonds.apart
    own.nodes = sim.model.nodes_global
    reduction.begin(sim.comm)
    if fracture is None:
        elements.finish()
    reduction.finish()
    sim.model.nodes_global = reduction.nodes
    if not (math.isfinite(reduction.limit) and math.isfinite(reduction.force)):
        raise PhysicsError(f"{_when(sim)}: {sim.limiting_tet()} {failed.why(sim)}")
    if sim.contact is not None:
        sim.contact.agree(reduction)
    if sim.erosion is not None:
        sim.erosion.decide(reduction.worn)
    if sim.bonds is not None and reduction.apart:
        sim.bonds.follow()
    if fixed_point.outgrown(reduction.force, scale):
        sim.scale = fixed_point.scale_for(reduction.force)
        sim.timers.switch("elements")
        elements.again(sim.scale)
        sim.timers.switch("exchange")
        elements.finish()


def _when(sim: Simulation) -> str:
    return f"step {sim.clock.step}, t = {sim.clock.t:.6g} s"
