"""Fracture in the time step: which facets break, what separates, and what that changes everywhere else.

At the end of a step, with the stress of n+1 at hand: facets that pass the criterion break; nodes whose star has come
apart become copies; the forces that the tets of a copy have given to its parent are handed over, in integers; and every
table by node takes up the copies. In ``cohesive`` parts a facet keeps its traction when it breaks and gives it up with
the opening.

What breaks, and which ranks it concerns, rides in the reduction of the step: ``find`` comes before it, ``advance``
after it. A rank near which nothing is overstressed finds that out from the words of its neighbours; one that has
neither a node of what breaks nor a copy of the surface of a rank that has some goes on with the next step at once.
"""

import numpy as np

from conoid.cases.model.joined import breakable, cohesive
from conoid.cases.model.schema import Case

from ..clock import Clock
from ..contact.stage import Contact
from ..elements.forms import Elements
from ..migration.parcel import Parcel
from ..model.state import Ints, Model
from ..model.topology import KeptByNode
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from . import facets
from .breaking import Breaking
from .cohesive import Cohesion
from .facets import Body
from .handover import Handover
from .initiation import Initiation
from .insertion import Insertion
from .release import Release
from .separation import Separation
from .terms import Terms
from .update import TopologyUpdate

NOTHING, OVERSTRESSED, BREAKS = range(3)
"""What the ranks agree on in a step by their maximum: no face is overstressed; some are; facets break, or may."""


class Fracture:
    """The fracture of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], elements: Elements, by_node: list[KeptByNode],
        contact: Contact | None, comm: Comm, clock: Clock,
    ) -> None:  # fmt: skip
        """``by_node``: besides the elements, what has arrays by node. All ranks take part."""
        self._model, self._elements, self._clock, self._comm = model, elements, clock, comm
        bodies, work, self.warnings = self._armed(case)
        meshes = {body.index: body.mesh for body in bodies}
        self.separation = Separation(model, neighbours, meshes, comm)
        specs = {i: part.fracture for i, part in enumerate(case.parts) if part.fracture is not None}
        self.initiation = Initiation(model, bodies, specs, self.separation.stars, neighbours, comm, clock)
        handover = Handover(model, meshes, neighbours, comm)
        self._update = TopologyUpdate(model, elements, self.initiation, by_node, handover, contact)
        self._insertion = Insertion(case.numerics.dt_safety)
        if neighbours:
            elements.employ(self.initiation.interface)
        self._found: list[Breaking] | None = None
        """What breaks in this step; None before that is known."""
        self.cohesion: Cohesion | None = None
        if cohesive(case):
            self.cohesion = elements.cohesion = Cohesion(work)
            self._release = Release(self.cohesion, model.nodes, neighbours, comm)

    @property
    def broken(self) -> int:
        """Facets of all ranks that have broken."""
        return self.separation.broken

    def unload(self) -> None:
        """Before the forces of the present act: cohesive facets give up what they would not be paid for; all ranks
        take part.
        """
        if self.cohesion is not None and self.broken:
            self._release.apply(self._clock)

    def find(self, touched: Ints) -> int:
        """What this rank has to say in the reduction of the step: with nodal tractions whether something may break,
        else whether something does, and in ``touched`` (ranks,) whom that concerns. Neighbours take part.
        """
        self.initiation.begin_step()
        hot, self._found, touched[:] = self._elements.hot, None, 0
        self.initiation.interface.look(hot)
        if self.initiation.smooth:
            return BREAKS if hot else NOTHING
        self._found = self.initiation.breaking(hot)
        if not self._found:
            return OVERSTRESSED if hot else NOTHING
        if not self.initiation.one_by_one:
            self._survey(self._found, touched)
        return BREAKS

    def advance(self, agreed: int, touched: Ints) -> None:
        """Breaks what the stress of the present has overcome; ``agreed``, ``touched``: the maximum of what the ranks
        had to say. Called on all ranks: all take part where nodal tractions or the order ``local_maximum`` are asked
        for, else those whom the break concerns.
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
        self._break(found, touched)

    def _survey(self, found: list[Breaking], touched: Ints) -> None:
        count = sum(int(b.facets.first.sum()) for b in found)
        self.separation.survey([b.facets.sides for b in found], count, touched)

    def keep(self, parcel: Parcel) -> None:
        """Adds what fracture must remember to a parcel."""
        parcel.known["fracture"] = self.broken, self._insertion.longest
        self.initiation.keep(parcel)
        if self.cohesion is not None:
            self.cohesion.keep(parcel)

    def resume(self, parcel: Parcel) -> None:
        """Takes it back."""
        self.separation.broken, self._insertion.longest = parcel.known["fracture"]
        self.initiation.resume(parcel)
        if self.cohesion is not None:
            self.cohesion.resume(parcel, self._model.nodes)

    def free(self) -> None:
        """Gives the messages back to MPI."""
        self.initiation.free()
        if self.cohesion is not None:
            self._release.free()

    def _armed(self, case: Case) -> tuple[list[Body], float, list[str]]:
        """The bodies, the order of magnitude of the work on a facet, J, and what the user should know of the mesh."""
        model, bodies, terms = self._model, list[Body](), Terms(case, self._model)
        for index, may in enumerate(breakable(case)):
            here = [(i, block) for i, block in enumerate(model.blocks) if may and block.part == index]
            for i, block in here:
                bodies += facets.arm(i, block, terms.own(index), terms.bonds(index), model.nodes.x0)
        return bodies, terms.work, terms.warnings()

    def _break(self, broken: list[Breaking], touched: Ints) -> None:
        split = self.separation.separate(touched)
        glued = [b.take(b.facets.first) for b in broken if b.body.spec.model == "cohesive"]
        fresh = [self._insertion.facets(b, self._model.nodes, split) for b in glued]
        self._update.apply(broken, split, fresh, self.cohesion)
