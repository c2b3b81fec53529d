"""What loads of a Radioss deck ask of it, and what they add to the case."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ..account import Entry
from ..draft import Draft
from ..holds import Course, Hold
from ..start import Start
from ..topology import Chosen, Point
from ..walls import Stop


@dataclass
class Scene:
    """The deck as its loads see it."""

    draft: Draft
    nodes: Callable[[int, Entry], Chosen]
    curve: Callable[[int, Entry], Course]
    points: Callable[[], Mapping[int, Point]]
    """Where nodes are, in the unit of the deck."""
    rigid: frozenset[str]
    """Keys of the rigid bodies."""
    end: float
    starts: list[Start] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    walls: list[Stop] = field(default_factory=list)
