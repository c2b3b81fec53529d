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
    """The parts of the deck that its loads use."""

    draft: Draft
    nodes: Callable[[int, Entry], Chosen]
    """Returns the node set of a number; raises ValueError."""
    bodies: Callable[[int, Entry], Chosen]
    """Returns the part set of a number; raises ValueError."""
    part: Callable[[int], Chosen]
    curve: Callable[[int], Course]
    """Returns the curve of a number. Raises ValueError."""
    end: float
    starts: list[Start] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    walls: list[Stop] = field(default_factory=list)

    def lasting(self, number: int) -> Course:
        """Returns the curve of a number, which must not end before the run. Raises ValueError."""
        found = self.curve(number)
        if found and found[-1][0] < self.end < float("inf"):
            raise ValueError(f"the curve ends at {found[-1][0]:g}, before the end of the run at {self.end:g}")
        return found
