"""The queue: who waits, in which order, and for what. Pure functions over the runs that are open."""

from collections.abc import Iterable, Set

from conoid.cases.run import State

from .events import Run


def in_state(runs: Iterable[Run], state: State) -> list[Run]:
    """The runs in ``state``, first come first."""
    return sorted((run for run in runs if run.state is state), key=lambda run: run.id)


def reason(run_id: str, runs: Iterable[Run], used: int, slots: int) -> str:
    """What a queued run waits for, where ``used`` of ``slots`` ranks run; empty for any other run."""
    waiting = in_state(runs, State.QUEUED)
    place = next((place for place, run in enumerate(waiting) if run.id == run_id), None)
    if place is None:
        return ""
    if place:
        return f"waiting for {place} earlier run{'s' if place > 1 else ''}"
    return f"waiting for {waiting[0].ranks} of {slots} slots; {max(0, slots - used)} free"


def stranded(runs: Iterable[Run], looked_after: Set[str]) -> list[str]:
    """The runs that neither wait for their turn nor are looked after otherwise."""
    waits = {State.ACCEPTED, State.QUEUED}
    return [run.id for run in runs if run.state not in waits and run.id not in looked_after]
