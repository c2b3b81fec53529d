"""The time step, in order.

The step is a leapfrog step: positions, stresses and forces are known at n, velocities at n-1/2. One pass over the
elements computes stress(n+1) and then f(n+1). Therefore f(n) is known when a step begins. Each row of the table is a
part of the step:

==  =====================================================  ==========================
 1  choose dt (in the first step again, after 4)           from the limits at n
 2  second half of the work of the last impulses           v(n-1/2)
 3  erosion: remove worn tets                              topology(n)
 4  contact: broad phase, if scheduled                     candidate pairs
 5  unload cohesive facets; kick                           f(n); v(n-1/2) -> v*(n+1/2)
 6  gravity, tractions, symmetry, prescribed motion        v*(n+1/2)
 7  erosion: stop removed nodes                            v*(n+1/2)
 8  contact: impulses of active contacts; tied bonds       v*(n+1/2)
 9  walls, mirror images behind symmetry planes            v*(n+1/2) -> v(n+1/2)
10  output at time n: ledger, probes, frames               x(n), stress(n)
11  move; reflect debris at symmetry planes                x(n) -> x(n+1)
12  velocity gradient at x(n+1/2), stress, pressure        stress(n) -> stress(n+1)
13  internal forces, limits of the next step               f(n+1)
14  complete shared nodes, step reduction                  the exchange of the step
15  break facets, separate nodes                           topology(n+1), f(n+1)
==  =====================================================  ==========================

``first_half`` executes rows 1 to 9, ``second_half`` rows 11 to 15; the loop (run/loop.py) writes the output of row 10
between the halves. After the last step, rows 1 to 10 are executed once more, and ``end`` sets the velocities to v(n).

- Rigid bodies (rigid/stage.py) and moving walls act in rows 2, 6, 8, 9 and 11 only.
- Faces that erosion exposes in row 3 are in contact from row 4 of the same step on.
- Rows 12 and 13 are one pass over each chunk of tets; the averaged pressure forms need two passes, and exchange
  the nodal volume sums between the two passes.
- Row 14 starts after the border tets and ends after the interior tets, before the fracture criterion. The criterion is
  computed before the reduction. The reduction then transfers whether any facet breaks, and which ranks have a node of
  such a facet.
- Row 8 finds the broken facets that have opened wide enough to be surface. The sides of these facets become surface
  after the reduction.
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
    """Computes forces and limits of the initial state, by a pass over the elements with dt = 0."""
    sim.model.nodes.force[:] = 0
    _advance_elements(sim, 0.0)
    _reduce(sim, None)
    if sim.erosion is not None:
        sim.erosion.begin(sim.reduction.limit)
    sim.timers.switch("rest")


def first_half(sim: Simulation) -> None:
    """Executes rows 1 to 9 of the table, which compute v(n+1/2) from f(n). Raises PhysicsError if the stable step has
    collapsed.
    """
    nodes, clock = sim.model.nodes, sim.clock
    sim.timers.switch("nodes")
    mean_dt = clock.choose(sim.limit)  # Row 1: choose dt, the step from n to n+1.
    if clock.collapsed:
        raise PhysicsError(
            f"{_when(sim)}: {sim.limiting_tet()} is crushed; the stable step is {clock.stable:.3g} s. If its "
            "part has parts[].erosion, such a tet is removed"
        )
    acts = sim.acts
    _before_kick(sim, acts)  # Rows 2 to 4: add the work of the last impulses, remove tets, run the broad phase.
    if sim.contact is not None and clock.step == 0 and sim.contact.look_ahead(nodes):
        mean_dt = clock.choose_again(sim.limit)  # Row 1 again: choose dt, now with the limit of contact.
    if sim.fracture is not None:
        sim.fracture.unload()  # Row 5: unload cohesive facets that would release more energy than they absorbed.
    # Row 5 (kick): v*(n+1/2) = v(n-1/2) + (dt(n-1/2) + dt(n+1/2)) / 2 f(n) / m
    sim.leapfrog.kick(nodes, mean_dt / nodes.scale, clock.shorter / nodes.scale)
    _after_kick(sim, acts)  # Rows 6 to 9: compute v(n+1/2).


def end(sim: Simulation, before: Floats) -> None:
    """Sets the velocities to v(n), after the first half of a step beyond the last step of the run.

    v(n) is interpolated between v(n-1/2), ``before`` (nodes, 3), and v(n+1/2), which walls and contact have corrected
    as in any step.
    """
    nodes = sim.model.nodes
    nodes.v[:] = between(sim, before)
    if sim.erosion is not None:
        nodes.v[sim.erosion.removed] = 0.0
    if sim.rigid is not None:
        sim.rigid.share = 0.5 * sim.clock.last_dt / sim.clock.mean_dt


def between(sim: Simulation, before: Floats) -> Floats:
    """(nodes, 3) v(n), m/s, interpolated between v(n-1/2), ``before`` (nodes, 3), and v(n+1/2) of the model."""
    v = sim.model.nodes.v
    return np.asarray(before + 0.5 * sim.clock.last_dt / sim.clock.mean_dt * (v - before))


def _before_kick(sim: Simulation, acts: Acts) -> None:
    """Executes rows 2 to 4 of the table; the velocities are v(n-1/2)."""
    nodes, erosion, contact, bonds = sim.model.nodes, sim.erosion, sim.contact, sim.bonds
    for boundary in acts.noting:
        boundary.note(nodes)  # Row 2: add half of the last impulse times v(n-1/2) to the work.
    if erosion is not None:
        erosion.note(nodes)
    if contact is not None:
        contact.note(nodes)
    if sim.rigid is not None:
        sim.rigid.note()
    sim.walls.note()
    if erosion is not None:
        removes = erosion.due
        erosion.remove(nodes)  # Row 3: faces of the neighbours of removed tets become surface.
        if bonds is not None and removes:
            bonds.follow()
    if bonds is not None:
        bonds.note(nodes)  # Row 2 for the tied bonds. After row 3 only nodes that are still tied are used.
    if contact is not None:
        contact.search_if_due(nodes)  # Row 4: update the candidate pairs of the present surface.


def _after_kick(sim: Simulation, acts: Acts) -> None:
    """Executes rows 6 to 9 of the table, which compute v(n+1/2) from v*(n+1/2)."""
    nodes, dt, t = sim.model.nodes, sim.clock.dt, sim.clock.t
    for boundary in acts.before_contact:
        boundary.apply(nodes, dt, t)  # Row 6: apply gravity, tractions, symmetry and prescribed motion.
    sim.walls.kick(dt, t)
    if sim.rigid is not None:
        sim.rigid.kick(nodes, dt, t)
    if sim.erosion is not None:
        sim.erosion.stop_removed(nodes)  # Row 7: stop removed nodes.
    if sim.bonds is not None:
        sim.bonds.predict(nodes)  # Row 8: apply the last impulses of tied bonds (warm start).
    if sim.contact is not None:
        sim.contact.solve(nodes, dt, t)  # Row 8: apply the impulses of active contacts.
    if sim.bonds is not None:
        sim.bonds.solve(nodes, touched=sim.contact is not None)  # Row 8: apply the impulses of tied bonds.
    for boundary in acts.after_contact:
        boundary.apply(nodes, dt, t)  # Row 9: apply walls and mirror images.
    if sim.rigid is not None:
        sim.rigid.settle(nodes, t)


def second_half(sim: Simulation) -> None:
    """Executes rows 11 to 15 of the table, which compute f(n+1) from v(n+1/2). Raises PhysicsError if a tet has
    failed.
    """
    nodes, clock = sim.model.nodes, sim.clock
    # Row 11 (move): x(n+1) = x(n) + dt v(n+1/2)
    sim.leapfrog.move(nodes, clock.dt, clock.shorter / nodes.scale)
    for boundary in sim.acts.moving:
        boundary.after_move(nodes)  # Row 11: reflect debris that passed a symmetry plane.
    sim.walls.move(clock.dt)
    if sim.rigid is not None:
        sim.rigid.move(nodes, clock.dt, clock.t)
    clock.advance()
    _advance_elements(sim, clock.dt)  # Rows 12 and 13: compute stress, forces and limits.
    complete(sim)


def complete(sim: Simulation) -> None:
    """Executes rows 14 and 15 of the table: completion of shared nodes, reduction, and fracture. Raises PhysicsError if
    a tet has failed.

    The last step of a program (stretch.py) ends with the function ``complete``.
    """
    _offer_contact(sim)
    _reduce(sim, sim.fracture)
    if sim.fracture is not None and sim.reduction.breaking != NOTHING:
        sim.timers.switch("fracture")
        # Row 15: break facets and separate nodes. The forces f(n+1) of the tets of a new node are moved to the new
        # node.
        sim.fracture.advance(sim.reduction.breaking, sim.reduction.touched)
        if sim.bonds is not None and sim.reduction.breaking == BREAKS:
            sim.bonds.follow()
    sim.timers.switch("rest")


def _advance_elements(sim: Simulation, dt: float) -> None:
    """Executes rows 12 and 13 of the table."""
    sim.scale = sim.next_scale()
    sim.timers.switch("elements")
    sim.elements.advance(dt, sim.scale)
    if sim.crushing is not None:
        sim.crushing.update()


def _reduce(sim: Simulation, fracture: Fracture | None) -> None:
    """Executes row 14 of the table. ``fracture`` is None in the pass over the initial state, in which no facet
    breaks.
    """
    elements, reduction = sim.elements, sim.reduction
    sim.timers.switch("exchange")
    _offer(sim, fracture)
    reduction.begin(sim.comm)  # Row 14: start the reduction.
    if fracture is None:
        elements.finish()
    reduction.finish()
    _follow_reduction(sim)
    if fixed_point.outgrown(reduction.force, sim.scale):
        _sum_again(sim)


def _offer_contact(sim: Simulation) -> None:
    """Sets the contribution of contact on this rank to the reduction (row 14 of the table), at the positions of n+1."""
    contact, own = sim.contact, sim.reduction.own
    if contact is None:
        return
    sim.timers.switch("contact")
    own.search, own.approach, own.opening = contact.spent(sim.model.nodes), contact.approach, contact.opening
    own.stray = contact.stray
    own.costs[:], own.unsettled[:] = contact.costs, contact.sweep_count.unsettled


def _offer(sim: Simulation, fracture: Fracture | None) -> None:
    """Sets the contribution of all other stages on this rank to the reduction (row 14 of the table). If parts fracture,
    this function first completes the forces of shared nodes and finds the facets that break.
    """
    elements, own = sim.elements, sim.reduction.own
    own.breaking = OVERSTRESSED if elements.hot else NOTHING
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


def _follow_reduction(sim: Simulation) -> None:
    """Applies the result of the reduction (row 14 of the table), which is equal on all ranks. Raises PhysicsError if a
    limit or a force is not a finite number.
    """
    reduction = sim.reduction
    sim.model.nodes_global = reduction.nodes
    if not (math.isfinite(reduction.limit) and math.isfinite(reduction.force)):
        raise PhysicsError(f"{_when(sim)}: {sim.limiting_tet()} {failed.why(sim)}")
    if sim.contact is not None:
        sim.contact.agree(reduction)
    if sim.erosion is not None:
        sim.erosion.decide(reduction.worn)
    if sim.bonds is not None and reduction.apart:
        sim.bonds.follow()


def _sum_again(sim: Simulation) -> None:
    """Repeats the sum of the forces (rows 13 and 14 of the table) with a larger quantum, if the largest force is too
    large for the present quantum.
    """
    sim.scale = fixed_point.scale_for(sim.reduction.force)
    sim.timers.switch("elements")
    sim.elements.again(sim.scale)
    sim.timers.switch("exchange")
    sim.elements.finish()


def _when(sim: Simulation) -> str:
    return f"step {sim.clock.step}, t = {sim.clock.t:.6g} s"
