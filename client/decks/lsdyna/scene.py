"""The interface between the loads of an LS-DYNA deck and the case."""

from collections.abc import Callable
from dataclasses import dataclass, field

from ..account import Entry
from ..draft import Draft
from ..holds import Course, Hold
from ..start import Start
from ..topology import Chosen
from ..walls import Stop


@dataclass
class Scene:
    """Parts, sets and curves of the deck that its loads use, and the case that the loads change."""

    draft: Draft
    nodes: Callable[[int, Entry], Chosen]
    """Function that returns a node set by its number; the function raises ValueError."""
    bodies: Callable[[int, Entry], Chosen]
    """Function that returns a part set by its number; the function raises ValueError."""
    part: Callable[[int], Chosen]
    group: Callable[[set[int]], Chosen]
    """Function that returns the target of single nodes."""
    curve: Callable[[int], Course]
    """Function that returns a curve by its number; the function raises ValueError."""
    end: float
    starts: list[Start] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    walls: list[Stop] = field(default_factory=list)

    def lasting(self, number: int) -> Course:
        """Returns the curve of a number. Raises ValueError if the curve ends before the run."""
        found = self.curve(number)
        if found and found[-1][0] < self.end < float("inf"):
            raise ValueError(f"the curve ends at {found[-1][0]:g}, before the end of the run at {self.end:g}")
        return found
