"""Fracture initiation in three steps: candidate facets are found by their tractions, filtered by the delayed criterion,
and filtered by the order of breaking.
"""

import numpy as np

from conoid.cases.model.schema import Fracture

from ..clock import Clock
from ..migration.parcel import Parcel
from ..model.moves import Moves
from ..model.rows import MASS
from ..model.state import Flags, Model
from ..model.topology import Split
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..parallel.team import Team
from . import criterion, facets, nodal
from .breaking import Breaking, gathered
from .candidates import CandidateSearch
from .facets import Body
from .interface import Interface
from .order import strongest
from .records import Candidates, FacetTable, Mesh
from .stars import Stars


class Initiation:
    """Search for the facets of one rank that break. The object stores the clocks of the delayed criterion."""

    def __init__(
        self, model: Model, bodies: list[Body], specs: dict[int, Fracture], stars: dict[int, Stars],
        neighbours: list[Neighbour], comm: Comm, clock: Clock, team: Team,
    ) -> None:  # fmt: skip
        """``specs``: specifications of all parts that fracture, also of parts without a tet on this rank; the keys are
        the numbers of the parts. ``stars``: stars of the nodes; the keys are the indices of the blocks of tets.
        ``team``: threads of the rank. Collective.
        """
        self._model, self._neighbours, self._comm, self._clock = model, neighbours, comm, clock
        self.bodies = bodies
        smooth = [part for part, spec in specs.items() if spec.traction == "nodes"]
        self._averaged = [[part] for part in smooth] if len(model.nodes.shares.rank) else [smooth]
        """Groups of parts with nodal tractions. Two parts of a group have no node in common."""
        self.one_by_one = any(spec.order == "local_maximum" for spec in specs.values())
        self._stars = stars
        self.interface = Interface(bodies, neighbours, comm)
        self._search = CandidateSearch(len(bodies), self.interface, team)
        heaviest = np.zeros(len(model.parts))
        for body in bodies:
            heaviest[body.block.part] = body.block.row(MASS).max(initial=0.0)
        self._heaviest = comm.maximum(heaviest)
        """(parts,) mass of the heaviest tet of all ranks at the start, kg; 0 for a part that does not fracture."""
        self._step = 1
        """Number of the step, as stored with the clocks; the number of the first step is 1."""

    @property
    def smooth(self) -> bool:
        """True if the tractions of a part are nodal tractions."""
        return any(self._averaged)

    def begin_step(self, many: int = 1) -> None:
        """Starts the last of the next ``many`` steps; the steps before it had no overstressed facet. If a facet is not
        overstressed in a step, its clock stops.
        """
        self._step += many

    def breaking(self, hot: bool) -> list[Breaking]:
        """Returns the facets of each body that break by the present stress; ``hot``: True if at least one face of this
        rank is overstressed. Collective among neighbours; if a part uses nodal tractions, collective among all ranks.
        """
        if not (hot or self.interface.hot or self.smooth):
            return []
        every = [gathered(body, some, self.interface.facets) for body, some in self.candidates()]
        return [some for some in every if some is not None]

    def candidates(self) -> list[tuple[Body, Candidates]]:
        """Returns the bodies that have candidate facets, and these facets; to be called once in each step, because it
        advances the clocks. The function is collective among the same ranks as ``breaking``.
        """
        self.interface.exchange(self._model.nodes.x)
        x, t = self._model.nodes.x, self._clock.t
        # If a part uses nodal tractions, _of_nodes applies the delayed criterion later.
        steps = [self._step if body.spec.traction == "tets" else 0 for body in self.bodies]
        found = [(body, self._search.find(k, body, x, steps[k], t)) for k, body in enumerate(self.bodies)]
        if self.smooth:
            found = self._smoothed(found)
        return [(body, some) for body, some in found if len(some.place)]

    def strongest(self, broken: list[Breaking]) -> list[Breaking]:
        """Filters the facets that break. In a part with ``order = "local_maximum"`` a facet breaks only if it has the
        largest ratio of traction to strength at all of its nodes. In other parts all facets break. Collective.
        """
        waiting = [b for b in broken if b.body.spec.order == "local_maximum"]
        none = np.zeros(0, np.int64)
        chosen = strongest(
            np.concatenate([none, *(facets.facet_ids(b.body.block, *b.rows.T) for b in waiting)]),
            np.concatenate([np.zeros(0), *(b.load for b in waiting)]),
            np.concatenate([np.zeros((0, 3), np.int32), *(b.facets.nodes for b in waiting)]),
            self._model.nodes.id, self._neighbours, self._comm,
        )  # fmt: skip
        ends: list[Flags] = np.split(chosen, np.cumsum([len(b.facets.first) for b in waiting]))
        left = iter(ends)
        return [b.take(next(left)) if b.body.spec.order == "local_maximum" else b for b in broken]

    def drop(self, block: int, mesh: Mesh, moves: Moves) -> None:
        """Removes tets of the block number ``index``; ``mesh``: record of the block without these tets."""
        some = [body for body in self.bodies if body.index == block]
        table = FacetTable(*(moves.applied(column) for column in some[0].facets))
        for body in some:
            body.mesh, body.facets = mesh, table

    def reconnect(self) -> None:
        """Makes the tables of the facets between ranks and between blocks again, after the removal of tets.
        Collective.
        """
        self.interface.free()
        self.interface = self._search.interface = Interface(self.bodies, self._neighbours, self._comm)

    def follow(self, split: Split) -> None:
        """Updates the bodies after a separation of nodes."""
        for body in self.bodies:
            body.follow(split, self._model.nodes.x0)

    def keep(self, parcel: Parcel) -> None:
        """Adds the clocks and the masses of the heaviest tets to a parcel (a checkpoint or migration message)."""
        tables = [facets.clocks(body, self._step) for body in self.bodies if body.own]
        none = {"tet": np.zeros(0, np.int64), "key": np.zeros(0, np.int64), "since": np.zeros(0)}
        every = {name: np.concatenate([column, *(table[name] for table in tables)]) for name, column in none.items()}
        parcel.rows["fracture.since"] = every
        parcel.known["heaviest"] = self._heaviest

    def resume(self, parcel: Parcel) -> None:
        """Restores the state from a parcel (a checkpoint or migration message)."""
        self._heaviest = parcel.known["heaviest"]
        for body in (body for body in self.bodies if body.own):
            facets.set_clocks(body, parcel.rows["fracture.since"], self._step)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self.interface.free()

    def _smoothed(self, found: list[tuple[Body, Candidates]]) -> list[tuple[Body, Candidates]]:
        """In parts that use nodal tractions, replaces the tractions by tractions from nodal stress. Collective."""
        left = dict[int, Candidates]()
        for parts in self._averaged:
            left |= self._of_nodes([(body, each) for body, each in found if body.own and body.block.part in parts])
        return [(body, left.get(body.index, each) if body.own else each) for body, each in found]

    def _of_nodes(self, some: list[tuple[Body, Candidates]]) -> dict[int, Candidates]:
        """Returns the candidates that remain in bodies with nodal tractions; the keys are the indices of the blocks of
        tets. Collective.
        """
        nodes, left = self._model.nodes, dict[int, Candidates]()
        wanted = np.zeros(nodes.n, bool)
        for body, each in some:
            wanted[body.block.tets[each.place[each.shared < 0]]] = True
        chosen = [(body, self._stars[body.index]) for body, _ in some]
        stress = nodal.stresses(chosen, wanted, nodes, self._heaviest, self._neighbours, self._comm)
        for body, each in some:
            nodal.replace(each, self.interface.facets, body, stress, nodes.x)
            n = criterion.clock(each, len(each.place), body.facets, body.law, self._step, self._clock.t)
            left[body.index] = each.first(n)
        return left
