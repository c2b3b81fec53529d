"""Tied rows of all ranks; they are updated from the pieces of the interface and the present corners of their faces."""

import numpy as np

from ..migration.parcel import Parcel
from ..model.ids import places
from ..model.state import Flags, Floats, Ints, Model
from ..parallel.comm import Comm
from .faces import Faces
from .layout import Layout
from .pieces import Pieces
from .records import DAMAGE, KEPT, PUSH
from .rows import Rows, assembled

_BITS = 62
"""Number of bonds that have a bit of their own, by which contact distinguishes them. All further bonds share one
bit."""
Known = tuple[Ints, Ints, Floats]
"""Bonds (r,), nodes (r,) and states (r, KEPT) of tied rows."""


class Ties:
    """Pieces, tied rows and states of the tied bonds of a case. All ranks have equal values."""

    def __init__(self, pieces: Pieces, model: Model, comm: Comm) -> None:
        """``pieces``: pieces of the interface on all ranks."""
        self._model, self._comm = model, comm
        self.version = 0
        """Number that increases by each change of the tied rows."""
        self._set(pieces)

    def _set(self, pieces: Pieces) -> None:
        self._pieces = pieces
        self.faces = Faces(np.unique(np.concatenate([pieces.slave, pieces.master])), self._model)
        self.rows = assembled(Pieces.none(), np.zeros((0, 3), np.int64), np.zeros((0, 3), np.int64))
        self.states = np.zeros((0, KEPT))
        """(rows, KEPT) states at the last change of the tied rows."""
        self._tied = self._bits = np.zeros(0, np.int64)

    @property
    def tied(self) -> int:
        """Number of tied nodes on all ranks."""
        return int((self.states[:, DAMAGE] < 1.0).sum())

    def bits(self, ids: Ints) -> Ints:
        """(k,) bonds that tie each node, as one bit for each bond."""
        at = places(self._tied, ids)
        return np.where(at >= 0, self._bits[at], 0) if len(self._tied) else np.zeros(len(ids), np.int64)

    def rebuild(self, layout: Layout | None, known: list[Known] | None = None) -> None:
        """Makes the tied rows from the pieces and the present corners of their faces. ``layout``: present rows of this
        rank; ``known``: states of rows from a parcel (a checkpoint or migration message). Collective.
        """
        pieces, old, states = self._pieces, self.faces.of(self._pieces.slave), self._joined_states(layout)
        self.faces.follow(self._comm)
        left = self._left(pieces)
        self._pieces, old = pieces.take(left), old[left]
        now = self.faces.of(self._pieces.slave)
        rows = assembled(self._pieces, now, self.faces.of(self._pieces.master))
        if known is None:
            carried = _carried(rows, self.rows, states, self._pieces.bond, now, old)
        else:
            bond, node, found = (np.concatenate(columns) for columns in zip(*known, strict=True))
            carried = _of(rows.bond, rows.node, bond, node, found)
        self.rows, self.states = rows, carried

    def mark(self, rows: Rows) -> None:
        """Sets the bits by which contact ignores pairs of tied nodes. Bits are set at the nodes of the intact ``rows``,
        and at corners of tied faces that lie beside the mortar side.
        """
        corner, bond = rows.face.reshape(-1), np.repeat(rows.bond[rows.side], 3)
        beside = ~np.isin(corner, self.rows.node)
        ids = np.concatenate([rows.node, rows.master, corner[beside]])
        bonds = np.concatenate([rows.bond, rows.bond[rows.row], bond[beside]])
        self._tied, at = np.unique(ids, return_inverse=True)
        self._bits = np.zeros(len(self._tied), np.int64)
        np.bitwise_or.at(self._bits, at, np.int64(1) << (bonds % _BITS))
        self.version += 1

    def keep(self, parcel: Parcel, layout: Layout | None) -> None:
        """Adds the pieces, and the tied rows of this rank, to a parcel (a checkpoint or migration message)."""
        nodes, rows = self._model.nodes, self.rows
        pieces = self._pieces.take(self.faces.here(self._pieces.slave))
        parcel.rows["bonds.pieces"] = {"tet": pieces.slave // 4, **pieces.table()}
        place = nodes.places(rows.node)
        mine = np.flatnonzero((place >= 0) & nodes.owned[place])
        states = self._own_states(layout)
        parcel.rows["bonds.rows"] = {"node": rows.node[mine], "bond": rows.bond[mine], "state": states[mine]}

    def resume(self, parcel: Parcel) -> None:
        """Restores the pieces and the tied rows from a parcel (a checkpoint or migration message). Collective."""
        self._set(Pieces.of(self._comm.share(parcel.rows["bonds.pieces"])))
        tables = [table for table in self._comm.share(parcel.rows["bonds.rows"]) if table]
        none = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, KEPT))
        self.rebuild(None, [none, *((table["bond"], table["node"], table["state"]) for table in tables)])

    def _own_states(self, layout: Layout | None) -> Floats:
        """(rows, KEPT) states of all tied rows. Only the states of the rows of this rank are up to date."""
        states = self.states.copy()
        if layout is not None:
            states[layout.number] = layout.rows.state[:, :KEPT]
        return states

    def _joined_states(self, layout: Layout | None) -> Floats:
        """(rows, KEPT) up-to-date states of the tied rows of all ranks. Collective."""
        if layout is None:
            return self.states
        words = np.column_stack([layout.number, layout.rows.state[:, :KEPT].copy().view(np.int64)])
        every, states = self._comm.join(words).reshape(-1, 1 + KEPT), self.states.copy()
        states[every[:, 0]] = np.ascontiguousarray(every[:, 1:]).view(np.float64)
        return states

    def _left(self, pieces: Pieces) -> Flags:
        """Returns True for each piece whose tied face still has all its pieces."""
        whole = (self.faces.of(pieces.slave)[:, 0] >= 0) & (self.faces.of(pieces.master)[:, 0] >= 0)
        _, of = np.unique(np.column_stack([pieces.bond, pieces.slave]), axis=0, return_inverse=True)
        of = of.reshape(-1)
        return np.asarray(np.bincount(of, whole)[of] == pieces.of_face)


def _of(bonds: Ints, nodes: Ints, bond: Ints, node: Ints, states: Floats) -> Floats:
    """Returns the states of the rows with the given ``bonds`` and ``nodes`` (k,); The states are selected from
    ``states``, whose rows belong to ``bond`` and ``node`` (r,). The state of a row that is not found is zero.
    """
    many = int(max(nodes.max(initial=0), node.max(initial=0))) + 1
    keys, wanted = bond * many + node, bonds * many + nodes
    order = np.argsort(keys, kind="stable")
    at = places(keys[order], wanted)
    found = np.zeros((len(wanted), states.shape[1]))
    found[at >= 0] = states[order[at[at >= 0]]]
    return found


def _carried(rows: Rows, old: Rows, states: Floats, bond: Ints, now: Ints, before: Ints) -> Floats:
    """Returns the states of the new ``rows``, copied from the ``states`` of the ``old`` rows. A copy of a node inherits
    from its parent, which is found by the corners of the tied faces ``now`` and ``before`` (p, 3). The impulse that a
    copy inherits is proportional to its area.
    """
    pairs = np.unique(np.column_stack([np.repeat(bond, 3), now.reshape(-1), before.reshape(-1)]), axis=0)
    parents = _of(pairs[:, 0], pairs[:, 2], old.bond, old.node, np.column_stack([states, old.area]))
    found = _of(rows.bond, rows.node, pairs[:, 0], pairs[:, 1], parents)
    area = found[:, KEPT]
    found[:, PUSH : PUSH + 3] *= np.where(area > 0.0, rows.area / np.where(area > 0.0, area, 1.0), 0.0)[:, None]
    return np.ascontiguousarray(found[:, :KEPT])
