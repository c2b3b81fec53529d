"""Passes of the solver, shared among the threads of a rank: by sets of contacts (zones.py), and by slots."""

from ...kernels.jit import Kernel
from ...model.state import Ints
from ...parallel.arguments import Arguments
from ...parallel.passes import Pass
from ...parallel.team import Stage, Team
from .. import tasks
from ..tasks import CONTACTS_OF_A_TASK, SLOTS_OF_A_TASK
from . import zones
from .shared_sums import ActiveSum


class Sets:
    """Runs kernels over the sets of active contacts; each kernel has its own table of arguments."""

    def __init__(self, team: Team, many: int) -> None:
        """``many``: number of zones."""
        self._team = team
        self._border, self._inner = zones.tasks(many)
        self.weigh, self.resume = Arguments(*tasks.WEIGH), Arguments(*tasks.RESUME)
        self.sweep, self.store = Arguments(*tasks.SWEEP), Arguments(*tasks.STORE)
        self.cost = Arguments(*tasks.COST)

    def run(self, kernel: Kernel, table: int) -> None:
        """Runs ``kernel`` over all contacts; ``table``: its arguments."""
        self._team.run(kernel, table, *self._border)
        self._team.run(kernel, table, *self._inner)

    def inner(self, kernel: Kernel, table: int) -> Stage:
        """Returns the tasks of contacts without shared slots as a stage of a program of the team of threads."""
        return Stage(kernel, table, *self._inner)

    def repeat(self, stages: list[Stage], rounds: int) -> None:
        """Runs a program of stages on the team of threads: see ``Team.repeat``."""
        self._team.repeat(stages, rounds)

    def complete(self, kernel: Kernel, table: int, shared: ActiveSum, words: Ints, first: int, columns: int) -> None:
        """Runs ``kernel`` over all contacts and completes ``columns`` columns of ``words`` over the ranks. Contacts
        without shared slots are computed while the sums of contacts with shared slots are exchanged.
        """
        if not len(shared.shared):
            self._team.run(kernel, table, *self._inner)
            return
        self._team.run(kernel, table, *self._border)
        shared.begin(words, first, columns)
        self._team.run(kernel, table, *self._inner)
        shared.finish(words, first, columns)


class Slots:
    """Passes over active contacts and their slots."""

    def __init__(self, team: Team) -> None:
        some, of_slots = CONTACTS_OF_A_TASK, SLOTS_OF_A_TASK
        self.mark = Pass(team, tasks.mark, *tasks.MARK, size=some)
        self.sort = Pass(team, tasks.sort, *tasks.SORT, size=some)
        self.load = Pass(team, tasks.load, *tasks.LOAD, size=of_slots)
        self.give = Pass(team, tasks.give, *tasks.GIVE, size=of_slots)
        self.brace = Pass(team, tasks.brace, *tasks.BRACE, size=1)
        self.leave = Pass(team, tasks.leave, *tasks.LEAVE, size=of_slots)
