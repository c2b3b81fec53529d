"""Pressure forms that average over nodes, ``nodal`` and ``split``, as the time step calls them."""

import numpy as np

from ..accounts.timers import Timers
from ..boundaries.boundaries import Boundary
from ..materials.law import BULK
from ..migration.parcel import Parcel
from ..model.state import Floats, Indices, Ints, Model, extended
from ..model.topology import Split
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.passes import Pass
from ..parallel.tags import Tag
from ..parallel.team import Team
from . import matter, nodal, tasks
from .averages import Averages
from .flat import flat_tets
from .forms import Elements
from .passes import BlockPass, Values


class AveragedElements(Elements):
    """Elements in the ``nodal`` or ``split`` form: two passes, with the completed nodal volume sums between them."""

    def __init__(
        self, model: Model, comm: Comm, neighbours: list[Neighbour], timers: Timers, team: Team,
        averages: Averages | None, weight: Floats, params: Floats, kinds: Ints, scene: list[Boundary], split: bool,
        more: bool,
    ) -> None:  # fmt: skip
        """``averages``: rows of the means, None if they are the nodes; ``weight`` (rows,): one over the reference
        volume, 1/m^3; ``params`` (parts, SIZE): constants of each part; ``kinds`` (parts,): TETS or LINEAR
        (matter.py); ``scene``: boundaries, among them planes of symmetry, which mirror means; ``more``: True if an
        equation of state of the case averages heat or bulking as well.
        """
        self._averages = averages
        n = model.nodes.n if averages is None else averages.n
        self.split = split
        self._columns = 3 if more else 2
        self._gradient = np.zeros((n if split else 1, 3), np.int64)
        super().__init__(model, comm, neighbours, timers, team)
        self._weight = weight
        self._params, self._kinds = params, kinds
        self._bulk = params[self._kind, BULK]
        self._pressed = bool(kinds.any())
        """True if some pressures are computed at the nodes (matter.py)."""
        self._matter = matter.at_start(n if kinds.any() else 1)
        self._scene = scene
        self._volumes = np.zeros((n, self._columns), np.int64)
        self._strain, self._more, self._sizes = np.zeros(n), np.zeros(n), np.zeros(n if split else 1)
        self._projected = np.zeros((n if split else 1, 3))
        self.pressure = np.zeros(n if split else 1)
        self._scale = 1.0
        self._strains, self._forces = BlockPass(tasks.strains, tasks.STRAINS), BlockPass(tasks.forces, tasks.FORCES)
        self._complete = Pass(team, nodal.complete, *nodal.COMPLETE)
        self._project = Pass(team, nodal.project, *nodal.PROJECT)
        for block in model.blocks:
            block.flat = flat_tets(block, model.nodes.x0) if not block.rigid else block.flat

    @property
    def _kind(self) -> Indices:
        """(rows,) a part with the material of each row."""
        return self.model.nodes.part if self._averages is None else self._averages.kind

    def _connect(self) -> None:
        super()._connect()
        sharing = self._neighbours if self._averages is None else self._averages.neighbours
        self.shared_volumes = SharedSum(self._comm, sharing, self._columns, Tag.VOLUME)
        if self.split:
            self.shared_gradients = SharedSum(self._comm, sharing, 3, Tag.GRADIENT)

    def grow(self, split: Split) -> None:
        parents = split.copies.parents if self._averages is None else self._averages.grow(split)
        super().grow(split)
        names = ["_weight", "_bulk", "_volumes", "_strain", "_more"]
        names += ["_gradient", "_projected", "pressure", "_sizes"] if self.split else []
        names += ["_matter"] if self._pressed else []
        for name in names:
            values = getattr(self, name)
            setattr(self, name, extended(values, values[parents]))

    def keep(self, parcel: Parcel) -> None:
        super().keep(parcel)
        columns = {name: getattr(self, name) for name in self._kept}
        if self._averages is not None:
            parcel.rows["elements.averages"] = self._averages.keep(columns)
            columns = self._averages.of_nodes(columns)
        parcel.nodes |= {f"elements.{name}": column for name, column in columns.items()}

    def resume(self, parcel: Parcel) -> None:
        super().resume(parcel)
        columns = {name: np.ascontiguousarray(parcel.nodes[f"elements.{name}"]) for name in self._kept}
        if self._averages is not None:
            columns = self._averages.resume(parcel.rows["elements.averages"], columns)
        for name, column in columns.items():
            setattr(self, name, column)

    @property
    def _kept(self) -> tuple[str, ...]:
        of_split = ("pressure", "_projected") if self.split else ()
        return "_weight", *of_split, *(("_matter",) if self._pressed else ())

    def _exchanges(self) -> list[SharedSum]:
        return [self.shared_forces, self.shared_volumes, *([self.shared_gradients] if self.split else [])]

    @property
    def nodal(self) -> list[Floats]:
        if not self.split:
            return []
        averages = self._averages
        return [self.pressure if averages is None else averages.of_nodes({"pressure": self.pressure})["pressure"]]

    def advance(self, dt: float, scale: float) -> None:
        self._scratches.peaks[:] = 0
        self._scale = scale
        means = self._means()
        self._over(self._strains, means, (dt,), lambda: self.shared_volumes.begin(self._volumes))
        if self._neighbours:
            with self._timers.phase("exchange"):
                self.shared_volumes.finish(self._volumes)
        self._complete.run(len(self._strain), means, self._sizes, *self._constants())
        self._bridge(scale, opens=True)
        self._over(self._forces, means, (dt, scale), self._send)

    def again(self, scale: float) -> None:
        self._gradient[:] = 0
        self._scale = scale
        super().again(scale)

    def finish(self) -> None:
        super().finish()
        if self.split:
            self.shared_gradients.begin(self._gradient)
            self.shared_gradients.finish(self._gradient)
            self._project.run(len(self._strain), self._means(), self._sizes, self._scale)
            for boundary in self._scene:
                self._mirror(boundary)

    def _mirror(self, boundary: Boundary) -> None:
        """Applies the boundary to the projected gradients of all rows of its nodes."""
        if self._averages is None:
            boundary.mirror(self._projected)
            return
        for rows in self._averages.layers():
            of_nodes = np.zeros((self.model.nodes.n, 3))
            of_nodes[self._averages.node[rows]] = self._projected[rows]
            boundary.mirror(of_nodes)
            self._projected[rows] = of_nodes[self._averages.node[rows]]

    def _means(self) -> Values:
        return (
            self._volumes, self._weight, self._strain, self._more, self.split, self.pressure, self._projected,
            self._gradient, self._matter,
        )  # fmt: skip

    def _constants(self) -> Values:
        """Arguments of ``nodal.complete`` except means and volumes."""
        return self._columns > 2, self._bulk, self._pressed, self._kind, self._kinds, self._params
