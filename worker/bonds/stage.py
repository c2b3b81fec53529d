"""Tied bonds between non-matching meshes, in the time step.

The rows (rows.py) are computed from the pieces of the interface (interface.py) and the present corners of their faces:
copies of a separated node are tied by the faces of their tets, and faces of removed tets are no longer tied. Every rank
has the list of all pieces and rows (ties.py). The state of a row is stored on the rank that owns its node (layout.py).
When rows change, the states are sent to all ranks. Contact ignores a candidate pair if one bond ties its nodes
(``Ties.bits``).
"""

import numpy as np

from conoid.cases.model.bonds import TiedBond
from conoid.cases.model.schema import Case

from ..boundaries.boundaries import Boundary, mirrored
from ..clock import Clock
from ..contact.exterior import mobilities
from ..migration.parcel import Parcel
from ..model.state import Floats, Model, Nodes
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.passes import Pass
from ..parallel.team import Team
from ..rigid.stage import Rigid
from . import law, sweeps
from .account import BondAccount
from .layout import Layout, laid_out
from .pieces import Pieces
from .records import DAMAGE
from .rows import one_each
from .ties import Ties


class Bonds:
    """Tied bonds of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, pieces: Pieces, bounds: list[Boundary], rigid: Rigid | None, comm: Comm,
        clock: Clock, team: Team, impulse: float,
    ) -> None:  # fmt: skip
        """``pieces``: pieces of the interface on all ranks; empty for a run that resumes. ``impulse``: bound of the
        impulse on one node in a step, N s. Collective.
        """
        self._rigid = rigid
        self._model, self._bounds, self._comm, self._clock = model, bounds, comm, clock
        self._laws, self._passes = _laws(case), _Passes(team)
        self.account = BondAccount(model.nodes, fixed_point.scale_for(impulse))
        self.ties = Ties(pieces, model, comm)
        self.apart = False
        """True if a tied row of this rank has failed in this step."""
        self._mean_dt = 0.0
        """Time for which the last impulses acted, s."""
        self._layout: Layout | None = None
        self._mass = np.zeros(0)
        """Mass of each node of the layout on this rank, kg, from which the layout was made."""
        if len(pieces):
            self._rebuild()

    @property
    def tied(self) -> int:
        """Number of tied nodes on all ranks."""
        return self.ties.tied

    # The step ------------------------------------------------------------------------------------------------------

    def note(self, state: Nodes) -> None:
        """Adds the second half of the work of the last impulses to the account, and stores v(n-1/2); to be called
        before the kick.
        """
        self.account.note(state.v, self._laid.local)

    def predict(self, state: Nodes) -> None:
        """Applies the impulses of the last step (warm start), so that contact starts from velocities that nearly
        satisfy the bonds; to be called after the kick. Collective.
        """
        layout, mean_dt = self._laid, self._clock.mean_dt
        ratio = mean_dt / self._mean_dt if self._mean_dt > 0.0 else 0.0
        self._mean_dt = mean_dt
        layout.nodes.total[:] = 0
        self._gather(state)
        if layout.rigid is not None:
            layout.rigid.bonds.set_out(layout.nodes.v, self._clock.dt)
        sweeps.resume(layout.rows, layout.nodes, ratio, self.account.scale, 0, len(layout.rows.node))
        self._passes.apply(layout, self.account.scale, walls=False)
        state.v[layout.local] = layout.nodes.v[layout.held]
        if layout.rigid is not None:
            layout.rigid.tied(state)

    def solve(self, state: Nodes, *, touched: bool) -> None:
        """Computes the impulses of the tied nodes and changes v(n+1/2). ``touched``: True if velocities have changed
        since ``predict``. Collective.
        """
        layout, clock = self._laid, self._clock
        if touched:
            self._gather(state)
        if layout.rigid is not None:
            layout.rigid.bonds.set_out(layout.nodes.v, clock.dt)
        self._passes.sweep(layout, clock.mean_dt, clock.dt, self.account.scale)
        failed = law.open_bonds(layout.rows, layout.nodes, clock.mean_dt, clock.dt, 0, len(layout.rows.node))
        self.apart = failed > 0
        state.v[layout.local] = layout.nodes.v[layout.held]
        self.account.add(layout.nodes.total[layout.held])

    def follow(self) -> None:
        """Updates the tied rows after a node has separated, a tet of a face was removed, or a row has failed. A copy
        that has no face of the interface takes mass from a tied node, too. Collective.
        """
        lighter = (self._model.nodes.mass[self._laid.local] != self._mass).any()
        changed = np.array([float(self.apart or lighter or self.ties.faces.changed())])
        if self._comm.maximum(changed)[0] > 0.0:
            self._rebuild()

    # Checkpoint and migration --------------------------------------------------------------------------------------

    def keep(self, parcel: Parcel) -> None:
        """Adds the state of the bonds to a parcel (a checkpoint or migration message)."""
        self.account.keep(parcel)
        parcel.known["bonds"] = self.account.scale, self._mean_dt
        self.ties.keep(parcel, self._layout)

    def resume(self, parcel: Parcel) -> None:
        """Restores the state of the bonds from a parcel (a checkpoint or migration message). Collective."""
        scale, self._mean_dt = parcel.known["bonds"]
        self.account.resume(parcel, scale)
        self.ties.resume(parcel)
        self._lay_out()

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        if self._layout is not None:
            self._layout.messages.free()

    # Private -------------------------------------------------------------------------------------------------------

    @property
    def _laid(self) -> Layout:
        assert self._layout is not None
        return self._layout

    def _gather(self, state: Nodes) -> None:
        """Copies positions and velocities to the table of nodes. Collective."""
        layout = self._laid
        nodes = layout.nodes
        nodes.x[layout.held], nodes.v[layout.held] = state.x[layout.local], state.v[layout.local]
        if not layout.messages.alone:
            layout.messages.copy(nodes.x, nodes.v)

    def _rebuild(self) -> None:
        self.ties.rebuild(self._layout)
        self._lay_out()

    def _lay_out(self) -> None:
        """Makes the layout of the intact tied rows. Collective."""
        self.free()
        intact = self.ties.states[:, DAMAGE] < 1.0
        acts = one_each(self.ties.rows, intact)
        rows, states, nodes = self.ties.rows.take(acts), self.ties.states[acts], self._model.nodes
        planes, mobility = mirrored(nodes.n, self._bounds), mobilities(nodes, self._bounds)
        self.account.mobility = mobility
        self._layout = laid_out(
            rows, states, self._laws, nodes, mobility, planes, self._rigid, self.account.scale, self._comm
        )  # fmt: skip
        self._layout.number = np.flatnonzero(acts)[self._layout.number]
        self._mass = nodes.mass[self._layout.local]
        self.apart = False
        self.ties.mark(self.ties.rows.take(intact))


class _Passes:
    """Sweeps over a layout; the threads of a rank share them."""

    def __init__(self, team: Team) -> None:
        some = sweeps.TASK_SIZE
        self._team = team
        self._act = Pass(team, sweeps.act_task, *sweeps.ACT, size=some)
        self._give = Pass(team, sweeps.give_task, *sweeps.GIVE, size=some)
        self._move = Pass(team, sweeps.move_task, *sweeps.MOVE, size=some)

    def sweep(self, layout: Layout, mean_dt: float, dt: float, scale: float) -> None:
        """Runs all sweeps of a step; ``scale``: quanta per N s. Collective."""
        rows, nodes = layout.rows, layout.nodes
        if layout.messages.alone and self._team.threads == 1 and layout.rigid is None:
            sweeps.sweep_all(rows, nodes, layout.momentum, mean_dt, dt, scale, layout.sweeps)
            return
        for k in range(layout.sweeps):
            ahead = layout.momentum if k + 1 < layout.sweeps else 0.0
            self._act.run(len(rows.node), rows, nodes, ahead, mean_dt, dt, scale)
            self.apply(layout, scale, walls=True)

    def apply(self, layout: Layout, scale: float, *, walls: bool) -> None:
        """Adds the changes of the impulses to the velocities. ``walls``: True if walls stop the rigid bodies.
        Collective.
        """
        n = len(layout.nodes.v)
        self._give.run(n, layout.rows, layout.nodes, scale)
        if not layout.messages.alone:
            layout.messages.complete(layout.nodes.words)
        self._move.run(n, layout.nodes, scale)
        if layout.rigid is not None:
            layout.rigid.bonds.give(layout.nodes.v, layout.nodes.words, walls=walls)


def _laws(case: Case) -> Floats:
    """Returns the table ``laws`` (bonds, 5), see records.TiedRows."""
    laws = np.zeros((len(case.bond), 5))
    for k, bond in enumerate(case.bond):
        if isinstance(bond, TiedBond) and bond.breaks:
            laws[k] = *bond.strengths, *bond.energies, 1.0
    return laws
