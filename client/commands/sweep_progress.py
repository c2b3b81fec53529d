"""Texts about a sweep whose runs are computed."""

from conoid.cases.run import State

from ..sweeps.sweep import SweepInfo, SweepPoint


def ended(info: SweepInfo) -> int:
    """Returns the number of runs that have ended."""
    return sum(each.run.state.final for each in info.points)


def standing(info: SweepInfo) -> str:
    """Returns the number of runs that have ended, and the numbers of the other runs by state."""
    others = (f"{n} {state.replace('_', ' ')}" for state, n in info.states.items() if n and not State(state).final)
    return ", ".join([f"{ended(info)} of {info.total} runs have ended", *others])


def how(point: SweepPoint) -> str:
    """Returns a text with the values of a point and the end of its run."""
    values = ", ".join(f"{key} = {value}" for key, value in point.values.items())
    why = f": {point.run.message or point.run.cause}" if point.run.state is not State.SUCCEEDED else ""
    return f"{values}: {point.run.state.value}{why}"
