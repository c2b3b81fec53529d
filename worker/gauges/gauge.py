"""Interface of gauges, groups of probes that are measured in one way, and the data that they read."""

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
    """The parts of a simulation on this rank that gauges read."""

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
    """A group of probes. Every method is collective and returns the same values on all ranks."""

    def measure(self, v: Floats) -> dict[int, float]:
        """Return the present values by the number of the probe; ``v`` (nodes, 3): velocities now, m/s."""

    def keep(self) -> Any:
        """Return the state of the gauges for a checkpoint: numbers and arrays in lists, equal on all ranks."""

    def resume(self, known: Any) -> None:
        """Restore the state of the gauges from the data of ``keep``."""
