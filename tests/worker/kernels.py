"""Adapter between the tests and the kernels of the worker: if the signature of a kernel changes, only this file
changes. A ``Patch`` is a simulation of one part on one rank with plain arrays as input and output; ``run`` makes its
time steps.
"""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Literal
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from conoid.cases.model import bodies, materials, schema
from conoid.worker import simulation, step
from conoid.worker.boundaries.boundaries import Boundary
from conoid.worker.materials import law
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows, state
from conoid.worker.parallel import fixed_point
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.scene import assembly, domain
from conoid.worker.simulation import Simulation

from . import formulas

Floats = npt.NDArray[np.float64]
Form = Literal["standard", "nodal", "split"]
FORMS: tuple[Form, ...] = ("standard", "nodal", "split")

STEEL = materials.Material(density=7850.0, elastic=materials.Elastic(young=200e9, poisson=0.3))
HARD = STEEL.model_copy(
    update={"strength": materials.LinearHardening(model="linear_hardening", yield_stress=1e15)}
)  # fmt: skip
"""Steel with a yield stress that no test reaches, so that the hypoelastic law of materials with a strength is used."""
COPPER = materials.Material(
    density=8930.0, elastic=materials.Elastic(young=117e9, poisson=0.35),
    strength=materials.LinearHardening(model="linear_hardening", yield_stress=0.4e9, hardening=0.1e9),
)  # fmt: skip
STEEL_42CRMO4 = materials.Material(
    density=7830.0, elastic=materials.Elastic(young=206.9e9, poisson=0.3),
    strength=materials.JohnsonCook(
        model="johnson_cook", A=806e6, B=614e6, n=0.168, C=0.0089, m=1.1, reference_temperature=293.15,
        melt_temperature=1813.15, specific_heat=460.0,
    ),
)  # fmt: skip
MILD_STEEL = materials.Material(
    density=7850.0, elastic=materials.Elastic(young=200e9, poisson=0.3),
    strength=materials.CowperSymonds(model="cowper_symonds", yield_stress=250e6, hardening=1.26e9, D=40.4, q=5.0),
)  # fmt: skip
COPPER_GAS = materials.Material(
    density=8930.0, elastic=materials.Elastic(young=117e9, poisson=0.35),
    eos=materials.MieGruneisen(model="mie_gruneisen", c0=3940.0, S=1.49, gamma0=1.96),
)  # fmt: skip
"""Copper with the Mie-Grueneisen equation of state, elastic in shear."""
GLASS = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=72e9, poisson=0.22),
    strength=materials.MohrCoulomb(
        model="mohr_coulomb", cohesion=0.158e9, friction_angle=math.radians(54.9), strength_cap=3.6e9,
        failure_strain=0.05,
    ),
)  # fmt: skip
"""Soda-lime glass; failed glass has a residual friction angle of 30 degrees."""

DUMMY = bodies.Box(shape="box", low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0), element_size=1.0)
"""Mesh key of a case whose mesh is given directly by the test."""


def scene(material: materials.Material = STEEL, form: Form = "standard", end: float = 1.0, **keys: Any) -> schema.Case:
    """Returns a case of one part ``body`` without viscosity; ``keys`` are keys of the part, of ``numerics`` or of the
    case."""
    own = ("velocity", "spin", "stretch", "jitter", "temperature", "erosion")
    of_part = {key: keys.pop(key) for key in own if key in keys}
    numerics = {key: keys.pop(key) for key in ("dt_safety", "dt_growth") if key in keys}
    viscosity = schema.Viscosity(**keys.pop("viscosity")) if "viscosity" in keys else None
    return schema.Case(
        name="test", materials={"metal": material},
        parts=(schema.Part(name="body", material="metal", mesh=DUMMY, **of_part),),
        numerics=schema.Numerics(pressure=form, viscosity=viscosity, **numerics),
        run=schema.Run(end_time=end, frames=keys.pop("frames", 0)), **keys,
    )  # fmt: skip


def build(case: schema.Case, meshes: Iterable[TetMesh]) -> Simulation:
    """Returns the simulation on one rank of a case whose parts have the given meshes; ``simulations.on`` uses several
    ranks."""
    ready = iter(meshes)
    with patch.object(assembly, "build_mesh", lambda *_, **__: next(ready)):
        return simulation.build(case, Path(), SerialComm())


def whole_of(mesh: TetMesh, case: schema.Case | None = None) -> assembly.Whole:
    """Returns the whole mesh of rank 0 before the cut."""
    with patch.object(assembly, "build_mesh", lambda *_, **__: mesh):
        return assembly.assemble(case or scene(), Path())


def pieces_of(pieces: list[domain.Piece], case: schema.Case | None = None) -> list[tuple[domain.Piece, state.Model]]:
    """Returns each piece of the cut mesh with the model that its rank makes of the piece."""
    return [(piece, domain._model(case or scene(), piece)) for piece in pieces]


class Patch:
    """The tets of one material on one rank, and passes over these tets without a time step of the run."""

    def __init__(
        self,
        mesh: TetMesh,
        material: materials.Material = STEEL,
        form: Form = "standard",
        scale: float = 0.0,
        **keys: Any,
    ) -> None:
        self.sim = build(scene(material, form, **keys), [mesh])
        self.elements = self.sim.elements
        self.nodes = self.sim.model.nodes
        self.block = self.sim.model.blocks[0]
        self.tets = np.asarray(self.block.tets, np.int64)
        self.scale = scale
        """Number of quanta of ``quanta`` per newton; 0 chooses the quantum for the present forces, as in a run."""

    def advance(self, dt: float) -> None:
        """Makes one pass over the tets. Before the pass, ``nodes`` contain x(n+1) and v(n+1/2); after the pass, stress
        and forces are at n+1."""
        if self.block.params[law.ORDER] == law.FROM_SHAPE:
            self.put(rows.TET_VOLUME, formulas.volumes(self.corners(self.nodes.x - dt * self.nodes.v)))
        self._used = self.scale or self.sim.next_scale()
        self.nodes.force[:] = 0
        self.elements.advance(dt, self._used)
        self.elements.finish()
        largest = self.elements.force
        if fixed_point.outgrown(largest, self._used):
            self._used = fixed_point.scale_for(largest)
            self.elements.again(self._used)
            self.elements.finish()

    def corners(self, values: Floats | None = None) -> Floats:
        """Returns (n, 4, 3) nodal values of the tets, by default positions."""
        return np.asarray((self.nodes.x if values is None else values)[self.tets])

    def strain(self, L: Floats, dt: float) -> None:
        """Deforms free tets with velocity gradients L, (3, 3) or (n, 3, 3), 1/s, about the origin. The present
        positions count as the positions in the middle of the step; the function sets the positions at the end of the
        step, ``dt`` s.
        """
        middle = self.corners()
        self.nodes.v[self.tets] = np.einsum("ij,naj->nai" if L.ndim == 2 else "nij,naj->nai", L, middle)
        self.nodes.x += 0.5 * dt * self.nodes.v

    def get(self, row: int) -> Floats:
        """Returns (n,) a row of the element state."""
        return self.block.row(row)

    def put(self, row: int, values: Floats | float) -> None:
        """Sets a row of the element state to a number or to (n,) values."""
        flat = self.block.state[:, row, :].reshape(-1)
        flat[: self.block.n] = values
        self.block.state[:, row, :] = flat.reshape(self.block.state[:, row, :].shape)

    @property
    def deviator(self) -> Floats:
        """Returns the (n, 3, 3) deviatoric stress, Pa."""
        xx, yy, zz, yz, zx, xy = (self.get(row) for row in range(rows.S_XX, rows.S_XY + 1))
        return np.stack([xx, xy, zx, xy, yy, yz, zx, yz, zz], axis=1).reshape(-1, 3, 3)

    @deviator.setter
    def deviator(self, s: Floats) -> None:
        places = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)]
        for row, (i, j) in zip(range(rows.S_XX, rows.S_XY + 1), places, strict=True):
            self.put(row, s[:, i, j])

    @property
    def stress(self) -> Floats:
        """Returns the (n, 3, 3) Cauchy stress including the viscous stress, Pa."""
        pressure = self.get(rows.PRESSURE) + self.get(rows.VISCOUS)
        return np.asarray(self.deviator - pressure[:, None, None] * np.eye(3))

    @property
    def force(self) -> Floats:
        """Returns the (nodes, 3) sums of the internal forces, N."""
        return np.asarray(self.nodes.force[:, :3] / self._used)

    @property
    def quantum(self) -> float:
        """Returns the force of one unit of the integer forces, N."""
        return 1.0 / self._used

    @property
    def limit(self) -> float:
        """Returns the largest reciprocal stable step of the last pass, 1/s."""
        return self.elements.limit


def drive(material: materials.Material, L: Floats, dt: float, steps: int, **keys: Any) -> Patch:
    """Deforms one regular tet of 1 m with a constant velocity gradient L (3, 3), 1/s, as a material point. The
    positions are set in every step so that the tet in the middle of the step is always the same: the volume stays
    constant and L is exact.
    """
    from .meshes import REGULAR

    point = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), material, **keys)
    point.strain(L, dt)
    for _ in range(steps):
        point.advance(dt)
    return point


Watch = Callable[[Simulation, Floats], None]


def around(boundary: Boundary, look: Callable[[Floats, Floats], None]) -> None:
    """Calls ``look`` with the velocities (nodes, 3) before and after each application of a boundary."""
    apply = boundary.apply

    def applied(model: state.Nodes, *rest: Any) -> None:
        before = model.v.copy()
        apply(model, *rest)
        look(before, model.v)

    boundary.apply = applied  # type: ignore[assignment, method-assign]


def run(sim: Simulation, watch: Watch | None = None, steps: int = -1) -> Simulation:
    """Makes steps to the end time, or ``steps`` steps; the function ``watch`` is called at each time n with
    v(n-1/2).
    """
    step.prepare(sim)
    while True:
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        if watch is not None:
            watch(sim, before)
        if sim.clock.frame_due:
            sim.clock.frame += 1
        if sim.clock.done:
            step.end(sim, before)
        if sim.clock.done or sim.clock.step == steps:
            return sim
        step.second_half(sim)
