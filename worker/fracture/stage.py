"""Fracture in the time step: initiation, separation of nodes, and update of all tables that depend on the topology.

The stage acts at the end of a step, with the stress at n+1; facets that pass the criterion break. A node whose star is
no longer connected gets copies. The forces of the tets of a copy are moved, as integers, from the parent to the copy.
Every table with one row for each node is extended by the copies. In ``cohesive`` parts a broken facet keeps its
traction, which decreases with the opening.

The reduction of the step transfers two values: whether a facet breaks, and the ranks that have a node of a broken
facet. The method ``find`` is called before the reduction, and ``advance`` after it. Flags from the neighbour ranks show
whether a shared facet is overstressed. A rank continues immediately with the next step if it has no node of a broken
facet, and no ghosts of a rank with such a node.
"""

import math

import numpy as np

from conoid.cases.model.joined import breakable, cohesive, wearing
from conoid.cases.model.schema import Case

from ..clock import Clock
from ..contact.stage import Contact
from ..elements.forms import Elements
from ..migration.parcel import Parcel
from ..model.state import Ints, Model
from ..model.topology import KeptByNode
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..parallel.team import Team
from . import facets
from .breaking import Breaking
from .cohesive import Cohesion
from .facets import Body
from .handover import Handover
from .initiation import Initiation
from .insertion import Insertion
from .removal import Removal
from .separation import Separation
from .terms import Terms
from .unloading import Unloading
from .update import TopologyUpdate

NOTHING, OVERSTRESSED, BREAKS = range(3)
"""State of the facets in a step; all ranks use the maximum of the values of all ranks. NOTHING: no face is
overstressed. OVERSTRESSED: some faces are overstressed. BREAKS: facets break, or may break."""


class Fracture:
    """The fracture stage of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], elements: Elements, by_node: list[KeptByNode],
        contact: Contact | None, comm: Comm, clock: Clock, team: Team,
    ) -> None:  # fmt: skip
        """``by_node``: all objects that have arrays by node, except the elements; ``team``: threads of the rank.
        Collective.
        """
        self._model, self._elements, self._clock, self._comm = model, elements, clock, comm
        bodies, work, self.warnings = self._bodies(case)
        meshes = {body.index: body.mesh for body in bodies}
        self.separation = Separation(model, neighbours, meshes, comm, team)
        specs = {i: part.fracture for i, part in enumerate(case.parts) if part.fracture is not None}
        self.initiation = Initiation(model, bodies, specs, self.separation.stars, neighbours, comm, clock, team)
        handover = Handover(model, meshes, neighbours, comm)
        self._update = TopologyUpdate(model, elements, self.initiation, by_node, handover, contact)
        self._insertion = Insertion(case.numerics.dt_safety)
        if neighbours:
            elements.attach(self.initiation.interface)
        self._found: list[Breaking] | None = None
        """Facets that break in this step; the value is None before the search for these facets."""
        self.cohesion: Cohesion | None = None
        if cohesive(case):
            self.cohesion = elements.cohesion = Cohesion(work, team)
            self._unloading = Unloading(self.cohesion, model.nodes, neighbours, comm)

    @property
    def broken(self) -> int:
        """Number of broken facets on all ranks."""
        return self.separation.broken

    @property
    def first(self) -> float:
        """Simulated time at which the first facet of all ranks broke, s; NaN if no facet has broken."""
        return self.separation.first

    def removal(self, case: Case, contact: Contact | None) -> Removal | None:
        """Returns the object that removes tets from bodies that break; None if no part of these bodies erodes."""
        if not wearing(case):
            return None
        of = self._model, self.initiation, self.separation, self.cohesion
        return Removal(*of, self._elements, contact, self._comm)

    def unload(self) -> None:
        """Unloads cohesive facets that would release more energy than they absorbed; to be called before the kick.
        Collective.
        """
        if self.cohesion is not None and self.broken:
            self._unloading.apply(self._clock)

    @property
    def intact(self) -> bool:
        """True if no facet of this rank is cohesive."""
        return self.cohesion is None or not len(self.cohesion.facets.tets)

    def went_on(self, steps: int) -> None:
        """Counts ``steps`` steps in which no face was overstressed."""
        self.initiation.begin_step(steps)

    def find(self, touched: Ints) -> int:
        """Returns the value of this rank for the reduction of the step: NOTHING, OVERSTRESSED or BREAKS. If a part uses
        nodal tractions, the value is BREAKS if a facet may break. Sets ``touched`` (ranks,) for the ranks that have a
        node of a facet that breaks. Collective among neighbours.
        """
        self.initiation.begin_step()
        hot, self._found, touched[:] = self._elements.hot, None, 0
        self.initiation.interface.mark_inner(hot)
        cuts = len(self.separation.cut) > 0
        if self.initiation.smooth:
            return BREAKS if hot or cuts else NOTHING
        self._found = self.initiation.breaking(hot)
        if not (self._found or cuts):
            return OVERSTRESSED if hot else NOTHING
        if not self.initiation.one_by_one:
            self._survey(self._found, touched)
        return BREAKS

    def advance(self, agreed: int, touched: Ints) -> None:
        """Breaks the facets. ``agreed``, ``touched``: maxima over the ranks of the results of ``find``. All ranks must
        call the method. If a part uses nodal tractions or ``order = "local_maximum"``, collective among all ranks, else
        among the touched ranks.
        """
        if agreed >= OVERSTRESSED:
            self._insertion.longest = max(self._insertion.longest, self._clock.stable)
        if agreed < BREAKS:
            return
        found = self.initiation.breaking(self._elements.hot) if self._found is None else self._found
        if self.initiation.one_by_one:
            found = self.initiation.strongest(found)
        if self.initiation.one_by_one or self.initiation.smooth:
            own = np.zeros_like(touched)
            self._survey(found, own)
            self._comm.begin_maximum(own, touched).finish()
        whole = not self.broken
        self._break(found, touched)
        if whole and self.broken:
            self.separation.first = self._clock.t

    def _survey(self, found: list[Breaking], touched: Ints) -> None:
        count = sum(int(b.facets.first.sum()) for b in found)
        self.separation.survey([b.facets.sides for b in found], count, touched)

    def keep(self, parcel: Parcel) -> None:
        """Adds the state of fracture to a parcel (a checkpoint or migration message)."""
        parcel.known["fracture"] = self.broken, self._insertion.longest
        parcel.known["first_break"] = self.first
        self.initiation.keep(parcel)
        if self.cohesion is not None:
            self.cohesion.keep(parcel)

    def resume(self, parcel: Parcel) -> None:
        """Restores the state of fracture from a parcel (a checkpoint or migration message)."""
        self.separation.broken, self._insertion.longest = parcel.known["fracture"]
        self.separation.first = parcel.known.get("first_break", math.nan)
        self.initiation.resume(parcel)
        if self.cohesion is not None:
            self.cohesion.resume(parcel, self._model.nodes)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self.initiation.free()
        if self.cohesion is not None:
            self._unloading.free()

    def _bodies(self, case: Case) -> tuple[list[Body], float, list[str]]:
        """Returns three values: the bodies, the order of magnitude of the work on a facet, J, and warnings about the
        mesh.
        """
        model, bodies, terms = self._model, list[Body](), Terms(case, self._model)
        for index, may in enumerate(breakable(case)):
            here = [(i, block) for i, block in enumerate(model.blocks) if may and block.part == index]
            for i, block in here:
                bodies += facets.bodies_of(i, block, terms.own(index), terms.bonds(index), model.nodes.x0)
        return bodies, terms.work, terms.warnings()

    def _break(self, broken: list[Breaking], touched: Ints) -> None:
        split = self.separation.separate(touched)
        glued = [b.take(b.facets.first) for b in broken if b.body.spec.model == "cohesive"]
        fresh = [self._insertion.facets(b, self._model.nodes, split) for b in glued]
        self._update.apply(broken, split, fresh, self.cohesion)
