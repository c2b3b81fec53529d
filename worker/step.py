"""The time step, in order. A new developer reads this file first.

Leapfrog: positions, stresses and forces live at n, velocities at n-1/2. One pass over the elements makes stress(n+1)
and at once f(n+1) from it, so a step begins with forces that are already at hand:

==  =====================================================  ==========================
 1  choose dt                                              from the limits at n
 2  velocities; cohesive facets let go before              v(n-1/2) -> v*(n+1/2)
 3  boundaries: gravity, symmetry, prescribed motion,     v*(n+1/2) -> v(n+1/2)
    contact, walls
 4  whoever looks at time n: ledger, probes, frames        x(n), stress(n)
 5  positions                                              x(n) -> x(n+1)
 6  velocity gradient at x(n+1/2), stress, pressure        stress(n) -> stress(n+1)
 7  internal forces, limits of the next step               f(n+1)
 8  complete shared nodes and the vote                     the exchange of the step
 9  facets that pass break, nodes separate                 topology(n+1), f(n+1)
==  =====================================================  ==========================

6 and 7 are one pass over each chunk of tets (two with an averaged pressure, with the exchange of the nodal volumes
between them); 8 is started after the border tets and finished after the interior ones.
"""

import math

from .errors import PhysicsError
from .motion import kick, move
from .parallel import fixed_point
from .simulation import Simulation


def prepare(sim: Simulation) -> None:
    """Forces and limits of the initial state: a pass over the elements in no time at all."""
    _elements(sim, 0.0)
    if sim.erosion is not None:
        sim.erosion.begin(sim.vote.limit)


def first_half(sim: Simulation) -> None:
    """1 to 3: from f(n) to v(n+1/2)."""
    nodes, clock = sim.model.nodes, sim.clock
    with sim.timers.phase("nodes"):
        mean_dt = clock.choose(sim.limit)  # 1: dt between n and n+1
        if clock.collapsed:
            raise PhysicsError(
                f"{_when(sim)}: {sim.limiting_tet()} is crushed; the stable step is {clock.stable:.3g} s"
            )
        for boundary in sim.boundaries:  # worn-out tets leave here, before contact looks at the surface
            boundary.note(nodes)
        if sim.fracture is not None:
            sim.fracture.let_go()  # f(n): less where cohesive facets would give what nobody has paid
        kick(nodes.v, nodes.force, nodes.mass, mean_dt / sim.scale)  # 2: v*(n+1/2) = v(n-1/2) + dt f(n) / m
        for boundary in sim.boundaries:  # 3: v(n+1/2)
            boundary.apply(nodes, clock.dt, clock.t)


def second_half(sim: Simulation) -> None:
    """5 to 9: from v(n+1/2) to f(n+1)."""
    nodes, clock = sim.model.nodes, sim.clock
    with sim.timers.phase("nodes"):
        move(nodes.x, nodes.v, clock.dt)  # 5: x(n+1) = x(n) + dt v(n+1/2)
        clock.advance()
        if sim.contact is not None:
            sim.vote.words[4] = sim.contact.spent(nodes)
    _elements(sim, clock.dt)  # 6 to 8
    if sim.fracture is not None:
        with sim.timers.phase("fracture"):
            if sim.vote.hot:
                sim.fracture.advance()  # 9: facets break, nodes separate, f(n+1) goes with them
            else:
                sim.fracture.rest()


def _elements(sim: Simulation, dt: float) -> None:
    """6 to 8; repeats the sum of forces in a coarser quantum when they have outgrown the present one."""
    elements, vote = sim.elements, sim.vote
    sim.scale = sim.next_scale()
    with sim.timers.phase("elements"):
        elements.advance(dt, sim.scale)
    with sim.timers.phase("exchange"):
        vote.words[0], vote.words[1], vote.words[5:7] = elements.peaks[0], elements.peaks[2], elements.peaks[3:5]
        pending = sim.comm.begin_maximum(vote.words, vote.result)
        elements.finish()
        pending.finish()
    if not (math.isfinite(vote.limit) and math.isfinite(vote.force)):
        raise PhysicsError(f"{_when(sim)}: {sim.limiting_tet()} turned inside out, or its stress is not a number")
    if sim.contact is not None:
        sim.contact.due |= vote.search
    if sim.erosion is not None:
        sim.erosion.decide(vote.worn)
    if fixed_point.outgrown(vote.force, sim.scale):
        sim.scale = fixed_point.scale_for(vote.force)
        with sim.timers.phase("elements"):
            elements.again(sim.scale)
        with sim.timers.phase("exchange"):
            elements.finish()


def _when(sim: Simulation) -> str:
    return f"step {sim.clock.step}, t = {sim.clock.t:.6g} s"
