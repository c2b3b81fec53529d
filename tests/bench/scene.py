"""Bodies for timing: a box of about a given number of tets, of one material, under uniform stretch.

The stretch keeps the volume and is the same in all tets. Therefore every tet of a plastic material yields within about
ten steps and continues to yield; in an elastic material the strain stays small.
"""

import time
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Literal
from unittest.mock import patch

import numpy as np

from conoid.cases.model import bodies, schema
from conoid.worker import simulation, step
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows, state
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.scene import assembly

Form = Literal["standard", "nodal", "split"]
Generator = Literal["gmsh", "structured"]
FORMS: tuple[Form, ...] = ("standard", "nodal", "split")
SAMPLE_EVERY = 20
"""Number of steps between two samples of the energy balance: the default of 500 samples in a run of 10,000 steps."""

_EDGE = 0.01
_GMSH_TETS = 5.9
"""Number of tets of gmsh in a cube of the size ``element_size``; the structured generator makes 6 tets."""


def box(tets: int, generator: Generator = "gmsh") -> bodies.Box:
    """Returns a cube of 10 mm with about ``tets`` tets."""
    size = _EDGE / round((tets / 6) ** (1 / 3)) if generator == "structured" else _EDGE * (_GMSH_TETS / tets) ** (1 / 3)
    return bodies.Box(
        shape="box", low=(0.0, 0.0, 0.0), high=(_EDGE,) * 3, element_size=float(f"{size:.4g}"), generator=generator
    )


def case(material: str, form: Form, mesh: bodies.Box, viscosity: bool = True) -> schema.Case:
    """Returns a case with one part of ``material``, a name in the library."""
    return schema.Case(
        name="bench", parts=(schema.Part(name="body", material=material, mesh=mesh),),
        numerics=schema.Numerics(pressure=form, viscosity=schema.Viscosity() if viscosity else None),
        run=schema.Run(end_time=1.0, frames=0),
    )  # fmt: skip


class Ride:
    """A simulation that computes whole steps as the worker does, with the energy balance and probes every SAMPLE_EVERY
    steps.
    """

    def __init__(self, scene: schema.Case, mesh: TetMesh | None = None) -> None:
        """The argument ``mesh`` is the mesh of the only part; it replaces the mesh of the case."""
        ready: AbstractContextManager[object] = nullcontext()
        if mesh is not None:
            ready = patch.object(assembly, "build_mesh", lambda *_, **__: mesh)
        with ready:
            self.sim = simulation.build(scene, Path(), SerialComm())
        step.prepare(self.sim)

    @property
    def tets(self) -> int:
        """Number of tets."""
        return self.sim.model.elements_global

    def stretch(self, strain: float) -> None:
        """Sets the velocities: a strain of ``strain`` per step along z, and minus half of this strain in the other
        directions."""
        nodes = self.sim.model.nodes
        rate = strain * self.sim.reduction.limit / self.sim.case.numerics.dt_safety
        nodes.v[:] = (nodes.x - nodes.x.mean(axis=0)) * rate * np.array([-0.5, -0.5, 1.0])

    def steps(self, count: int) -> float:
        """Returns the CPU time of ``count`` steps, s."""
        begin = time.thread_time()
        for _ in range(count):
            self._step()
        return time.thread_time() - begin

    def _step(self) -> None:
        sim = self.sim
        before = sim.model.nodes.v.copy() if sim.clock.step % SAMPLE_EVERY == 0 else None
        step.first_half(sim)
        with sim.timers.phase("output"):
            if before is not None:
                sim.ledger.close(before)
                sim.probes.measure()
                sim.limiter()
        step.second_half(sim)

    def yielding(self) -> float:
        """Computes one step; returns the fraction of the tets that yield in this step."""
        before = self._plastic_strain()
        self._step()
        return float((self._plastic_strain() > before).mean()) if len(before) else 0.0

    def _plastic_strain(self) -> state.Floats:
        blocks = [block for block in self.sim.model.blocks if block.has(rows.PLASTIC_STRAIN)]
        return np.concatenate([np.zeros(0), *(block.row(rows.PLASTIC_STRAIN) for block in blocks)])
