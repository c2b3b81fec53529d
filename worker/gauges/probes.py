"""Probes, the columns of history.csv: mass-weighted means of a field over chosen tets, and gauges."""

import logging
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from conoid.cases.checks.on import bits
from conoid.cases.model.measures import BEYOND, PUSHES, SHAPES, SUMS, kind
from conoid.cases.model.schema import Case, Probe
from conoid.cases.shapes.region import Region

from ..errors import InputError
from ..model import rows
from ..model.state import Block, Floats, Ints, Model, Tets
from ..output.frames import von_mises
from ..parallel.fixed_point import Ragged, exact_totals
from ..scene.marks import held
from .flying import Flying
from .gauge import Gauge, Scene
from .pushes import Pushes
from .shapes import Shapes
from .sums import NodeSums

log = logging.getLogger("conoid.worker")

_NORMAL = {"stress_xx": rows.S_XX, "stress_yy": rows.S_YY, "stress_zz": rows.S_ZZ}
_SHEAR = {"stress_yz": rows.S_YZ, "stress_zx": rows.S_ZX, "stress_xy": rows.S_XY}
_ROWS = {"plastic_strain": rows.PLASTIC_STRAIN, "damage": rows.DAMAGE, "temperature": rows.TEMPERATURE, **_SHEAR}
_VELOCITY = {"velocity_x": 0, "velocity_y": 1, "velocity_z": 2}


def tet_volumes(tets: Tets, x: Floats) -> Floats:
    """Return (n,) present volumes of tets (n, 4), m^3."""
    origin = x[tets[:, 0]]
    e1, e2, e3 = (x[tets[:, k]] - origin for k in (1, 2, 3))
    volumes: Floats = (e1 * np.cross(e2, e3)).sum(axis=1) / 6.0
    return volumes


def field(block: Block, name: str, model: Model, places: Ints) -> Floats:
    """Return (n,) a field of ``cases.schema.ProbeField`` for the tets at ``places`` (n,) of a block; stress includes
    the viscous part.
    """

    def row(row: int) -> Floats:
        return block.at(row, places)

    if name in _NORMAL:
        return row(_NORMAL[name]) - row(rows.PRESSURE) - row(rows.VISCOUS)
    if name == "temperature" and not block.has(rows.TEMPERATURE):
        return np.full(len(places), block.temperature)
    if name in _ROWS:
        return row(_ROWS[name]) if block.has(_ROWS[name]) else np.zeros(len(places))
    if name in _VELOCITY:
        a, b, c, d = model.nodes.v[block.tets[places].T, _VELOCITY[name]]
        return np.asarray((a + b + c + d) / 4.0)
    if name == "pressure":
        return row(rows.PRESSURE) + row(rows.VISCOUS)
    if name == "mises":
        return von_mises(np.array([row(component) for component in range(rows.S_XX, rows.S_XY + 1)]))
    if name == "density":
        return row(rows.MASS) / tet_volumes(block.tets[places], model.nodes.x)
    return (row(rows.WORK) + row(rows.WORK_VISCOUS)) / row(rows.MASS)


def _gauges(case: Case, scene: Scene) -> list[Gauge]:
    """Return the gauges that measure the probes of a case."""
    kinds = {kind(probe.field) for probe in case.probes}
    every: tuple[tuple[tuple[str, ...], Callable[[Case, Scene], Gauge]], ...] = (
        (PUSHES, Pushes), (SUMS, NodeSums), (("fragment_velocity", "fragment_mass"), Flying), (SHAPES, Shapes),
    )  # fmt: skip
    return [make(case, scene) for fields, make in every if kinds & {*fields}]


class Probes:
    """The probes of a case on this rank."""

    def __init__(self, case: Case, scene: Scene) -> None:
        self.names = [probe.name for probe in case.probes]
        self._fields, self._model, self._comm = [probe.field for probe in case.probes], scene.model, scene.comm
        self._gauges = _gauges(case, scene)
        self._sums = NodeSums(case, scene)
        self.sums = any(isinstance(gauge, NodeSums) for gauge in self._gauges)
        """Whether some probe is a sum over nodes. Probes of these fields need the velocities at time n."""
        other = (*PUSHES, *SUMS, *BEYOND, *SHAPES)
        self._means = [k for k, name in enumerate(self._fields) if kind(name) not in other]
        model = scene.model
        centres = [_centres(block, model) for block in model.blocks] if self._means else []
        self._chosen = {
            k: [_inside(case, case.probes[k], block, model, x) for block, x in zip(model.blocks, centres, strict=True)]
            for k in self._means
        }
        """Global ids of the tets of each probe that is a mean, for each block."""
        self._counted: list[int] | None = None
        """Number of tets of each block when ``_found`` was made."""
        self._found: list[tuple[str, Block, Ints, slice, slice]] = []
        """Entries for each mean and each block with tets of this mean. An entry has the field, the block, the
        indices of the tets, and two slices of the summed values: field times mass, and mass."""
        self._starts = np.zeros(1, np.int64)
        """Index of the first value of each sum."""

    def require_tets(self, case: Case) -> None:
        """Raise InputError, on every rank, for a mean without a tet, or for a sum over a box or a set without a
        node.
        """
        some = [k for k, probe in enumerate(case.probes) if kind(probe.field) in SUMS]
        boxes = [k for k in some if case.probes[k].low is not None or case.probes[k].on is not None]
        tets = [sum(len(ids) for ids in self._chosen[k]) for k in self._means]
        nodes = [int(self._sums.started(case.probes[k]).sum()) for k in boxes]
        counts = self._comm.sum(np.array([*tets, *nodes], np.int64)).tolist()
        for k, count in sorted(zip([*self._means, *boxes], counts, strict=True)):
            what, where = ("tet", "its centre") if k in self._means else ("node", "its place")
            if self._comm.rank == 0:
                log.info("probes[%d] has %d %ss", k, count, what)
            if count == 0:
                probe = case.probes[k]
                both = "" if probe.on is None else f" and a node in {probe.on!r}"
                if what == "node":
                    both = "" if probe.on is None else f" and is in {probe.on!r}"
                raise InputError(
                    f"probes[{k}]: no {what} of part {probe.part!r} has {where} between low and high{both}"
                )

    def keep(self) -> list[Any]:
        """Return the state of the gauges for a checkpoint, equal on all ranks."""
        return [gauge.keep() for gauge in self._gauges]

    def resume(self, known: list[Any]) -> None:
        """Restore the state of the gauges from the data of ``keep``."""
        for gauge, own in zip(self._gauges, known, strict=True):
            gauge.resume(own)

    def measure(self, v: Floats | None = None) -> Floats:
        """Return (probes,) the present values, equal for any number of ranks; NaN if all tets of a probe were removed.

        Collective. ``v`` (nodes, 3): velocities at time n for sums; needed if the velocities of the model are half a
        step ahead.
        """
        if not self.names:
            return np.zeros(0)
        found = {}
        if self._means:
            sums = exact_totals(self._comm, self._columns())[0].reshape(-1, 2).tolist()
            for k, (total, mass) in zip(self._means, sums, strict=True):
                found[k] = total / mass if mass > 0.0 else math.nan
        for gauge in self._gauges:
            found |= gauge.measure(self._model.nodes.v if v is None else v)
        return np.array([found[k] for k in range(len(self.names))])

    def _columns(self) -> Ragged:
        """Return for each mean two sums over its tets: field times mass, and mass."""
        if self._counted != (counted := [block.n for block in self._model.blocks]):
            self._find()
            self._counted = counted
        values = np.empty(self._starts[-1])
        for name, block, places, product, weight in self._found:
            values[weight] = mass = block.at(rows.MASS, places)
            np.multiply(field(block, name, self._model, places), mass, out=values[product])
        return Ragged(values, self._starts)

    def _find(self) -> None:
        """Find the tets of each mean again after tets were removed."""
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
    """Return (3, tets) the centres of the tets in the initial configuration, m."""
    return np.array([x[block.tets].sum(axis=1) for x in model.nodes.x0.T.copy()]) / 4.0


def _inside(case: Case, probe: Probe, block: Block, model: Model, centres: Floats) -> "np.ndarray":
    if model.parts[block.part] != probe.part:
        return np.zeros(0, np.int64)
    inside = np.full(block.n, True) & Region.of(probe).holds(centres, model.slack[block.part])
    if probe.on is not None:
        inside &= held(model.nodes.marks, bits(case)[probe.on])[block.tets].any(axis=1)
    return np.asarray(block.id[inside])
