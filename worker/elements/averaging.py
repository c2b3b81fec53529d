"""The pressure forms ``nodal`` and ``split``, which average over nodes, with the methods that the time step calls."""

import numpy as np

from ..accounts.timers import Timers
from ..boundaries.boundaries import Boundary
from ..materials.law import BULK
from ..migration.parcel import Parcel
from ..model.state import Block, Floats, Indices, Ints, Model
from ..model.topology import Split
from ..parallel.arguments import Follow
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.passes import Pass
from ..parallel.tags import Tag
from ..parallel.team import Stage, Team
from . import nodal, tasks
from .averages import Averages
from .flat import flat_tets
from .forms import Elements
from .nodal_means import NodalMeans
from .passes import BlockPass, Values


class AveragedElements(Elements):
    """Elements in the ``nodal`` or ``split`` pressure form. A step makes two passes over the tets. The nodal volume
    sums are completed between the passes.
    """

    def __init__(
        self, model: Model, comm: Comm, neighbours: list[Neighbour], timers: Timers, team: Team,
        averages: Averages | None, weight: Floats, params: Floats, kinds: Ints, scene: list[Boundary], split: bool,
        more: bool,
    ) -> None:  # fmt: skip
        """``averages``: table of the rows of the means; None if the rows are the nodes. ``weight`` (rows,): 1 /
        reference volume, 1/m^3; ``params`` (parts, SIZE): material constants of each part; ``kinds`` (parts,): TETS or
        LINEAR (matter.py). ``scene``: boundaries, among them symmetry planes, which mirror the means. ``more``: True if
        an equation of state of the case also averages heat or bulking.
        """
        self._averages, self._columns, self.split = averages, 3 if more else 2, split
        super().__init__(model, comm, neighbours, timers, team)
        self._params, self._kinds = params, kinds
        bulk = params[self._kind, BULK]
        self.means = NodalMeans(weight, bulk, self._columns, split=split, pressed=bool(kinds.any()))
        self._scene, self._scale = scene, 1.0
        self._strains, self._forces = BlockPass(tasks.strains, tasks.STRAINS), BlockPass(tasks.forces, tasks.FORCES)
        self._complete = Pass(team, nodal.complete, *nodal.COMPLETE)
        self._project = Pass(team, nodal.project, *nodal.PROJECT)
        for block in model.blocks:
            block.flat = flat_tets(block, model.nodes.x0) if not block.rigid else block.flat

    @property
    def _kind(self) -> Indices:
        """(rows,) one part that has the material of the row."""
        return self.model.nodes.part if self._averages is None else self._averages.kind

    @property
    def pressure(self) -> Floats:
        return self.means.pressure

    def _connect(self) -> None:
        super()._connect()
        sharing = self._neighbours if self._averages is None else self._averages.neighbours
        self.shared_volumes = SharedSum(self._comm, sharing, self._columns, Tag.VOLUME)
        if self.split:
            self.shared_gradients = SharedSum(self._comm, sharing, 3, Tag.GRADIENT)

    def grow(self, split: Split) -> None:
        parents = split.copies.parents if self._averages is None else self._averages.grow(split)
        super().grow(split)
        self.means.grow(parents)

    def keep(self, parcel: Parcel) -> None:
        super().keep(parcel)
        columns = self.means.stored
        if self._averages is not None:
            parcel.rows["elements.averages"] = self._averages.keep(columns)
            columns = self._averages.of_nodes(columns)
        parcel.nodes |= {f"elements.{name}": column for name, column in columns.items()}

    def resume(self, parcel: Parcel) -> None:
        super().resume(parcel)
        columns = {name: np.ascontiguousarray(parcel.nodes[f"elements.{name}"]) for name in self.means.stored}
        if self._averages is not None:
            columns = self._averages.resume(parcel.rows["elements.averages"], columns)
        self.means.restore(columns)

    def _exchanges(self) -> list[SharedSum]:
        return [self.shared_forces, self.shared_volumes, *([self.shared_gradients] if self.split else [])]

    @property
    def nodal(self) -> list[Floats]:
        if not self.split:
            return []
        averages = self._averages
        return [self.pressure if averages is None else averages.of_nodes({"pressure": self.pressure})["pressure"]]

    def advance(self, dt: float, scale: float) -> None:
        self.scratches.peaks[:] = 0
        self._scale = scale
        means = self._means()
        self._over(self._strains, means, (dt,), lambda: self.shared_volumes.begin(self.means.sums))
        if self._neighbours:
            with self._timers.phase("exchange"):
                self.shared_volumes.finish(self.means.sums)
        self._complete.run(self.means.n, means, self.means.volumes, *self._constants())
        self._bridge(scale, opens=True)
        self._over(self._forces, means, (dt, scale), self._send)

    def advancing(self, dt: Follow, scale: Follow) -> list[tuple[Stage, Block | None]]:
        means = self._means()
        complete = self._complete.stage(self.means.n, means, self.means.volumes, *self._constants())
        strains, forces = self._staged(self._strains, means, (dt,)), self._staged(self._forces, means, (dt, scale))
        return [*strains, (complete, None), *forces]

    def ending(self, scale: Follow) -> list[Stage] | None:
        if not self.split:
            return []
        if self._averages is not None:
            return None
        project = self._project.stage(self.means.n, self.means.fields, self.means.volumes, scale)
        return [project, *(stage for each in self._scene for stage in each.mirroring(self.means.projected))]

    def went_on(self, scale: float) -> None:
        self._scale = scale

    def again(self, scale: float) -> None:
        self.means.gradient[:] = 0
        self._scale = scale
        super().again(scale)

    def finish(self) -> None:
        super().finish()
        if self.split:
            self.shared_gradients.begin(self.means.gradient)
            self.shared_gradients.finish(self.means.gradient)
            self._project.run(self.means.n, self.means.fields, self.means.volumes, self._scale)
            for boundary in self._scene:
                self._mirror(boundary)

    def _mirror(self, boundary: Boundary) -> None:
        """Applies a boundary to the projected gradients of all rows of the nodes of the boundary."""
        projected = self.means.projected
        if self._averages is None:
            boundary.mirror(projected)
            return
        for rows in self._averages.layers():
            of_nodes = np.zeros((self.model.nodes.n, 3))
            of_nodes[self._averages.node[rows]] = projected[rows]
            boundary.mirror(of_nodes)
            projected[rows] = of_nodes[self._averages.node[rows]]

    def _means(self) -> Values:
        return self.means.fields

    def _constants(self) -> Values:
        """Returns the arguments of ``nodal.complete``, without means and volumes."""
        return self._columns > 2, self.means.bulk, self.means.pressed, self._kind, self._kinds, self._params
