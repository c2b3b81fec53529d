"""Search for the candidates of the fracture criterion in a body, on the threads of a rank."""

from ..model.growing import Scratch
from ..model.state import Floats
from ..parallel.packing import offsets
from ..parallel.passes import Pass
from ..parallel.team import Team
from . import criterion, tasks
from .facets import Body
from .interface import Interface
from .records import Candidates


class CandidateSearch:
    """Finds the candidate facets of bodies. A first pass counts the overstressed facets of each task; a second pass
    writes the candidates among the overstressed facets.
    """

    def __init__(self, bodies: int, interface: Interface, team: Team) -> None:
        """``bodies``: number of bodies; ``interface``: the facets that are shared with other ranks and blocks."""
        self.interface = interface
        self._count = Pass(team, tasks.count, *tasks.COUNT, size=tasks.TETS_OF_A_TASK)
        self._search = Pass(team, tasks.search, *tasks.SEARCH, size=tasks.TETS_OF_A_TASK)
        self._scratch = Scratch()
        self._rooms = [Candidates.of(0) for _ in range(bodies)]
        """Arrays for the candidate facets of each body. The next search in the same body overwrites them."""

    def find(self, k: int, body: Body, x: Floats, step: int, t: float) -> Candidates:
        """Returns the candidate facets of body number ``k`` that break in step number ``step`` at time ``t``, s. A
        facet breaks if the clock of its delayed criterion has run long enough. If ``step`` is 0, the function returns
        all candidate facets. ``x`` (nodes, 3): positions, m.
        """
        rows, mesh, table, law, hot = self.interface.of_body[k], body.mesh, body.facets, body.law, body.hot
        many = self._count.many(len(hot))
        begins, counts = self._scratch.of(f"begins {k}", many), self._scratch.of(f"counts {k}", many)
        self._count.run(len(hot), self._rooms[k], hot, mesh, counts)
        needed = int(offsets(begins, counts)) + len(rows)
        if needed > len(self._rooms[k].place):
            self._rooms[k] = Candidates.of(2 * needed)
        room = self._rooms[k]
        self._search.run(len(hot), room, begins, counts, hot, mesh, table, x, law)
        n = criterion.breaking(room, begins, counts, self.interface.facets, rows, mesh, table, x, law, step, t)
        return room.first(int(n))
