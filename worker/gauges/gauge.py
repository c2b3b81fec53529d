"""Interface of gauges, and the data that they read. A gauge is a group of probes that are measured in the same way."""

from typing import Any, NamedTuple, Protocol

from ..boundaries.boundaries import Boundary
from ..boundaries.wall_shapes import Walls
from ..clock import Clock
from ..contact.stage import Contact
from ..erosion import Erosion
from ..fracture.stage import Fracture
from ..model.state import Floats, Model
from ..parallel.comm import Comm
from ..rigid.stage import Rigid


class Scene(NamedTuple):
    """Objects of a simulation on this rank that gauges read."""

    model: Model
    contact: Contact | None
    walls: tuple[Boundary, ...]
    rigid: Rigid | None
    moving: Walls
    erosion: Erosion | None
    fracture: Fracture | None
    clock: Clock
    comm: Comm


class Gauge(Protocol):
    """A group of probes that are measured in the same way. Every method is collective and returns equal values on all
    ranks.
    """

    def measure(self, v: Floats) -> dict[int, float]:
        """Return the present values; the keys are the numbers of the probes. ``v`` (nodes, 3): present velocities,
        m/s.
        """

    def keep(self) -> Any:
        """Return the state of the gauges for a checkpoint: lists of numbers and arrays, equal on all ranks."""

    def resume(self, known: Any) -> None:
        """Restore the state of the gauges from the lists that ``keep`` returned."""
