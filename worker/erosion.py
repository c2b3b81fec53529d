"""Erosion: worn tets are removed, the faces behind them become surface, and the energy and momentum removed are booked.

A tet is marked in the pass over the elements (elements/wear.py), when its force of n+1 is already in the nodal sums.
It is removed before the contact of the next step, so that the faces behind it are in contact in that step. Its last
force acts in one more kick: the second half of the work of that force is booked one step later, as for a boundary.
Tets that exceed only a strain or damage limit are collected for some steps, because each removal requires new mean
normals. So are nodes without tets that contact has pushed, if their part removes them then (``erosion.nodes =
"strike"``).
"""

import numpy as np

from conoid.cases.model.schema import Case

from .boundaries.boundaries import Boundary
from .clock import Clock
from .contact.stage import Contact
from .contact.surface import exposure
from .elements.wear import BROKEN, DAMAGED, FREQUENCY, SOUND, TIRED, life
from .materials.equation_of_state import GRUNEISEN
from .materials.models import EQUATIONS
from .mesh.faces import FACES
from .mesh.faces import normals as face_normals
from .migration.parcel import Parcel
from .model.rows import DAMAGE, PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, VISCOUS, WORK_PLASTIC, WORK_VISCOUS, WORKS
from .model.state import CHUNK, Block, Flags, Floats, Ints, Model, Nodes, extended
from .model.topology import Split
from .parallel.comm import Comm
from .parallel.fixed_point import Tally
from .parallel.ownership import Neighbour, complete
from .parallel.tags import Tag

GATHERED = 10
"""Number of steps in which worn tets are collected. Chosen: each removal requires new mean normals and tests of all
candidate pairs."""
UNDECIDED = 0.25
"""Share of ``erosion.damage`` from which a warning reports that no tet was removed. Chosen: a punch
(docs/theory/erosion.md, Erosion) leaves damage of 0.42 in a plate, and with smaller tets cuts a plug out of it."""


class Erosion:
    """The erosion of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], contact: Contact | None, bounds: list[Boundary],
        comm: Comm, clock: Clock, extremes: tuple[float, float, float],
    ) -> None:  # fmt: skip
        """``extremes``: largest nodal mass, kg, speed, m/s, and distance from the origin, m, of the scene."""
        self._model, self._neighbours, self._contact = model, neighbours, contact
        self._bounds = bounds
        self._comm, self._clock = comm, clock
        self._specs = [part.erosion for part in case.parts]
        self._leaves, self._strikes = (
            np.array([spec is not None and spec.nodes == kind for spec in self._specs])[model.nodes.part]
            for kind in ("remove", "strike")
        )
        self.removed = np.zeros(model.nodes.n, bool)
        """(nodes,) which are removed; they stand still where they were."""
        self._tets_at = self._completed([block.tets.astype(np.int64) for block in model.blocks])
        self._last: list[tuple[Ints, Floats]] = []
        self._leaving, self._before = np.zeros(0, np.int64), np.zeros((0, 3))
        """Nodes that are removed in this step, and their v(n-1/2), m/s."""
        mass, speed, arm = extremes
        energy, momentum, spin = mass * speed * speed, mass * speed, mass * speed * arm
        self.work = Tally(np.full(len(WORKS) + 1, energy))
        """Sums of WORKS over the removed tets, J, and the heat of those whose equation of state depends on it."""
        self.nodal = Tally(np.array([energy, mass, *[momentum] * 3, *[spin] * 3]))
        """Energy, J, mass, kg, momentum, kg m/s, and angular momentum, kg m^2/s, of the removed nodes."""
        self._half = self.nodal.quanta(np.zeros((0, len(self.nodal.scale))))
        self._limit = 0.0
        self.due = False
        """Whether the next step starts with a removal."""

    def begin(self, limit: float) -> None:
        """Sets the limits of the stable step, as shares of the first one; ``limit``: the largest
        one-over-stable-step at the start, 1/s.
        """
        self._limit = limit
        for block in self._model.blocks:
            spec = self._specs[block.part]
            if spec is not None:
                block.life[FREQUENCY] = limit / spec.time_step

    def grow(self, split: Split, ids: Ints) -> None:
        """Extends the arrays by the copies of separated nodes.

        Parts that fracture do not erode (cases/checks/checks.py): no tet of these nodes is removed, so that any count
        of tets but zero will do for a copy.
        """
        parents = split.copies.parents
        self.removed = extended(self.removed, self.removed[parents])
        self._leaves = extended(self._leaves, self._leaves[parents])
        self._strikes = extended(self._strikes, self._strikes[parents])
        self._tets_at = extended(self._tets_at, np.ones(len(parents), np.int64))

    def keep(self, parcel: Parcel) -> None:
        """Adds the state to a parcel."""
        nodes, ids = self._model.nodes, parcel.nodes["id"]
        parcel.known["erosion"] = self._limit, self.due, self.work.scale, self.nodal.scale
        for key, words in (("work", self.work.words), ("nodal", self.nodal.words), ("half", self._half)):
            parcel.sums[f"erosion.{key}"] = words
        parcel.nodes["erosion.removed"], parcel.nodes["erosion.tets_at"] = self.removed, self._tets_at
        parcel.nodes["erosion.leaves"] = self._leaves
        alone = np.flatnonzero((self._tets_at == 0) & nodes.owned)
        parcel.rows["erosion.alone"] = {"at": nodes.x[alone], "with": ids[alone][:, None]}
        tets = np.concatenate([np.zeros((0, 4), np.int64), *(tets for tets, _ in self._last)])
        forces = np.concatenate([np.zeros((0, 4, 3)), *(forces for _, forces in self._last)])
        parcel.rows["erosion.last"] = {"at": nodes.x[tets].mean(axis=1), "with": ids[tets], "force": forces}

    def resume(self, parcel: Parcel) -> None:
        """Restores the state from a parcel."""
        limit, self.due, self.work.scale, self.nodal.scale = parcel.known["erosion"]
        self.begin(limit)
        self.work.words, self.nodal.words, self._half = (
            parcel.sums[f"erosion.{key}"].copy() for key in ("work", "nodal", "half")
        )
        self.removed, self._tets_at = parcel.nodes["erosion.removed"], parcel.nodes["erosion.tets_at"]
        self._leaves = parcel.nodes["erosion.leaves"]
        last = parcel.rows["erosion.last"]
        self._last = [(np.searchsorted(parcel.nodes["id"], last["with"]), last["force"])]
        self._release()

    def strikes(self) -> int:
        """After contact: marks the nodes without tets that contact pushed in this step, in parts with
        ``erosion.nodes = "strike"``. Returns TIRED (elements/wear.py) if nodes of this rank are to be removed, else
        SOUND.
        """
        if self._contact is not None:
            flying = np.flatnonzero(self._strikes & self._loose)
            self._leaves[flying[self._contact.searches.pushed(flying)]] = True
        return TIRED if (self._leaves & self._loose).any() else SOUND

    def decide(self, found: int) -> None:
        """Decides whether the next step removes tets or nodes; ``found``: the maximum over all ranks of what was
        found (elements/wear.py).
        """
        self.due = found == BROKEN or (found > SOUND and self._clock.step % GATHERED == 0)

    def warnings(self, eroded: int) -> list[str]:
        """Returns warnings for the end of the run; ``eroded``: number of removed tets of all ranks. Collective."""
        parts = self._model.parts
        left, damage = np.zeros(len(parts), np.int64), np.zeros(len(parts))
        for block in self._model.blocks:
            left[block.part] += block.n
            if block.has(DAMAGE) and block.n:
                damage[block.part] = max(damage[block.part], block.at(DAMAGE, np.arange(block.n)).max())
        left, damage = self._comm.sum(left), self._comm.maximum(damage)
        found = [f"part {parts[k]!r} has no tet left: erosion removed all of them" for k in np.flatnonzero(left == 0)]
        limits = [float(life(spec)[DAMAGED]) for spec in self._specs]
        undecided = [k for k, limit in enumerate(limits) if not eroded and UNDECIDED * limit < damage[k] < limit]
        return found + [
            f"part {parts[k]!r} is damaged to {damage[k]:.2g} of erosion.damage {limits[k]:g} and no tet was removed: "
            "shear bands are at least as wide as a tet, and smaller tets reach the limit sooner (conoid converge shows "
            "whether this matters)"
            for k in undecided
        ]

    @property
    def particles(self) -> int:
        """Number of free nodes without tets (particles). Collective."""
        nodes = self._model.nodes
        return int(self._comm.sum(np.array([(nodes.owned & self._loose).sum()]))[0])

    def note(self, state: Nodes) -> None:
        """Before the kick: books the second half of the work of the last removal."""
        self._book_last_work(state)
        self.nodal.words += self._half
        self.nodal.carry()
        self._half[:] = 0

    def remove(self, state: Nodes) -> None:
        """Removes the marked tets, if a removal is scheduled. Collective."""
        self._leaving = np.zeros(0, np.int64)
        if self.due:
            self._remove(state)
            self.due = False

    def stop_removed(self, state: Nodes) -> None:
        """After the kick: books the nodes that are removed in this step; sets the velocities of all removed nodes to
        zero.
        """
        leaving = self._leaving
        if len(leaving):
            owned = leaving[state.owned[leaving]]
            before, after, mass = self._before[state.owned[leaving]], state.v[owned], state.mass[owned]
            early = self._clock.shorter / state.scale * (self._before * state.force[leaving]).sum(axis=1)
            state.stepping[leaving] -= early
            energy = 0.5 * mass * (before * after).sum(axis=1) + early[state.owned[leaving]]
            half = 0.5 * mass[:, None] * after
            half = np.column_stack([half, np.cross(state.x[owned], half)])
            self._half = self.nodal.quanta(np.column_stack([np.zeros((len(half), 2)), half]))
            self.nodal.add(np.column_stack([energy, mass, half]))
            state.force[leaving] = 0
        state.v[self.removed] = 0.0

    def _remove(self, state: Nodes) -> None:
        """Removes the marked tets and the nodes that leave with them. Collective."""
        gone, left, ids = [np.zeros((0, exposure.WORDS), np.int64)], [], [np.zeros(0, np.int64)]
        for block in self._model.blocks:
            worn = np.flatnonzero(block.worn)
            if len(worn):
                if self._contact is not None:
                    gone.append(exposure.leaving(block, worn, state.id))
                left.append(block.tets[worn].astype(np.int64))
                ids.append(block.id[worn])
                self._last.append((left[-1], _forces(block, worn, state.x)))
                self.work.add(_energies(block, worn))
                block.drop(worn)
        self._unload(np.concatenate(ids))
        self._tets_at -= self._completed(left)
        self._model.elements_global -= int(self._comm.sum(np.array([sum(len(tets) for tets in left)]))[0])
        alone = self._tets_at == 0
        leaving = self._leaves & alone & ~self.removed
        self._leaving, self.removed = np.flatnonzero(leaving), self.removed | leaving
        self._before = state.v[self._leaving]
        self._release()
        if self._contact is not None:
            self._contact.uncover(np.concatenate(gone), self._loose, self.removed)

    @property
    def _loose(self) -> Flags:
        """(nodes,) nodes without tets that are not removed: particles."""
        return np.asarray((self._tets_at == 0) & ~self.removed)

    def _release(self) -> None:
        """Declares nodes without tets particles, in all boundaries."""
        for bound in self._bounds:
            bound.release(self._loose, self._bounds)

    def _unload(self, gone: Ints) -> None:
        """Removes the boundary loads of the removed tets ``gone`` (global ids, of this rank), on every rank that has
        a node of them. Collective.
        """
        if any(bound.on_faces for bound in self._bounds):
            gone = self._comm.join(gone)
            for bound in self._bounds:
                bound.drop(gone)

    def _completed(self, tets: list[Ints]) -> Ints:
        """(nodes,) number of tets at each node, counted over these ``tets`` of all ranks. Collective."""
        corners = np.concatenate([np.zeros(0, np.int64), *(rows.reshape(-1) for rows in tets)])
        counts = np.bincount(corners, minlength=self._model.nodes.n)[:, None].astype(np.int64)
        complete(self._comm, self._neighbours, counts, Tag.TETS_AT_NODE)
        return counts[:, 0]

    def _book_last_work(self, state: Nodes) -> None:
        """Books the second half of the work of the last forces of removed tets, with the velocities after the kick."""
        for tets, forces in self._last:
            work = np.zeros(len(tets))
            for corner in range(4):
                for i in range(3):
                    work -= 0.5 * self._clock.last_dt * forces[:, corner, i] * state.v[tets[:, corner], i]
            self.work.add(np.column_stack([work, np.zeros((len(work), len(WORKS)))]))
        self._last = []


def _rows(block: Block, chosen: Ints, rows: "np.ndarray") -> Floats:
    """(len(chosen), len(rows)) values of some state rows of some tets."""
    return np.asarray(block.state[(chosen // CHUNK)[:, None], rows, (chosen % CHUNK)[:, None]])


def _energies(block: Block, chosen: Ints) -> Floats:
    """(k, 5) WORKS of some tets, J, and the heat in their equation of state, J."""
    none = np.zeros(len(chosen))
    found = {row: block.at(row, chosen) if block.has(row) else none for row in WORKS}
    heat = found[WORK_VISCOUS] + found[WORK_PLASTIC] if EQUATIONS[block.eos] is GRUNEISEN else none
    return np.column_stack([*found.values(), heat])


def _forces(block: Block, chosen: Ints, x: Floats) -> Floats:
    """(k, 4, 3) nodal forces -V stress grad N of some tets, N."""
    values = _rows(block, chosen, np.arange(VISCOUS + 1))
    stress = np.empty((len(chosen), 3, 3))
    pressure = values[:, PRESSURE] + values[:, VISCOUS]
    for (i, j), row in {(1, 2): S_YZ, (2, 0): S_ZX, (0, 1): S_XY}.items():
        stress[:, i, j] = stress[:, j, i] = values[:, row]
    for i, row in enumerate((S_XX, S_YY, S_ZZ)):
        stress[:, i, i] = values[:, row] - pressure
    return np.stack([
        (stress * (face_normals(x, block.tets[chosen][:, face]) / 6.0)[:, None, :]).sum(axis=2) for face in FACES
    ], axis=1)  # fmt: skip
