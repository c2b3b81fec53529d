"""What is measured of a run: probes, columns of history.csv; references, numbers that it is compared with."""

from typing import Annotated, Literal

from .tables import Axis, Model, Name, Point, Positive
from .units import QUANTITY, Time, Written

ProbeField = Literal[
    "stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy",
    "pressure", "mises", "plastic_strain", "damage", "temperature", "density", "internal_energy",
    "velocity_x", "velocity_y", "velocity_z", "contact_force_x", "contact_force_y", "contact_force_z",
    "wall_force_x", "wall_force_y", "wall_force_z",
]  # fmt: skip


class Probe(Model):
    """A column of history.csv: the mean of a field over the tets of a part whose centre starts in a box, or no further
    outside of it than a hundredth of the shortest edge of the part.

    Without ``low`` and ``high`` it is the whole part. ``internal_energy`` is per mass, J/kg; stresses are positive in
    tension, pressure in compression. ``contact_force`` is what other bodies push the whole part with, N, as a mean
    since the line before; ``wall_force`` what a wall, or all walls, push it with. Both hold the whole last step of a
    run, of which its last velocities hold half.
    """

    name: Name
    """Of the column, and for references; no column of every run, such as ``kinetic`` or ``dt``, has it."""
    part: Name
    """Whose tets are measured."""
    field: ProbeField
    """What is measured."""
    wall: Name | None = None
    """Of ``wall_force``: the name of the wall; all walls when absent."""
    low: Point | None = None
    """Lowest corner of the box; with ``high``."""
    high: Point | None = None
    """Highest corner of the box; with ``low``."""


Quantity = Literal[
    "extent", "radius", "plastic_strain_max", "temperature_max", "speed_mean", "stress_max",
    "probe_mean", "probe_max", "probe_min", "contact_time", "contact_loss", "penetration", "worst_residual",
]  # fmt: skip


class Reference(Model):
    """A published or derived number that the finished run is compared with.

    ``extent``: largest minus smallest coordinate of a part along ``axis``, m. ``radius``: largest distance of a
    part's nodes from the line through the origin along ``axis``, m. ``plastic_strain_max``, ``temperature_max`` (K),
    ``stress_max`` (largest |stress component|, Pa) over a part. ``speed_mean``: mass-mean velocity of a part along
    ``axis``, m/s. ``probe_*``: of a history column between ``since`` and ``until``. ``contact_time``: last time at
    which a wall or another body pushes, s. ``contact_loss``: energy lost by contact over the initial energy.
    ``penetration``: how much of the thickness of all other parts along ``axis`` lies in front of the end of the hole
    that a part has made in them round the axis through the origin, m; cavities ahead of the hole do not count. Nodes
    without tets do not count for ``extent`` and ``radius``.
    ``worst_residual``: of the energy ledger.
    """

    quantity: Quantity
    """What is measured of the run."""
    value: Annotated[float, Written(QUANTITY)]
    """What it should be; its unit is that of the quantity."""
    tolerance: Annotated[float, Written(QUANTITY), Positive]
    """Absolute, in SI as ``value``."""
    source: str
    """Where the number comes from."""
    part: Name | None = None
    """Of which part, for quantities of a part."""
    probe: Name | None = None
    """Of which probe, for ``probe_mean``, ``probe_max`` and ``probe_min``."""
    axis: Axis | None = None
    """Along or round which axis, for ``extent``, ``radius``, ``speed_mean`` and ``penetration``."""
    since: Time = 0.0
    """Begin of the window of ``probe_*``."""
    until: Time | None = None
    """End of the window of ``probe_*``; the end of the run when absent."""

    @property
    def title(self) -> str:
        """What reports call it."""
        return " ".join(word for word in (self.quantity, self.part, self.probe, self.axis) if word)
