"""Energy and momentum that erosion removes, as exact sums over the removed tets and nodes."""

import numpy as np

from .clock import Clock
from .materials.equation_of_state import GRUNEISEN
from .materials.models import EQUATIONS
from .mesh.faces import FACES
from .mesh.faces import normals as face_normals
from .migration.parcel import Parcel
from .model.rows import (
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    VISCOUS,
    WORK_PLASTIC,
    WORK_VISCOUS,
    WORKS,
)
from .model.state import CHUNK, Block, Floats, Ints, Nodes
from .parallel.fixed_point import Tally


class ErosionAccount:
    """Sums of a rank over the tets and nodes that erosion has removed."""

    def __init__(self, clock: Clock, extremes: tuple[float, float, float]) -> None:
        """``extremes``: largest nodal mass, kg, largest speed, m/s, and largest distance from the origin, m, of the
        scene.
        """
        self._clock = clock
        mass, speed, arm = extremes
        energy, momentum, spin = mass * speed * speed, mass * speed, mass * speed * arm
        self.work = Tally(np.full(len(WORKS) + 1, energy))
        """Sums over the removed tets: the energies WORKS, J, and the heat of tets whose equation of state depends on
        heat, J."""
        self.nodal = Tally(np.array([energy, mass, *[momentum] * 3, *[spin] * 3]))
        """Energy, J, mass, kg, momentum, kg m/s, and angular momentum, kg m^2/s, of the removed nodes."""
        self._half = self.nodal.quanta(np.zeros((0, len(self.nodal.scale))))
        """Second half of the energy and momenta of the last removal, quanta."""
        self._last: list[tuple[Ints, Floats]] = []
        """Nodes (k, 4) of the tets of the last removal, and the last nodal forces (k, 4, 3) of these tets, N."""

    @property
    def outstanding(self) -> bool:
        """True if the second half of the work of a removal must still be added."""
        return bool(self._last or self._half.any())

    def note(self, state: Nodes) -> None:
        """Adds the second half of the work of the last removal; to be called before the kick."""
        for tets, forces in self._last:
            work = np.zeros(len(tets))
            for corner in range(4):
                for i in range(3):
                    work -= 0.5 * self._clock.last_dt * forces[:, corner, i] * state.v[tets[:, corner], i]
            self.work.add(np.column_stack([work, np.zeros((len(work), len(WORKS)))]))
        self._last = []
        self.nodal.words += self._half
        self.nodal.carry()
        self._half[:] = 0

    def add_tets(self, block: Block, worn: Ints, x: Floats) -> None:
        """Adds the energies of the tets ``worn`` of a block; to be called before these tets are removed."""
        self._last.append((block.tets[worn].astype(np.int64), _forces(block, worn, x)))
        self.work.add(_energies(block, worn))

    def add_nodes(self, state: Nodes, leaving: Ints, before: Floats) -> None:
        """Adds energy and momentum of the nodes ``leaving`` after the kick, and sets their forces to zero; ``before``:
        velocities v(n-1/2) of these nodes.
        """
        owned = leaving[state.owned[leaving]]
        after, mass = state.v[owned], state.mass[owned]
        early = self._clock.shorter / state.scale * (before * state.force[leaving, :3]).sum(axis=1)
        state.stepping[leaving] -= early
        before = before[state.owned[leaving]]
        energy = 0.5 * mass * (before * after).sum(axis=1) + early[state.owned[leaving]]
        half = 0.5 * mass[:, None] * after
        half = np.column_stack([half, np.cross(state.x[owned], half)])
        self._half = self.nodal.quanta(np.column_stack([np.zeros((len(half), 2)), half]))
        self.nodal.add(np.column_stack([energy, mass, half]))
        state.force[leaving] = 0

    def keep(self, parcel: Parcel, x: Floats) -> None:
        """Adds the account to a parcel (a checkpoint or migration message); ``x`` (nodes, 3): positions."""
        for key, words in (("work", self.work.words), ("nodal", self.nodal.words), ("half", self._half)):
            parcel.sums[f"erosion.{key}"] = words
        ids = parcel.nodes["id"]
        tets = np.concatenate([np.zeros((0, 4), np.int64), *(tets for tets, _ in self._last)])
        forces = np.concatenate([np.zeros((0, 4, 3)), *(forces for _, forces in self._last)])
        parcel.rows["erosion.last"] = {"at": x[tets].mean(axis=1), "with": ids[tets], "force": forces}

    def resume(self, parcel: Parcel) -> None:
        """Restores the account from a parcel (a checkpoint or migration message). The scales of the sums are not
        restored.
        """
        self.work.words, self.nodal.words, self._half = (
            parcel.sums[f"erosion.{key}"].copy() for key in ("work", "nodal", "half")
        )
        last = parcel.rows["erosion.last"]
        self._last = [(np.searchsorted(parcel.nodes["id"], last["with"]), last["force"])]


def _rows(block: Block, chosen: Ints, rows: "np.ndarray") -> Floats:
    """Returns the state rows ``rows`` of the tets ``chosen``, in the shape (len(chosen), len(rows))."""
    return np.asarray(block.state[(chosen // CHUNK)[:, None], rows, (chosen % CHUNK)[:, None]])


def _energies(block: Block, chosen: Ints) -> Floats:
    """(k, 5) the energies WORKS of the chosen tets, J, and the heat on which their pressure depends, J."""
    none = np.zeros(len(chosen))
    found = {row: block.at(row, chosen) if block.has(row) else none for row in WORKS}
    heat = found[WORK_VISCOUS] + found[WORK_PLASTIC] if EQUATIONS[block.eos] is GRUNEISEN else none
    return np.column_stack([*found.values(), heat])


def _forces(block: Block, chosen: Ints, x: Floats) -> Floats:
    """(k, 4, 3) forces of the chosen tets on their nodes, -V stress grad N, N. Here V is the volume of a tet, and grad
    N the gradient of the shape function of a node.
    """
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
