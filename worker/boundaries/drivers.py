"""Boundaries that do external work: gravity, tractions, prescribed motion."""

from typing import Any

import numpy as np

from ..clock import MEAN_DT
from ..kernels.jit import Kernel
from ..migration.parcel import Parcel
from ..model.growing import extended
from ..model.loads import Load
from ..model.state import Bits, Floats, Indices, Ints, Nodes
from ..model.topology import Split
from ..parallel.arguments import Arguments, Follow
from ..parallel.team import Stage
from . import impulses
from .boundaries import FREE, KEPT, PRESCRIBED, Boundary, free
from .course import Course
from .moving_axis import MovingAxis


class Driver(Boundary):
    """A boundary whose impulses do external work."""

    def note(self, state: Nodes) -> None:
        self._note(state, self.external_work, 0.5)

    def noting(self, state: Nodes) -> list[Stage]:
        return self.over.stages(impulses.note, self._note_table(state, self.external_work, 0.5), (), len(self.nodes))

    def _act(self, kernel: Kernel, arguments: Arguments, state: Nodes, *values: Any) -> None:
        """Applies a kernel of impulses.py. ``arguments``: types of the arguments; ``values``: the arguments that follow
        those that all kernels have.
        """
        self.over.run(kernel, arguments.set(*self._of(state), *values), len(self.nodes))

    def _acting(self, kernel: Kernel, arguments: Arguments, state: Nodes, *values: Any) -> list[Stage]:
        """Returns the kernel of ``_act`` as stages of a program."""
        return self.over.stages(kernel, *arguments.bind(*self._of(state), *values), len(self.nodes))

    def _of(self, state: Nodes) -> tuple[Any, ...]:
        return state.v, state.mass, self.nodes, self._before, self._impulse, self.external_work


class Forcing(Driver):
    """Boundary whose load acts for the mean of the last and the present time step, multiplied by the mean factor of the
    ``course`` in this time.
    """

    def __init__(self, nodes: Indices, course: Course) -> None:
        super().__init__(nodes)
        self._course, self._last_dt = course, 0.0

    def held_components(self) -> Bits:
        return free(self.nodes)

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        super().resume(parcel, name, dt)
        self._last_dt = dt

    def went_on(self, dt: float) -> None:
        self._last_dt = dt

    def _duration(self, dt: float, t: float) -> float:
        """Returns the mean of the last and the present time step at time ``t``, multiplied by the mean factor, s.
        Stores ``dt`` as the last time step.
        """
        mean_dt = 0.5 * (self._last_dt + dt)
        factor = self._course.mean(t - 0.5 * self._last_dt, t + 0.5 * dt)
        self._last_dt = dt
        return mean_dt * factor

    def _forcing(self, kernel: Kernel, arguments: Arguments, state: Nodes, vectors: Floats) -> list[Stage] | None:
        """Returns a kernel with its arguments, the ``vectors`` and the time for which they act, as stages of a program;
        None if the factor is not constant.
        """
        factor = self._course.constant
        return None if factor is None else self._acting(kernel, arguments, state, vectors, Follow(MEAN_DT, factor))


class Gravity(Forcing):
    """Gravity. The ``acceleration`` (3,), m/s^2, is multiplied by the mean factor of the ``course`` and acts for the
    mean time step of the kick. In free fall the velocities at n+1/2 are exact; with a constant factor the positions at
    n are exact, too.
    """

    def __init__(self, nodes: Indices, acceleration: Floats, course: Course) -> None:
        super().__init__(nodes, course)
        self._acceleration, self._arguments = acceleration, Arguments(*impulses.ACCELERATE)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self._act(impulses.accelerate, self._arguments, state, self._acceleration, self._duration(dt, t))

    def acting(self, state: Nodes) -> list[Stage] | None:
        return self._forcing(impulses.accelerate, self._arguments, state, self._acceleration)


class Traction(Forcing):
    """Forces on corners of tets. A force is multiplied by the mean factor of the ``course`` and acts for the mean time
    step of the kick. The forces on a tet are removed with the tet.

    ``load``: forces on all corners (m,) that are nodes of this rank.
    """

    on_faces = True

    def __init__(self, corners: Indices, load: Load, course: Course) -> None:
        super().__init__(np.unique(corners), course)
        self._corners, self._load = corners, load
        self._arguments = Arguments(*impulses.PUSH)
        self.force = self._summed()
        """(n, 3) force on each node of the boundary, N."""

    def keep(self, parcel: Parcel, name: str) -> None:
        super().keep(parcel, name)
        load, ids = self._load, parcel.nodes["id"]
        parcel.rows[f"{name}.load"] = {
            "of": ids[self._corners], "key": load.place, "tets": load.tets, "force": load.force
        }  # fmt: skip

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        booked = [(parcel.nodes[f"{name}.{key}"] != 0.0).reshape(len(parcel.nodes["id"]), -1) for key in KEPT]
        used = np.asarray(np.concatenate(booked, axis=1).any(axis=1))
        used[self._corners] = True
        self.nodes = np.flatnonzero(used).astype(np.int32)
        super().resume(parcel, name, dt)
        self.force = self._summed()

    def grow(self, split: Split, ids: Ints) -> None:
        super().grow(split, ids)
        self._corners = split.followed(self._corners[:, None], ids, self._load.tets)[:, 0]
        self.force = self._summed()

    def drop(self, tets: Ints) -> None:
        stay = ~np.isin(self._load.tets, tets)
        if not stay.all():
            self._load, self._corners = self._load.take(stay), self._corners[stay]
            self.force = self._summed()

    def _summed(self) -> Floats:
        force = np.zeros((len(self.nodes), 3))
        np.add.at(force, np.searchsorted(self.nodes, self._corners), self._load.force)
        return force

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self._act(impulses.push, self._arguments, state, self.force, self._duration(dt, t))

    def acting(self, state: Nodes) -> list[Stage] | None:
        return self._forcing(impulses.push, self._arguments, state, self.force)


class PrescribedVelocity(Driver):
    """Prescribed velocity components of nodes, multiplied by the factor of the ``course``. A free component has the
    value NaN.

    A step uses the mean of the factor over the length of the step, so that positions at n are exact.
    """

    def __init__(self, nodes: Indices, velocity: Floats, course: Course) -> None:
        super().__init__(nodes)
        self._course, self._arguments = course, Arguments(*impulses.PRESCRIBE)
        self._velocity: Floats = np.array(np.broadcast_to(velocity, (len(nodes), 3)), order="C")

    def held_components(self) -> Bits:
        return np.where(np.isnan(self._velocity), FREE, PRESCRIBED).astype(np.uint8)

    def _inherit(self, at: Ints) -> None:
        self._velocity = extended(self._velocity, self._velocity[at])

    def start(self, state: Nodes) -> None:
        free = np.isnan(self._velocity)
        state.v[self.nodes] = np.where(free, state.v[self.nodes], self._course.mean(0.0, 0.0) * self._velocity)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self._act(impulses.prescribe, self._arguments, state, self._velocity, self._course.mean(t, t + dt))

    def acting(self, state: Nodes) -> list[Stage] | None:
        factor = self._course.constant
        return None if factor is None else self._acting(
            impulses.prescribe, self._arguments, state, self._velocity, factor
        )  # fmt: skip


class PrescribedRotation(Driver):
    """Prescribed rigid rotation of nodes about an ``axis``. The velocity in a step is along the chord of the exact
    motion.
    """

    def __init__(self, nodes: Indices, axis: MovingAxis) -> None:
        super().__init__(nodes)
        self._axis, self._arguments = axis, Arguments(*impulses.PRESCRIBE)

    def held_components(self) -> Bits:
        return np.full((len(self.nodes), 3), PRESCRIBED, np.uint8)

    def start(self, state: Nodes) -> None:
        state.v[self.nodes] = self._axis.start(state.x[self.nodes])

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        chord = np.ascontiguousarray(self._axis.chords(state.x[self.nodes], dt, t))
        self._act(impulses.prescribe, self._arguments, state, chord, 1.0)
