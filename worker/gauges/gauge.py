"""A gauge: the probes of a case that are measured in one way, and what of the simulation they look at."""

from typing import Any, NamedTuple, Protocol

from ..boundaries.boundaries import Boundary
from ..clock import Clock
from ..contact.stage import Contact
from ..erosion import Erosion
from ..fracture.stage import Fracture
from ..model.state import Floats, Model
from ..parallel.comm import Comm
from ..rigid.stage import Rigid


class Scene(NamedTuple):
    """What gauges look at, on this rank."""

    model: Model
    contact: Contact | None
    walls: tuple[Boundary, ...]
    rigid: Rigid | None
    erosion: Erosion | None
    fracture: Fracture | None
    clock: Clock
    comm: Comm


class Gauge(Protocol):
    """All ranks take part in everything, and have the same answers."""

    def measure(self, v: Floats) -> dict[int, float]:
        """The present values by the number of the probe; ``v`` (nodes, 3): velocities now, m/s."""

    def keep(self) -> Any:
        """What it remembers, equal on all ranks: numbers and arrays in lists."""

    def resume(self, known: Any) -> None:
        """Takes it back."""
