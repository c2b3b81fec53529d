"""Tied bonds between non-matching meshes, in the time step.

The rows (rows.py) follow from the pieces of the interface (interface.py) and the present corners of their faces:
copies of a separated node are tied by their own faces, and faces of removed tets are no longer tied. Every rank has
the list of all pieces and rows; the state of a row is on the rank that owns its node, and is sent to all ranks when
rows change. Contact ignores pairs whose nodes are tied by one bond (``bits``).
"""

import numpy as np

from conoid.cases.model.bonds import TiedBond
from conoid.cases.model.schema import Case

from ..boundaries.boundaries import Boundary, mirrored
from ..clock import Clock
from ..contact.exterior import mobilities
from ..migration.parcel import Parcel
from ..model.ids import places
from ..model.state import Floats, Indices, Ints, Model, Nodes, extended
from ..model.topology import Split
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.passes import Pass
from ..parallel.team import Team
from . import law, sweeps
from .faces import Faces
from .layout import Layout, laid_out
from .pieces import Pieces
from .records import DAMAGE, KEPT, PUSH
from .rows import Rows, assembled

_BITS = 62
"""Bonds that contact distinguishes; further ones share a bit."""


class Bonds:
    """Tied bonds of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, pieces: Pieces, bounds: list[Boundary], comm: Comm, clock: Clock, team: Team,
        impulse: float,
    ) -> None:  # fmt: skip
        """``pieces``: of all ranks; none for a run that resumes. ``impulse``: bound of the impulse on one node in a
        step, N s. Collective.
        """
        self._model, self._bounds, self._comm, self._clock, self._team = model, bounds, comm, clock, team
        self._laws, self._scale, n = _laws(case), fixed_point.scale_for(impulse), model.nodes.n
        self.loss, self.external = np.zeros((2, n))
        """(nodes,) energy dissipated by the bonds, and work from outside by prescribed velocities against them, J."""
        self.apart = False
        """True if a row of this rank has failed in the step."""
        self._local: Indices = np.zeros(0, np.int32)
        self._total, self._before, self._mean_dt = np.zeros((0, 3), np.int64), np.zeros((0, 3)), 0.0
        some = sweeps.TASK_SIZE
        self._act = Pass(team, sweeps.act_task, *sweeps.ACT, size=some)
        self._give = Pass(team, sweeps.give_task, *sweeps.GIVE, size=some)
        self._move = Pass(team, sweeps.move_task, *sweeps.MOVE, size=some)
        self._layout: Layout | None = None
        self.version = 0
        """Number that increases when rows change."""
        self._laid_mobility: Floats = np.zeros((0, 3))
        self._set(pieces)
        if len(pieces):
            self._rebuild()

    @property
    def tied(self) -> int:
        """Number of tied nodes of all ranks."""
        return int((self._states[:, DAMAGE] < 1.0).sum())

    def bits(self, ids: Ints) -> Ints:
        """(k,) bonds that tie each node, as bits."""
        at = places(self._known, ids)
        return np.where(at >= 0, self._bits[at], 0) if len(self._known) else np.zeros(len(ids), np.int64)

    # The step ------------------------------------------------------------------------------------------------------

    def note(self, state: Nodes) -> None:
        """Before the kick: books the second half of the work of the last impulses, and stores v(n-1/2)."""
        self._before = state.v[self._local]
        self._book()
        layout = self._laid
        self._local, self._before = layout.local, state.v[layout.local]

    def predict(self, state: Nodes) -> None:
        """After the kick: applies the impulses of the last step (warm start), so that contact starts from velocities
        at which the bonds nearly hold. Collective.
        """
        layout, mean_dt = self._laid, self._clock.mean_dt
        ratio = mean_dt / self._mean_dt if self._mean_dt > 0.0 else 0.0
        self._mean_dt = mean_dt
        layout.nodes.total[:] = 0
        self._gather(state)
        sweeps.resume(layout.rows, layout.nodes, ratio, self._scale, 0, len(layout.rows.node))
        self._apply()
        state.v[layout.local] = layout.nodes.v[layout.held]

    def solve(self, state: Nodes, *, touched: bool) -> None:
        """Solves for the impulses of the tied nodes in v(n+1/2); ``touched``: True if velocities have changed since
        ``predict``. Collective.
        """
        layout, clock = self._laid, self._clock
        if touched:
            self._gather(state)
        steps = clock.mean_dt, clock.dt
        if layout.messages.alone and self._team.threads == 1:
            sweeps.sweep_all(layout.rows, layout.nodes, layout.momentum, *steps, self._scale, layout.sweeps)
        else:
            for k in range(layout.sweeps):
                ahead = layout.momentum if k + 1 < layout.sweeps else 0.0
                self._act.run(len(layout.rows.node), layout.rows, layout.nodes, ahead, *steps, self._scale)
                self._apply()
        self.apart = law.open_bonds(layout.rows, layout.nodes, *steps, 0, len(layout.rows.node)) > 0
        state.v[layout.local] = layout.nodes.v[layout.held]
        self._total = layout.nodes.total[layout.held]
        self._book()

    def follow(self) -> None:
        """Updates the rows after a node of a face has separated, a tet of a face was removed, or a row has failed.
        Collective.
        """
        changed = np.array([float(self.apart or self._faces.changed())])
        if self._comm.maximum(changed)[0] > 0.0:
            self._rebuild()

    def grow(self, split: Split, ids: Ints) -> None:
        """Extends the accounts by the copies of nodes; booked values stay with the parents."""
        more = np.zeros(split.copies.n)
        self.loss, self.external = extended(self.loss, more), extended(self.external, more)

    # Checkpoint and migration --------------------------------------------------------------------------------------

    def keep(self, parcel: Parcel) -> None:
        """Adds the state to a parcel."""
        nodes, rows = self._model.nodes, self._rows
        impulse = np.zeros((nodes.n, 3), np.int64)
        impulse[self._local] = self._total
        parcel.nodes |= {"bonds.loss": self.loss, "bonds.external": self.external, "bonds.impulse": impulse}
        parcel.known["bonds"] = self._scale, self._mean_dt
        pieces = self._pieces.take(self._faces.here(self._pieces.slave))
        parcel.rows["bonds.pieces"] = {"tet": pieces.slave // 4, **pieces.table()}
        place = nodes.places(rows.node)
        mine = np.flatnonzero((place >= 0) & nodes.owned[place])
        parcel.rows["bonds.rows"] = {
            "node": rows.node[mine], "bond": rows.bond[mine], "state": self._evolved()[mine],
        }  # fmt: skip

    def resume(self, parcel: Parcel) -> None:
        """Restores the state from a parcel. Collective."""
        self._scale, self._mean_dt = parcel.known["bonds"]
        self.loss, self.external = (np.array(parcel.nodes[f"bonds.{name}"]) for name in ("loss", "external"))
        impulse = parcel.nodes["bonds.impulse"]
        self._local = np.flatnonzero(impulse.any(axis=1)).astype(np.int32)
        self._total = impulse[self._local]
        self._set(Pieces.of(self._comm.share(parcel.rows["bonds.pieces"])))
        tables = [table for table in self._comm.share(parcel.rows["bonds.rows"]) if table]
        none = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, KEPT))
        self._rebuild([none, *((table["bond"], table["node"], table["state"]) for table in tables)])

    def free(self) -> None:
        """Frees the persistent messages."""
        if self._layout is not None:
            self._layout.messages.free()

    # Private -------------------------------------------------------------------------------------------------------

    @property
    def _laid(self) -> Layout:
        assert self._layout is not None
        return self._layout

    def _set(self, pieces: Pieces) -> None:
        self._pieces = pieces
        self._faces = Faces(np.unique(np.concatenate([pieces.slave, pieces.master])), self._model)
        none = np.zeros(0, np.int64)
        self._rows = assembled(Pieces.none(), np.zeros((0, 3), np.int64), np.zeros((0, 3), np.int64))
        self._states = np.zeros((0, KEPT))
        self._known = self._bits = none

    def _gather(self, state: Nodes) -> None:
        layout = self._laid
        nodes = layout.nodes
        nodes.x[layout.held], nodes.v[layout.held] = state.x[layout.local], state.v[layout.local]
        if not layout.messages.alone:
            layout.messages.copy(nodes.x, nodes.v)

    def _apply(self) -> None:
        """Converts the changes of the impulses to velocities."""
        layout, n = self._laid, len(self._laid.nodes.v)
        self._give.run(n, layout.rows, layout.nodes, self._scale)
        if not layout.messages.alone:
            layout.messages.complete(layout.nodes.words)
        self._move.run(n, layout.nodes, self._scale)

    def _book(self) -> None:
        """Books half of the work of the impulses of a step, with v(n-1/2)."""
        held = self._laid_mobility[self._local]
        sweeps.book(self.loss, self.external, self._local, self._before, self._total, held, self._scale)

    def _evolved(self) -> Floats:
        """(rows, KEPT) states of all rows; up to date for the rows of this rank."""
        states = self._states.copy()
        if self._layout is not None:
            states[self._layout.number] = self._layout.rows.state[:, :KEPT]
        return states

    def _joined_states(self) -> Floats:
        """Returns the states of all rows, up to date, on all ranks. Collective."""
        layout = self._layout
        if layout is None:
            return self._states
        words = np.column_stack([layout.number, layout.rows.state[:, :KEPT].copy().view(np.int64)])
        every, states = self._comm.join(words).reshape(-1, 1 + KEPT), self._states.copy()
        states[every[:, 0]] = np.ascontiguousarray(every[:, 1:]).view(np.float64)
        return states

    def _rebuild(self, known: list[tuple[Ints, Ints, Floats]] | None = None) -> None:
        """Makes the rows from the pieces and present corners; ``known``: bonds, nodes and states of rows from a
        parcel. Collective.
        """
        pieces, old, states = self._pieces, self._faces.of(self._pieces.slave), self._joined_states()
        self._faces.follow(self._comm)
        left = self._left(pieces)
        self._pieces, old = pieces.take(left), old[left]
        now = self._faces.of(self._pieces.slave)
        rows = assembled(self._pieces, now, self._faces.of(self._pieces.master))
        if known is None:
            carried = _carried(rows, self._rows, states, self._pieces.bond, now, old)
        else:
            bond, node, found = (np.concatenate(columns) for columns in zip(*known, strict=True))
            carried = _of(rows.bond, rows.node, bond, node, found)
        self._rows, self._states = rows, carried
        self._lay_out()

    def _left(self, pieces: Pieces) -> "np.ndarray":
        """Returns which pieces belong to tied faces that still have all their pieces."""
        whole = (self._faces.of(pieces.slave)[:, 0] >= 0) & (self._faces.of(pieces.master)[:, 0] >= 0)
        _, of = np.unique(np.column_stack([pieces.bond, pieces.slave]), axis=0, return_inverse=True)
        of = of.reshape(-1)
        return np.asarray(np.bincount(of, whole)[of] == pieces.of_face)

    def _lay_out(self) -> None:
        if self._layout is not None:
            self._layout.messages.free()
        alive = self._states[:, DAMAGE] < 1.0
        rows, nodes = self._rows.take(alive), self._model.nodes
        planes, self._laid_mobility = mirrored(nodes.n, self._bounds), mobilities(nodes, self._bounds)
        states, mobility = self._states[alive], self._laid_mobility
        self._layout = laid_out(rows, states, self._laws, nodes, mobility, planes, self._comm)
        self._layout.number = np.flatnonzero(alive)[self._layout.number]
        self.apart = False
        self._mark(rows)

    def _mark(self, rows: Rows) -> None:
        """Sets the bits of nodes that contact ignores with each other: nodes of rows, and corners of tied faces that
        lie beside the mortar side.
        """
        corner, bond = rows.face.reshape(-1), np.repeat(rows.bond[rows.side], 3)
        beside = ~np.isin(corner, self._rows.node)
        ids = np.concatenate([rows.node, rows.master, corner[beside]])
        bonds = np.concatenate([rows.bond, rows.bond[rows.row], bond[beside]])
        self._known, at = np.unique(ids, return_inverse=True)
        self._bits = np.zeros(len(self._known), np.int64)
        np.bitwise_or.at(self._bits, at, np.int64(1) << (bonds % _BITS))
        self.version += 1


def _laws(case: Case) -> Floats:
    """(bonds, 5) see records.TiedRows."""
    laws = np.zeros((len(case.bond), 5))
    for k, bond in enumerate(case.bond):
        if isinstance(bond, TiedBond) and bond.breaks:
            laws[k] = *bond.strengths, *bond.energies, 1.0
    return laws


def _of(bonds: Ints, nodes: Ints, bond: Ints, node: Ints, states: Floats) -> Floats:
    """States by ``bonds`` and ``nodes`` (k,), taken from those of each ``bond`` and ``node`` (r,); zero for rows
    without one.
    """
    many = int(max(nodes.max(initial=0), node.max(initial=0))) + 1
    keys, wanted = bond * many + node, bonds * many + nodes
    order = np.argsort(keys, kind="stable")
    at = places(keys[order], wanted)
    found = np.zeros((len(wanted), states.shape[1]))
    found[at >= 0] = states[order[at[at >= 0]]]
    return found


def _carried(rows: Rows, old: Rows, states: Floats, bond: Ints, now: Ints, before: Ints) -> Floats:
    """States of ``rows`` from those of the ``old`` ones: a copy inherits from its parent, found by the corners of
    tied faces ``now`` and ``before`` (p, 3); the impulse in proportion to the area.
    """
    pairs = np.unique(np.column_stack([np.repeat(bond, 3), now.reshape(-1), before.reshape(-1)]), axis=0)
    parents = _of(pairs[:, 0], pairs[:, 2], old.bond, old.node, np.column_stack([states, old.area]))
    found = _of(rows.bond, rows.node, pairs[:, 0], pairs[:, 1], parents)
    area = found[:, KEPT]
    found[:, PUSH : PUSH + 3] *= np.where(area > 0.0, rows.area / np.where(area > 0.0, area, 1.0), 0.0)[:, None]
    return np.ascontiguousarray(found[:, :KEPT])
