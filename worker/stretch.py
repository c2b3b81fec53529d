"""Quiet steps as one compiled program.

A step is quiet if it needs no code outside of its kernels: it has no output, no request, no removed tet, and no
overstressed facet. The program (parallel/program.py) executes the rows 11 to 14 of step.py, and after them the rows 1
to 9 of the next step, again and again, with the kernels that step.py uses:

::

    move -> elements -> decide -> (project) -> note -> kick -> boundaries before contact -> boundaries after contact
                           |
                           +-> end of the program: step.complete executes the rows 14 and 15 of the present step

``decide`` (stretch_numbers.py) is the reduction and the choice of the time step; it writes time, step and scale into
the tables of the other stages. The threads stay awake between the stages, and a step needs no call from Python. The
results are bit-identical to those of step.py. Runs with several ranks, rigid bodies, bonds or moving walls have no
program.
"""

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .accounts.timers import PHASES
from .boundaries.boundaries import Boundary
from .clock import DT
from .model.state import Block, Floats, Ints
from .parallel.arguments import Arguments, Follow
from .parallel.program import Program, Span
from .parallel.team import Stage
from .parallel.words import SECOND
from .simulation import Simulation
from .stretch_numbers import (
    CONTROL,
    DEADLINE,
    DECIDE,
    EVENT,
    FLOOR,
    GROWTH,
    IMPULSE_QUANTUM,
    LANDING,
    LEAST_STABLE,
    MANY,
    MOST_STEPS,
    NEXT,
    NEXT_SCALE,
    SAFETY,
    SCALE,
    SHORTER_QUANTUM,
    SIZE,
    STEPS,
    STOP,
    Ties,
    decide,
    spread,
)

_POLL = 0.05
"""Largest wall time of one program, s. Chosen value: a user does not notice a delay of this length in the answer to a
signal."""
_SHORT, _PAUSE = 4, 16
"""A program is started only if no output is scheduled within the next _SHORT steps. If an event ends a program after
fewer than _SHORT steps, the next _PAUSE steps are executed without a program. Therefore a scene that is quiet only for
short times spends no time on programs. Chosen values: the start of a program takes as long as a step of a small
scene."""


_ONE: Ints = np.ones(1, np.int64)
"""Number of indices in the range of a stage that one thread runs."""


class Until(NamedTuple):
    """First simulated time, wall time and step number at which code outside of the program is needed."""

    wall: float
    """Wall time, s."""
    t: float
    """Simulated time, s."""
    step: int
    """Number of the step."""


@dataclass(frozen=True)
class _Part:
    """A stage of the program with its phase and, if it computes elements, the block of these elements."""

    phase: str
    stage: Stage | Span
    block: Block | None = None


class Stretch:
    """Program of the quiet steps of a simulation on a single rank."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._possible = sim.comm.size == 1 and not (
            sim.rigid or sim.bonds or sim.contact or sim.crushing or (sim.walls.n and not sim.walls.plain.all())
        )
        self._pause = 0
        self._words: Ints = np.zeros(SIZE, np.int64)
        self._numbers: Floats = np.zeros(MANY)
        self._decide = Arguments(*DECIDE)
        self._ties = Ties(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))

    def run(self, until: Until) -> int:
        """Executes quiet steps, from row 11 of the present step on, and returns their number. After the call,
        ``step.complete`` must complete the last of these steps. If the present step is not quiet, nothing changes and 0
        is returned.
        """
        sim = self._sim
        if not self._possible or not self._is_quiet(until):
            return 0
        self._pause -= 1
        if self._pause > 0:
            return 0
        sim.timers.switch("rest")
        parts = self._parts()
        if parts is None:
            self._possible = False
            return 0
        self._begin(until)
        self._tie(parts)
        program = Program(sim.elements.team, [each.stage for each in parts], self._words[CONTROL : CONTROL + 1])
        program.repeat()
        self._end(parts, program.spent)
        steps = int(self._words[STEPS])
        self._pause = _PAUSE if steps < _SHORT and self._words[STOP] == EVENT else 0
        return steps

    def _is_quiet(self, until: Until) -> bool:
        """Returns True if a program is useful. A program is not useful if code outside of it is needed at the end of
        the present step.
        """
        sim, clock = self._sim, self._sim.clock
        if clock.t + _SHORT * clock.dt >= until.t or clock.step + _SHORT >= until.step or clock.starved:
            return False
        if sim.elements.team.projecting is not None or time.monotonic() >= until.wall:
            return False
        return (sim.fracture is None or sim.fracture.intact) and (sim.erosion is None or sim.erosion.idle)

    def _parts(self) -> list[_Part] | None:
        """Returns the stages of the program; None if a stage needs code outside of its kernels."""
        sim, nodes = self._sim, self._sim.model.nodes
        ending = sim.elements.ending(Follow(SCALE))
        acting = self._acting(sim.acts.before_contact), self._acting(sim.acts.after_contact)
        if ending is None or acting[0] is None or acting[1] is None:
            return None
        some = [
            _Part("nodes", sim.leapfrog.moving(nodes, Follow(DT), Follow(SHORTER_QUANTUM))),
            *(_Part("elements", *each) for each in sim.elements.advancing(Follow(DT), Follow(NEXT_SCALE))),
            _Part("nodes", self._deciding()),
            *(_Part("exchange", each) for each in ending),
        ]  # fmt: skip
        noting = [stage for bound in sim.acts.noting for stage in bound.noting(nodes)]
        kick = sim.leapfrog.kicking(nodes, Follow(IMPULSE_QUANTUM), Follow(SHORTER_QUANTUM))
        return some + [_Part("nodes", each) for each in (*noting, kick, *acting[0], *acting[1])]

    def _acting(self, bounds: tuple[Boundary, ...]) -> list[Stage] | None:
        found = [bound.acting(self._sim.model.nodes) for bound in bounds]
        if any(each is None for each in found):
            return None
        return [stage for each in found if each is not None for stage in each]

    def _deciding(self) -> Span:
        peaks = self._sim.elements.scratches.peaks
        return Span(decide, self._decide.set(self._words, self._numbers, peaks, self._ties), _ONE, 0, 1)

    def _begin(self, until: Until) -> None:
        """Sets the words and numbers of the program to the present state of the simulation."""
        sim, clock, words, numbers = self._sim, self._sim.clock, self._words, self._numbers
        words[STOP] = words[STEPS] = 0
        words[MOST_STEPS] = min(until.step - clock.step, 2**62)
        words[DEADLINE] = int(min(until.wall, time.monotonic() + _POLL) * SECOND)
        known = clock.numbers
        numbers[: len(known)] = known
        numbers[SCALE], numbers[NEXT_SCALE], numbers[FLOOR] = sim.scale, sim.next_scale(), sim.floor
        numbers[[SAFETY, GROWTH, LEAST_STABLE, LANDING]] = clock.limits
        numbers[NEXT] = min(until.t, numbers[LANDING])

    def _tie(self, parts: list[_Part]) -> None:
        """Connects the argument tables of all stages with the numbers of the program."""
        ties = [tie for each in parts if isinstance(each.stage, Stage) for tie in each.stage.ties]
        self._ties = Ties(
            np.array([tie.number for tie in ties]), np.array([tie.factor for tie in ties]),
            np.array([tie.address for tie in ties]),
        )  # fmt: skip
        self._deciding()
        spread(self._numbers, self._ties)
        self._sim.elements.scratches.peaks[:] = 0

    def _end(self, parts: list[_Part], spent: Ints) -> None:
        """Sets the simulation to the state in which the program ended. ``spent`` (parts, 2): wall time of each stage
        outside of parallel regions and in parallel regions, ns.
        """
        sim, steps = self._sim, int(self._words[STEPS])
        sim.clock.go_on(steps, self._numbers[: len(sim.clock.numbers)].tolist())
        sim.scale = float(self._numbers[SCALE])
        sim.elements.went_on(sim.scale)
        for bound in sim.boundaries:
            bound.went_on(sim.clock.dt)
        if sim.fracture is not None:
            sim.fracture.went_on(steps - 1)
        inside, outside = dict.fromkeys(PHASES, 0.0), dict.fromkeys(PHASES, 0.0)
        for each, (alone, shared) in zip(parts, (spent / SECOND).tolist(), strict=True):
            outside[each.phase] += alone
            inside[each.phase] += shared
            if each.block is not None:
                each.block.seconds += alone + shared
        sim.timers.divide(inside, outside)
