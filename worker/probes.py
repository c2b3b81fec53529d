"""Probes: mass-weighted means of a field over chosen tets, as columns of history.csv."""

import logging
import math

import numpy as np

from conoid.cases.region import Region
from conoid.cases.schema import Case, Probe, Wall

from .clock import Clock
from .contact.stage import Contact
from .errors import InputError
from .output.frames import von_mises
from .parallel.comm import Comm
from .parallel.fixed_point import Ragged, exact_sums, exact_totals
from .state import (
    DAMAGE,
    MASS,
    PLASTIC_STRAIN,
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    TEMPERATURE,
    VISCOUS,
    WORK,
    WORK_VISCOUS,
    Block,
    Floats,
    Ints,
    Model,
    Tets,
)
from .walls import RigidWalls

log = logging.getLogger("conoid.worker")

_NORMAL = {"stress_xx": S_XX, "stress_yy": S_YY, "stress_zz": S_ZZ}
_SHEAR = {"stress_yz": S_YZ, "stress_zx": S_ZX, "stress_xy": S_XY}
_ROWS = {"plastic_strain": PLASTIC_STRAIN, "damage": DAMAGE, "temperature": TEMPERATURE, **_SHEAR}
_FORCE = {"contact_force_x": 0, "contact_force_y": 1, "contact_force_z": 2}
_WALL = {"wall_force_x": 0, "wall_force_y": 1, "wall_force_z": 2}
_VELOCITY = {"velocity_x": 0, "velocity_y": 1, "velocity_z": 2}


def tet_volumes(tets: Tets, x: Floats) -> Floats:
    """(n,) present volumes of tets (n, 4), m^3."""
    origin = x[tets[:, 0]]
    e1, e2, e3 = (x[tets[:, k]] - origin for k in (1, 2, 3))
    volumes: Floats = (e1 * np.cross(e2, e3)).sum(axis=1) / 6.0
    return volumes


def field(block: Block, name: str, model: Model, places: Ints) -> Floats:
    """(n,) a field of ``cases.schema.ProbeField`` over the tets at ``places`` (n,) of a block; stress includes the
    viscous part.
    """

    def row(row: int) -> Floats:
        return block.at(row, places)

    if name in _NORMAL:
        return row(_NORMAL[name]) - row(PRESSURE) - row(VISCOUS)
    if name == "temperature" and not block.has(TEMPERATURE):
        return np.full(len(places), block.temperature)
    if name in _ROWS:
        return row(_ROWS[name]) if block.has(_ROWS[name]) else np.zeros(len(places))
    if name in _VELOCITY:
        a, b, c, d = model.nodes.v[block.tets[places].T, _VELOCITY[name]]
        return np.asarray((a + b + c + d) / 4.0)
    if name == "pressure":
        return row(PRESSURE) + row(VISCOUS)
    if name == "mises":
        return von_mises(np.array([row(component) for component in range(S_XX, S_XY + 1)]))
    if name == "density":
        return row(MASS) / tet_volumes(block.tets[places], model.nodes.x)
    return (row(WORK) + row(WORK_VISCOUS)) / row(MASS)


class Probes:
    """The probes of a case on this rank."""

    def __init__(
        self, case: Case, model: Model, contact: Contact | None, walls: RigidWalls | None, clock: Clock, comm: Comm
    ) -> None:
        self.names = [probe.name for probe in case.probes]
        self._fields = [probe.field for probe in case.probes]
        self._parts = [model.parts.index(probe.part) for probe in case.probes]
        self._contact, self._walls, self._clock = contact, walls, clock
        self._pushed, self._given = np.zeros((len(model.parts), 3)), np.zeros(len(case.probes))
        self._since = 0.0
        names = [wall.name for _, wall in case.boundaries_of(Wall)]
        self._of_walls = [
            [k for k, name in enumerate(names) if probe.wall in (None, name)] if probe.field in _WALL else []
            for probe in case.probes
        ]
        """Which walls each probe is of."""
        self._model = model
        self._comm = comm
        centres = [_centres(block, model) for block in model.blocks] if case.probes else []
        self._chosen = [
            [_inside(probe, block, model, x) for block, x in zip(model.blocks, centres, strict=True)]
            for probe in case.probes
        ]
        """Global ids of the tets that each probe has in each block."""
        self._means = [k for k, name in enumerate(self._fields) if name not in _FORCE and name not in _WALL]
        self._counted: list[int] | None = None
        """How many tets each block had when these were last found."""
        self._found: list[tuple[str, Block, Ints, slice, slice]] = []
        """Of means that have tets in a block: the field, the block, where these tets stand in it, and which of the
        values that are added up are the field times mass, and mass.
        """
        self._starts = np.zeros(1, np.int64)
        """Where the values of each begin."""

    def require_tets(self, case: Case) -> None:
        """Raises InputError, on every rank alike, when a probe holds no tet."""
        counts = self._comm.sum(np.array([sum(len(c) for c in chosen) for chosen in self._chosen], np.int64))
        if self._comm.rank == 0:
            for number, count in enumerate(counts.tolist()):
                log.info("probes[%d] has %d tets", number, count)
        for index in np.flatnonzero(counts == 0):
            raise InputError(
                f"probes[{index}]: no tet of part {case.probes[index].part!r} has its centre between low and high"
            )

    def keep(self) -> tuple[Floats, Floats, float]:
        """What they remember, equal on all ranks."""
        return self._pushed, self._given, self._since

    def resume(self, known: tuple[Floats, Floats, float]) -> None:
        """Takes it back."""
        self._pushed, self._given, self._since = known

    def measure(self) -> Floats:
        """(probes,) the present values, equal on any number of ranks; NaN when all tets of a probe have left."""
        if not self.names:
            return np.zeros(0)
        passed = self._clock.t - self._since
        forces, walls = self._forces(passed), self._wall_forces(passed)
        self._since = self._clock.t
        sums = iter(exact_totals(self._comm, self._columns())[0].reshape(-1, 2).tolist())
        values = []
        for k, (name, part) in enumerate(zip(self._fields, self._parts, strict=True)):
            if name in _FORCE:
                values.append(float(forces[part, _FORCE[name]]))
            elif name in _WALL:
                values.append(float(walls[k]))
            else:
                total, mass = next(sums)
                values.append(total / mass if mass > 0.0 else math.nan)
        return np.array(values)

    def _forces(self, passed: float) -> Floats:
        """(parts, 3) mean force of contact on each part over the time ``passed``, s, since the last call, N; zero when
        none has, and the impulses that have been until then are in the next.
        """
        if passed == 0.0 or self._contact is None or not any(name in _FORCE for name in self._fields):
            return np.zeros_like(self._pushed)
        pushed = self._contact.impulses()
        forces = (pushed - self._pushed) / passed
        self._pushed = pushed
        return np.asarray(forces)

    def _wall_forces(self, passed: float) -> Floats:
        """(probes,) the same of walls, zero for other probes; all ranks take part."""
        nodes, walls = self._model.nodes, self._walls
        if passed == 0.0 or not any(name in _WALL for name in self._fields):
            return np.zeros_like(self._given)
        columns = np.zeros((0 if walls is None else len(walls.nodes), len(self._fields)))
        for k, name in enumerate(self._fields):
            if walls is not None and name in _WALL:
                mine = nodes.owned[walls.nodes] & (nodes.part[walls.nodes] == self._parts[k])
                columns[:, k] = walls.given[:, [3 * w + _WALL[name] for w in self._of_walls[k]]].sum(axis=1) * mine
        given = np.array([float(total) for total in exact_sums(self._comm, columns)])
        forces = (given - self._given) / passed
        self._given = given
        return np.asarray(forces)

    def _columns(self) -> Ragged:
        """Of each mean the field times mass, and mass, of its tets."""
        if self._counted != (counted := [block.n for block in self._model.blocks]):
            self._find()
            self._counted = counted
        values = np.empty(self._starts[-1])
        for name, block, places, product, weight in self._found:
            values[weight] = mass = block.at(MASS, places)
            np.multiply(field(block, name, self._model, places), mass, out=values[product])
        return Ragged(values, self._starts)

    def _find(self) -> None:
        """Where the tets of each mean stand, anew when tets have left."""
        self._found, starts, end = [], [0], 0
        for k in self._means:
            begin, there = end, []
            for block, ids in zip(self._model.blocks, self._chosen[k], strict=True):
                places = np.flatnonzero(np.isin(block.id, ids)) if len(ids) else ids
                if len(places):
                    there.append((block, places, slice(end, end + len(places))))
                    end += len(places)
            n = end - begin
            for block, places, at in there:
                self._found.append((self._fields[k], block, places, at, slice(at.start + n, at.stop + n)))
            starts += [end, end + n]
            end += n
        self._starts = np.array(starts)


def _centres(block: Block, model: Model) -> Floats:
    """(3, tets) initial centres, m."""
    return np.array([x[block.tets].sum(axis=1) for x in model.nodes.x0.T.copy()]) / 4.0


def _inside(probe: Probe, block: Block, model: Model, centres: Floats) -> "np.ndarray":
    if model.parts[block.part] != probe.part:
        return np.zeros(0, np.int64)
    inside = np.full(block.n, True) & Region.of(probe).holds(centres, model.slack[block.part])
    return np.asarray(block.id[inside])
