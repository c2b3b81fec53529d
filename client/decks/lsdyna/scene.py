"""What loads of an LS-DYNA deck ask of it, and what they add to the case."""

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
    """The deck as its loads see it."""

    draft: Draft
    nodes: Callable[[int, Entry], Chosen]
    """The node set of a number; raises ValueError."""
    bodies: Callable[[int, Entry], Chosen]
    """The part set of a number; raises ValueError."""
    part: Callable[[int], Chosen]
    curve: Callable[[int], Course]
    """Raises ValueError."""
    end: float
    starts: list[Start] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    walls: list[Stop] = field(default_factory=list)

    def lasting(self, number: int) -> Course:
        """The curve of a number, which must not end before the run does. Raises ValueError."""
        found = self.curve(number)
        if found and found[-1][0] < self.end < float("inf"):
            raise ValueError(f"the curve ends at {found[-1][0]:g}, before the end of the run at {self.end:g}")
        return found
