"""What is measured of a run: probes, columns of history.csv; references, numbers that it is compared with."""

from typing import Annotated, Literal

from ..units import QUANTITY, Length, Time, Written
from .tables import Axis, Model, Name, Point, Positive, SetName

ProbeField = Literal[
    "stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy",
    "pressure", "mises", "plastic_strain", "damage", "temperature", "density", "internal_energy",
    "velocity_x", "velocity_y", "velocity_z", "contact_force_x", "contact_force_y", "contact_force_z",
    "wall_force_x", "wall_force_y", "wall_force_z", "contact_impulse_x", "contact_impulse_y", "contact_impulse_z",
    "wall_impulse_x", "wall_impulse_y", "wall_impulse_z", "mass", "momentum_x", "momentum_y", "momentum_z",
    "kinetic_energy", "centre_x", "centre_y", "centre_z", "centre_velocity_x", "centre_velocity_y",
    "centre_velocity_z", "residual_velocity", "residual_mass", "fragment_velocity", "fragment_mass", "penetration",
    "hole_diameter", "hole_width", "cone_angle",
]  # fmt: skip
SUMS = ("mass", "momentum", "kinetic_energy", "centre", "centre_velocity", "residual_velocity", "residual_mass")
"""Fields that are sums over nodes, without their components."""
FRAGMENTS = ("fragment_velocity", "fragment_mass")
"""Fields of the heaviest fragment beyond a plane."""
BEYOND = ("residual_velocity", "residual_mass", *FRAGMENTS)
"""Fields of what lies beyond a plane."""
SHAPES = ("penetration", "hole_diameter", "hole_width", "cone_angle")
"""Fields that are lengths and angles of a body, round or along a line."""
PUSHES = ("contact_force", "contact_impulse", "wall_force", "wall_impulse")
"""Fields of what pushes a part, without their components."""


def kind(field: str) -> str:
    """A field without its component: ``momentum`` of ``momentum_x``."""
    bare = field[:-2] if field[-2:] in ("_x", "_y", "_z") else field
    return bare if bare in (*SUMS, *PUSHES, "velocity") else field


class Beyond(Model):
    """One side of a plane that stands still, ``axis = at``."""

    axis: Axis
    """The normal of the plane."""
    at: Length = 0.0
    """Where the plane cuts the axis."""
    side: Literal["above", "below"] = "above"
    """Which side: that of larger or of smaller coordinates."""


class Probe(Model):
    """A column of history.csv: what ``field`` says of a part, or of what of it starts in a box.

    Means: Stresses, ``pressure``, ``mises``, ``plastic_strain``, ``damage``, ``temperature``, ``density``,
    ``internal_energy`` (per mass, J/kg) and ``velocity`` are mass-weighted means over the tets of the part whose centre
    starts in the box, or no further outside of it than a hundredth of the shortest edge of the part. Stresses are
    positive in tension, pressure in compression.

    Pushes: ``contact_force`` is what other bodies push the whole part with, N, normal forces and friction, as a mean
    since the line before; of one other part, ``by``, where that is given. ``wall_force`` is what a wall, or all walls,
    push it with. ``contact_impulse`` and ``wall_impulse``, N s, are the same since the start. All hold the whole last
    step of a run, of which its last velocities hold half.

    Sums over the nodes of the part that start in the box and are in the set ``on``, with the velocities of the line's
    time: ``mass``, ``momentum``, ``kinetic_energy`` (the ledger's has products of two steps, and differs by the order
    of the step squared), ``centre`` and ``centre_velocity``, position and velocity of the centre of mass. With
    ``beyond`` only of nodes that are on that side of a plane at that time. Nodes without tets count until they
    leave. Of a rigid part as a whole they are those of the body, with the inertia and the centre that it has; of some
    of its nodes sums over these.

    Behind a target: ``residual_mass`` is the mass of the part ``beyond`` a plane, ``residual_velocity`` its mass-mean
    velocity along the axis of the plane, positive away from it, and 0 where nothing is there. ``fragment_mass`` and
    ``fragment_velocity`` are those of the heaviest fragment of the part whose centre is there: what holds together by
    faces.

    Shapes: ``penetration`` is as the reference of that name (below), along ``axis``. ``hole_width`` and
    ``hole_diameter``, of the free opening of the part in the plane ``axis = at`` round the line through ``centre``:
    twice the smallest distance from the line to matter, and the diameter of the circle that has the area which is seen
    from the line; by 360 rays, those that met no matter at the start (behind planes of symmetry) left out; both are
    wrong by about a tet, 0 while the line is in matter, and not a number where the opening reaches the edge of the
    body. ``cone_angle``: the full angle of the cone that is broken out of a plate, without unit: 2 arctan((R - r) /
    thickness). R and r are the radii of circles with the area that is damaged (more than half) or not joined to the
    heaviest fragment of the part any more, at its face at the high and at the low end of ``axis``, as the plate
    started; it is below zero where the wide end is the low one, and holds for one cone a plate.
    """

    name: Name
    """Of the column, and for references; no column of every run, such as ``kinetic`` or ``dt``, has it."""
    part: Name
    """What is measured."""
    field: ProbeField
    """What is measured of it."""
    wall: Name | None = None
    """Of ``wall_force`` and ``wall_impulse``: the name of the wall; all walls when absent."""
    by: Name | None = None
    """Of ``contact_force`` and ``contact_impulse``: the part that pushes; all other bodies when absent."""
    low: Point | None = None
    """Lowest corner of the box; with ``high``. Of means and sums; without it, the whole part."""
    high: Point | None = None
    """Highest corner of the box; with ``low``."""
    on: SetName | None = None
    """Of means and sums: a set of nodes or a surface of the mesh file of the part, by name (docs/howto/meshes.md): of
    means the tets that have a node of it, of sums its nodes. With a box those that are in both."""
    beyond: Beyond | None = None
    """Of sums and of what is behind a target: the side of a plane, ``{ axis = "z", at = "8 mm" }``."""
    axis: Axis | None = None
    """Of shapes: along which axis."""
    at: Length | None = None
    """Of ``hole_width`` and ``hole_diameter``: where the plane across the axis cuts it."""
    centre: Point | None = None
    """Of ``hole_width``, ``hole_diameter`` and ``cone_angle``: any point of the line; the origin when absent."""


Quantity = Literal[
    "extent", "radius", "plastic_strain_max", "temperature_max", "speed_mean", "stress_max",
    "probe_mean", "probe_max", "probe_min", "probe_last", "contact_time", "contact_loss", "penetration",
    "worst_residual",
]  # fmt: skip


class Reference(Model):
    """A published or derived number that the finished run is compared with.

    ``extent``: largest minus smallest coordinate of a part along ``axis``, m. ``radius``: largest distance of a part's
    nodes from the line through the origin along ``axis``, m. ``plastic_strain_max``, ``temperature_max`` (K),
    ``stress_max`` (largest |stress component|, Pa) over a part. ``speed_mean``: mass-mean velocity of a part along
    ``axis``, m/s. ``probe_*``: of a history column between ``since`` and ``until``; ``probe_last`` is its last value.
    ``contact_time``: last time at which a wall or another body pushes, s. ``contact_loss``: energy lost by contact over
    the initial energy. ``penetration``: how much of the thickness of all other parts along ``axis`` lies in front of
    the end of the hole that a part has made in them round the axis through the origin, m; cavities ahead of the hole do
    not count. Nodes without tets do not count for ``extent`` and ``radius``. ``worst_residual``: of the energy ledger.
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
    """Of which probe, for ``probe_mean``, ``probe_max``, ``probe_min`` and ``probe_last``."""
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
