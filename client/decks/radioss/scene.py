"""The interface between the loads of a Radioss deck and the case."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ..account import Entry
from ..draft import Draft
from ..holds import Course, Hold
from ..start import Start
from ..topology import Chosen, Point
from ..walls import Stop
from .text import Fields


@dataclass(frozen=True)
class Moved:
    """A wall that moves with a node of the deck."""

    node: int
    stop: Stop
    fields: Fields


@dataclass
class Scene:
    """Parts, nodes and bodies of the deck that its loads use, and the case that the loads change."""

    draft: Draft
    nodes: Callable[[int, Entry], Chosen]
    curve: Callable[[int, Entry], Course]
    points: Callable[[], Mapping[int, Point]]
    """Function that returns the positions of nodes, in the unit of the deck."""
    rigid: frozenset[str]
    """Keys of the bodies that are rigid."""
    end: float
    starts: list[Start] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    walls: list[Stop] = field(default_factory=list)
    moved: list[Moved] = field(default_factory=list)
