"""Reasons why a run stops before its end time, and the message for each reason."""

from conoid.cases.run import Cause, State

from ..clock import SLOWED
from ..simulation import Simulation

CANCELLED, WALL_TIME, MAX_STEPS = 1, 2, 3
"""Numbers of the reasons for an early stop, in the reduction of the step. If ranks have different reasons, the largest
number is used."""

STOPS = {
    CANCELLED: (State.CANCELLED, Cause.CANCELLED, "stopped on request"),
    WALL_TIME: (State.TIMED_OUT, Cause.WALLTIME, "run.max_wall_time is used up"),
    MAX_STEPS: (State.TIMED_OUT, Cause.STEPS, "the run reached run.max_steps before run.end_time"),
}
"""Dictionary from the reason for an early stop to state, cause and message."""


def reason(sim: Simulation, stop: int) -> str:
    """Return the message for an early stop; it contains the reason, the time reached, and the stable step if that has
    decreased much.

    Collective.
    """
    clock, text = sim.clock, STOPS[stop][2]
    if stop == CANCELLED:
        return text
    text += f", at {clock.t:.3g} s of {sim.case.run.end_time:.3g} s"
    slow = clock.share < SLOWED
    return f"{text}; {_fallen(sim, f'1/{1.0 / clock.share:.0f} of the first')}" if slow else text


def starved(sim: Simulation) -> str:
    """Return a warning if the stable step is so small that run.max_steps may end the run. Collective."""
    text = _fallen(sim, f"below 1/1000 of the first, at {sim.clock.t:.3g} s")
    return text + ", run.max_steps ends the run"


def _fallen(sim: Simulation, extent: str) -> str:
    """Return a text with the decrease of the stable step, the tet that limits the step, and the key of the case that
    removes such tets. Collective.
    """
    clock = sim.clock
    return (
        f"the stable step has fallen to {clock.stable:.2g} s, {extent} ({sim.limiter()}): about "
        f"{clock.steps_left:.2g} steps are left; erosion.time_step removes such tets"
    )
