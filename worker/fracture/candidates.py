"""Search for the candidates of the fracture criterion in a body, on the threads of a rank."""

from ..model.growing import Scratch
from ..model.state import Floats
from ..parallel.passes import Pass
from ..parallel.team import Team
from . import criterion, tasks
from .facets import Body
from .interface import Interface
from .records import Candidates


class CandidateSearch:
    """Finds the candidates of bodies. Each task has rows of its own for the facets that it finds."""

    def __init__(self, bodies: int, interface: Interface, team: Team) -> None:
        """``bodies``: number of bodies; ``interface``: facets shared with other ranks and blocks."""
        self._interface = interface
        self._pass = Pass(team, tasks.search, *tasks.SEARCH, size=tasks.TETS_OF_A_TASK)
        self._scratch = Scratch()
        self._rows_of_task = 64
        """Number of rows reserved for each task."""
        self._rooms = [Candidates.of(0) for _ in range(bodies)]
        """Arrays for the candidates of each body; the content is valid until the next search in the body."""

    def find(self, k: int, body: Body, x: Floats, step: int, t: float) -> Candidates:
        """Returns the candidates of the ``body`` with number ``k`` that break by their clocks in step number ``step``
        at time ``t``, s; all candidates if ``step`` is 0. ``x`` (nodes, 3): positions, m.
        """
        rows, mesh, table, law = self._interface.of_body[k], body.mesh, body.facets, body.law
        many = self._pass.many(len(body.hot))
        needed, counts = self._scratch.of("needed", many), self._scratch.of("counts", many)
        while True:
            each, room = self._rows_of_task, self._rooms[k]
            if len(room.place) < many * each + len(rows):
                room = self._rooms[k] = Candidates.of(many * each + len(rows))
            self._pass.run(len(body.hot), room, each, body.hot, mesh, table, x, law, needed, counts)
            if needed.max(initial=0) <= each:
                break
            self._rows_of_task = 2 * int(needed.max())
        n = criterion.breaking(room, counts, each, self._interface.facets, rows, mesh, table, x, law, step, t)
        return room.first(int(n))
