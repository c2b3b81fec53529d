"""The simulation of one rank: model, pressure form, boundaries, contact, fracture and accounts. The simulation is built
once and used by the time step (step.py).
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from conoid.cases.model.schema import Case, Symmetry

from . import scales
from .accounts.energy import Ledger
from .accounts.sums import Sums
from .accounts.timers import Timers, worked
from .bonds.interface import tied_pairs
from .bonds.pieces import Pieces
from .bonds.stage import Bonds
from .boundaries.boundaries import Acts, Boundary
from .boundaries.mirrors import Mirrors
from .boundaries.wall_shapes import Walls
from .clock import Clock
from .contact.narrow_phase.tied import Tied
from .contact.stage import Contact
from .elements.crushing import Crushing
from .elements.forms import Elements
from .elements.selection import elements_of
from .erosion import Erosion
from .fracture.record import Record
from .fracture.stage import Fracture
from .gauges.gauge import Scene
from .gauges.probes import Probes
from .migration import model as model_of
from .migration.parcel import Parcel
from .migration.route import Arrived
from .model.state import Floats, Model
from .model.topology import KeptByNode
from .motion import Leapfrog
from .parallel import fixed_point
from .parallel.comm import Comm
from .parallel.ownership import Neighbour
from .parallel.passes import Ranges
from .parallel.team import team
from .reduction import StepReduction
from .rigid.stage import Rigid
from .rigid.start import rigid_of
from .scene import conditions, domain, starting
from .scene.assembly import Say, quiet


class Stage(Protocol):
    """Interface of a stage of the simulation. A stage may have state by node, by tet, or in its own tables."""

    def keep(self, parcel: Parcel) -> None:
        """Adds the state of the stage to a parcel (a checkpoint or migration message)."""

    def resume(self, parcel: Parcel) -> None:
        """Restores the state of the stage from a parcel (a checkpoint or migration message)."""


@dataclass
class Simulation:
    """Model and stages of one rank. A stage that the case does not need is None."""

    case: Case
    comm: Comm
    model: Model
    elements: Elements
    leapfrog: Leapfrog
    boundaries: list[Boundary]
    """Boundaries, in the order in which they act in a step."""
    contact: Contact | None
    bonds: Bonds | None
    """Tied bonds between non-matching meshes."""
    erosion: Erosion | None
    fracture: Fracture | None
    rigid: Rigid | None
    walls: Walls
    clock: Clock
    ledger: Ledger
    probes: Probes
    timers: Timers
    record: Record | None
    """Record of the fragments; None if no part fractures."""
    crushing: Crushing | None
    neighbours: list[Neighbour]
    assembled: float
    """CPU time that the slowest rank used to build the stages, s."""
    floor: float
    """Force, N, that limits the force quantum from below. If all forces are smaller than this force, the quantum is not
    made smaller."""
    reduction: StepReduction
    warnings: tuple[str, ...] = ()
    """Warnings about the meshes. A resumed run has no warnings about meshes."""
    _acts: Acts | None = None

    @property
    def acts(self) -> Acts:
        """The boundaries, sorted by their position in the time step."""
        if self._acts is None or self._acts.boundaries != len(self.boundaries):
            self._acts = Acts.of(self.boundaries)
        return self._acts

    @property
    def scale(self) -> float:
        """Number of quanta per newton in the present nodal forces."""
        return self.model.nodes.scale

    @scale.setter
    def scale(self, scale: float) -> None:
        self.model.nodes.scale = scale

    @property
    def limit(self) -> float:
        """Largest value of 1 / stable step, over all tets and contacts, 1/s."""
        return max(self.reduction.limit, self.contact.limit) if self.contact is not None else self.reduction.limit

    @property
    def pushing(self) -> "list[Boundary | Contact | Rigid]":
        """All objects that apply impulses to nodes. Each object has the attribute ``last_push``, which is the time of
        its last impulse, s.
        """
        return [*self.boundaries, *(each for each in (self.contact, self.rigid) if each is not None)]

    @property
    def stages(self) -> list[Stage]:
        """The stages that have state, in the order in which the state is restored."""
        found = self.erosion, self.contact, self.bonds, self.elements, self.fracture, self.record
        return [each for each in found if each is not None]

    def limiting_id(self) -> int:
        """Returns the id of the tet that limits the time step; -1 if no tet limits the time step. If several tets have
        the same limit, the smallest id is returned. Collective."""
        mine = self.elements.limit_bits == fixed_point.bits_of(self.reduction.limit)
        first = self.comm.maximum(np.array([-float(self.elements.limiting) if mine else -np.inf]))[0]
        return -1 if np.isinf(first) or not self.model.elements_global else -int(first)

    def limiting_tet(self) -> str:
        """Returns the name of the tet that limits the time step, "a rigid part" or "no tet". Collective."""
        first = self.limiting_id()
        if first < 0:
            return "no tet" if self.rigid is None else "a rigid part"
        part = int(np.searchsorted(self.model.part_starts, first, side="right")) - 1
        return f"tet {first} of {self.model.parts[part]}"

    def limiter(self) -> str:
        """Returns a text with the reason for the present time step and the tet that limits the step. Collective."""
        stable, tet = self.clock.stable, self.limiting_tet()
        if self.limit > self.reduction.limit:
            return "contact: speed of approach"
        if tet == "a rigid part":
            return "rigid parts: spin, or no other limit"
        why = "stability" if stable * self.reduction.limit >= 0.999 * self.case.numerics.dt_safety else "growth"
        if self.clock.dt < 0.9 * stable:
            why = "output time"
        return f"{why}: {tet}"

    def shared_nodes(self) -> int:
        """Returns the number of nodes that several ranks share. Collective."""
        shared = np.zeros(self.model.nodes.n, bool)
        for other in self.neighbours:
            shared[other.nodes] = True
        return int(self.comm.sum(np.array([(shared & self.model.nodes.owned).sum()]))[0])

    def count_nodes(self) -> None:
        """Sets ``nodes_global``, the number of nodes on all ranks, before the reduction of the next step sets it.
        Collective.
        """
        most = self.comm.maximum(np.array([float(self.model.nodes_global)]))
        self.model.nodes_global = int(most[0])

    def free(self) -> None:
        """Frees all persistent MPI messages."""
        for each in (self.elements, self.fracture, self.contact, *self.boundaries, self.bonds):
            if each is not None:
                each.free()

    def next_scale(self) -> float:
        """Returns the number of quanta per newton that the next sum of forces uses."""
        return float(fixed_point.scale_for(max(self.reduction.force, self.floor)))


def build(case: Case, folder: Path, comm: Comm, say: Say = quiet) -> Simulation:
    """Makes the mesh of a case, divides it among the ranks, and builds the stages. Rank 0 reports the progress by calls
    of the function ``say``.

    Raises the same InputError on every rank.
    """
    model, piece = domain.build(case, folder, comm, say)
    say("setting up the first step")
    walls = conditions.walls_of(case)
    scene = conditions.build(case, model, piece.loads, piece.neighbours, comm, walls)
    more = starting.start(case, model, scene, comm)
    rigid = rigid_of(case, model, walls, comm)
    timers = Timers(comm, team(case.run.threads))
    sim = _assemble(case, model, piece.neighbours, scene, (rigid, walls), piece.node_volume, comm, timers, piece.tied)
    sim.warnings = *piece.warnings, *more
    sim.probes.require_tets(case)
    if sim.contact is not None:
        sim.contact.require_faces()
    return sim


def _assemble(
    case: Case, model: Model, neighbours: list[Neighbour], scene: list[Boundary],
    undeformed: tuple[Rigid | None, Walls], node_volume: Floats, comm: Comm, timers: Timers,
    tied: Pieces,
) -> Simulation:  # fmt: skip
    """Builds the stages that the case needs, for a model and its boundaries. ``node_volume`` (nodes,): nodal volumes at
    the start, m^3; ``tied``: pieces of the tied bonds, None for a run that resumes.
    """
    began, run, numerics, (rigid, moving) = worked(comm), case.run, case.numerics, undeformed
    threads = team(run.threads)
    clock = Clock(run.end_time, numerics.dt_safety, case.dt_growth, run.frames)
    extremes = scales.extremes(model, comm)
    contact, erosion = None, None
    if case.in_contact:
        contact = Contact(case, model, neighbours, scene, comm, clock, timers, threads, extremes[:2], rigid)
    if case.erodes:
        erosion = Erosion(case, model, neighbours, contact, scene, comm, clock, extremes)
    bonds = None
    if tied_pairs(case):
        bonds = Bonds(case, model, tied, scene, rigid, comm, clock, threads, extremes[0] * extremes[1])
    if contact is not None and bonds is not None:
        contact.detection.tied = Tied(bonds.ties)
    if case.boundaries_of(Symmetry):
        scene.append(Mirrors.of(case, model, scene, comm))
    for bound in scene:
        bound.over = Ranges(threads)
        bound.measure(*extremes[:2])
    elements = elements_of(case, model, neighbours, scene, node_volume, comm, timers, threads)
    fracture = None
    if case.fractures:
        by_node: list[KeptByNode] = [*scene, *([contact] if contact is not None else [])]
        fracture = Fracture(case, model, neighbours, elements, by_node, contact, comm, clock, threads)
        if erosion is not None:
            erosion.removal = fracture.removal(case, contact)
    stopping = tuple(bound for bound in scene if bound.given is not None)
    probes = Probes(case, Scene(model, contact, stopping, rigid, moving, erosion, fracture, clock, comm))
    sums = Sums(model, scene, contact, bonds, erosion, fracture, (rigid, moving), comm, clock, threads)
    ledger = Ledger(sums, model.parts)
    return Simulation(
        case=case, comm=comm, model=model, elements=elements, leapfrog=Leapfrog(threads), boundaries=scene,
        contact=contact, bonds=bonds, erosion=erosion, fracture=fracture, rigid=rigid, walls=moving,
        clock=clock, ledger=ledger, probes=probes, timers=timers,
        record=Record(model, fracture, comm, threads) if fracture is not None else None,
        crushing=Crushing.of(case, model, comm, clock, threads),
        neighbours=neighbours, floor=scales.force_floor(model, comm),
        reduction=StepReduction(comm.size, fractures=case.fractures, contact=contact is not None),
        assembled=float(comm.maximum(np.array([worked(comm) - began]))[0]),
    )  # fmt: skip


def keep(sim: Simulation) -> Parcel:
    """Returns the whole state of this rank between two steps as a parcel. Collective."""
    sim.count_nodes()
    parcel = model_of.keep(sim.model, sim.case)
    pushes = sim.comm.maximum(np.array([each.last_push for each in sim.pushing]))
    parcel.known |= {
        "reduction": sim.reduction.keep(), "clock": sim.clock.keep(), "ledger": sim.ledger.keep(),
        "probes": sim.probes.keep(), "walls": sim.walls.keep(), "floor": sim.floor, "last_push": pushes.tolist(),
    }  # fmt: skip
    for index, bound in enumerate(sim.boundaries):
        bound.keep(parcel, f"boundary{index}")
    for stage in sim.stages:
        stage.keep(parcel)
    if sim.crushing is not None:
        parcel.known["crushing"] = sim.crushing.keep()
    if sim.rigid is not None:
        parcel.known["rigid"] = sim.rigid.keep()
    return parcel


def resume(case: Case, arrived: Arrived, comm: Comm, timers: Timers) -> Simulation:
    """Builds the simulation from the parcel ``arrived``, which was read from a checkpoint or received from other ranks.
    Collective.
    """
    parcel, known = arrived.parcel, arrived.parcel.known
    model = model_of.resume(case, arrived, comm)
    walls = conditions.walls_of(case)
    walls.resume(known["walls"])
    scene = conditions.build(case, model, conditions.loads(parcel), arrived.neighbours, comm, walls)
    both = rigid_of(case, model, walls, comm, known.get("rigid")), walls
    ones, none = np.ones(model.nodes.n), Pieces.none()
    sim = _assemble(case, model, arrived.neighbours, scene, both, ones, comm, timers, none)
    sim.reduction.resume(known["reduction"])
    sim.clock.resume(known["clock"])
    sim.ledger.resume(known["ledger"])
    sim.probes.resume(known["probes"])
    sim.floor = known["floor"]
    for each, last_push in zip(sim.pushing, known["last_push"], strict=True):
        each.last_push = last_push
    for index, bound in enumerate(sim.boundaries):
        bound.resume(parcel, f"boundary{index}", sim.clock.dt)
    for stage in sim.stages:
        stage.resume(parcel)
    if sim.crushing is not None:
        sim.crushing.resume(known["crushing"])
    return sim
