"""The models of measurements: probes (columns of history.csv), and references (values with which a run is compared)."""

from typing import Annotated, Literal

from ..units import QUANTITY, Length, Time, Written
from .tables import Axis, Model, Name, Point, Positive, SetName

ProbeField = Literal[
    "stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy",
    "pressure", "mises", "plastic_strain", "damage", "temperature", "density", "internal_energy",
    "velocity_x", "velocity_y", "velocity_z", "contact_force_x", "contact_force_y", "contact_force_z",
    "wall_force_x", "wall_force_y", "wall_force_z", "contact_impulse_x", "contact_impulse_y", "contact_impulse_z",
    "wall_impulse_x", "wall_impulse_y", "wall_impulse_z", "wall_position_x", "wall_position_y", "wall_position_z",
    "wall_velocity_x", "wall_velocity_y", "wall_velocity_z", "mass", "momentum_x", "momentum_y", "momentum_z",
    "kinetic_energy", "centre_x", "centre_y", "centre_z", "centre_velocity_x", "centre_velocity_y",
    "centre_velocity_z", "residual_velocity", "residual_mass", "fragment_velocity", "fragment_mass", "penetration",
    "hole_diameter", "hole_width", "cone_angle", "pressure_max", "pressure_min", "mises_max", "plastic_strain_max",
    "damage_max", "temperature_max",
]  # fmt: skip
SUMS = ("mass", "momentum", "kinetic_energy", "centre", "centre_velocity", "residual_velocity", "residual_mass")
"""Fields that are sums over nodes, without the letter of their component."""
PEAKS = ("pressure_max", "pressure_min", "mises_max", "plastic_strain_max", "damage_max", "temperature_max")
"""Fields that are largest or smallest values over tets."""
FRAGMENTS = ("fragment_velocity", "fragment_mass")
"""Fields of the heaviest fragment beyond a plane."""
BEYOND = ("residual_velocity", "residual_mass", *FRAGMENTS)
"""Fields of the material beyond a plane."""
SHAPES = ("penetration", "hole_diameter", "hole_width", "cone_angle")
"""Fields that are lengths and angles of a body, around or along a line."""
PUSHES = ("contact_force", "contact_impulse", "wall_force", "wall_impulse")
"""Fields of forces and impulses on a part, without the letter of their component."""
COURSES = ("wall_position", "wall_velocity")
"""Fields of the motion of a wall, without the letter of their component."""
WHOLE = (*PUSHES, *COURSES, *SHAPES, *FRAGMENTS)
"""Fields that are measured on whole parts: they do not use the keys ``low``, ``high`` and ``on``."""


def kind(field: str) -> str:
    """Returns the field without the letter of its component, such as ``momentum`` for ``momentum_x``."""
    bare = field[:-2] if field[-2:] in ("_x", "_y", "_z") else field
    return bare if bare in (*SUMS, *PUSHES, *COURSES, "velocity") else field


class Beyond(Model):
    """A half-space: one side of a fixed plane ``axis = at``."""

    axis: Axis
    """Normal of the plane."""
    at: Length = 0.0
    """Coordinate of the plane along ``axis``."""
    side: Literal["above", "below"] = "above"
    """Side of the plane: ``above`` for larger, ``below`` for smaller coordinates."""


class Probe(Model):
    """A probe: a column of history.csv with one field of a part, over the whole part or over the region in which its
    nodes or tets start (box, set).

    **Means**, mass-weighted over the tets whose centre starts in the region: ``stress_*`` (tension positive),
    ``pressure`` (compression positive), ``mises``, ``plastic_strain``, ``damage``, ``temperature``, ``density``,
    ``internal_energy`` (J/kg), ``velocity_*``. Tets and nodes outside of the box count as inside if their distance from
    it is at most a hundredth of the shortest edge of the part.

    **Peaks**, largest and smallest values over the tets whose centre starts in the region: ``pressure_max``,
    ``pressure_min`` (negative: the largest tension), ``mises_max``, ``plastic_strain_max``, ``damage_max``,
    ``temperature_max``. Peaks include only the tets that exist at the time of the history line, not the deleted tets.

    **Forces** on the whole part, N, as a mean since the previous line: ``contact_force_*``, normal forces and friction
    from all other bodies or from the part ``by``; ``wall_force_*``, the forces from walls. ``contact_impulse_*`` and
    ``wall_impulse_*``, N s, are the integrals of the forces since the start. The impulses include the whole last time
    step; the velocities include only half of this step.

    **Motion of a wall**, which the key ``wall`` names; without ``part``: ``wall_position_*``, m, of the ``point`` of
    the wall, and ``wall_velocity_*``, m/s. The force of the bodies on the wall is minus ``wall_force_*`` without
    ``part``.

    **Sums** over the nodes that start in the region, with ``beyond`` only the nodes that are at present on that side of
    a plane: ``mass``, ``momentum_*``, ``kinetic_energy`` (from the velocities at the time of the line; the energy
    ledger uses products of two steps, which differ by the square of the time step), ``centre_*`` and
    ``centre_velocity_*`` (centre of mass). Sums include free nodes until these are deleted. For a whole rigid part the
    sums are computed from the mass, the centre of mass and the inertia of the part.

    **Behind a target**: ``residual_mass`` is the mass of the part ``beyond`` a plane, ``residual_velocity`` is its
    mass-weighted mean velocity along the normal, positive away from the plane, 0 without mass. A run warns if at its
    end a tenth of the part or more has not reached the plane and still moves towards it. ``fragment_mass`` and
    ``fragment_velocity`` are the mass and the velocity of the heaviest fragment whose centre is beyond the plane; the
    tets of a fragment are joined by faces.

    **Shapes**: ``penetration``: depth along ``axis``, defined as for the reference ``penetration``. ``hole_width`` and
    ``hole_diameter``: size of the free opening of the part in the plane ``axis = at`` around the line through
    ``centre``. The width is twice the smallest distance from the line to material. The diameter is that of a circle
    with the area that is visible from the line. The hole fields use 360 rays from the line, without the rays that met
    no material at the start (behind planes of symmetry). The error of a hole field is about the size of a tet. A hole
    field is 0 while material is on the line, and not a number if the opening reaches the edge of the body.
    ``cone_angle``: full angle of the cone broken out of a plate, 2 arctan((R - r) / thickness) in radians, for one cone
    per plate. R is the radius at the high end of ``axis`` and r the radius at the low end: the radius of a circle with
    the area of the plate's face that has more than half of the damage or is separated from the heaviest fragment. The
    angle is negative if the wide end of the cone is at the low end.
    """

    name: Name
    """Name of the probe's column in history.csv. Names of columns that every run has (such as ``kinetic`` or ``dt``)
    cannot be used for a probe."""
    part: Name = ""
    """Name of the part that is measured. The key ``part`` must be absent with ``wall_position_*`` and
    ``wall_velocity_*``; with ``wall_force_*`` and ``wall_impulse_*`` an absent key means all parts."""
    field: ProbeField
    """The measured field; the description of the table ``probes`` lists the fields."""
    wall: Name | None = None
    """Name of the wall. With ``wall_force_*`` and ``wall_impulse_*`` an absent key means all walls; with
    ``wall_position_*`` and ``wall_velocity_*`` the key is required."""
    by: Name | None = None
    """With ``contact_force_*`` and ``contact_impulse_*``: name of the part that exerts the force; all other bodies if
    absent."""
    low: Point | None = None
    """With means, peaks and sums: corner of the box with the lowest coordinates; must be combined with ``high``. The
    probe measures the whole part if ``low`` is absent."""
    high: Point | None = None
    """With means, peaks and sums: corner of the box with the highest coordinates; must be combined with ``low``."""
    on: SetName | None = None
    """With means, peaks and sums: name of a node set or a surface in the mesh file of the part (docs/howto/meshes.md).
    Means and peaks use the tets that have a node in the set; sums use the nodes of the set. If a box is also given,
    only nodes or tets that are in the set and in the box count."""
    beyond: Beyond | None = None
    """With sums and fields behind a target: side of a plane, such as ``{ axis = "z", at = "8 mm" }``."""
    axis: Axis | None = None
    """With the fields of shapes: direction of the line."""
    at: Length | None = None
    """With ``hole_width`` and ``hole_diameter``: coordinate along ``axis`` of the plane of the hole."""
    centre: Point | None = None
    """With ``hole_width``, ``hole_diameter`` and ``cone_angle``: any point of the line; the origin if absent."""


Quantity = Literal[
    "extent", "radius", "plastic_strain_max", "temperature_max", "speed_mean", "stress_max",
    "probe_mean", "probe_max", "probe_min", "probe_last", "contact_time", "contact_loss", "penetration",
    "worst_residual",
]  # fmt: skip


class Reference(Model):
    """A published or derived value with which the finished run is compared. ``conoid run --check`` fails if the
    difference between result and value exceeds ``tolerance``.

    ``extent``: largest minus smallest coordinate of a part along ``axis``, m. ``radius``: largest distance of a node of
    the part from the line through the origin along ``axis``, m. ``plastic_strain_max``, ``temperature_max`` (K),
    ``stress_max`` (largest |stress component|, Pa): largest value over the part. ``speed_mean``: mass-weighted mean
    velocity of a part along ``axis``, m/s. ``probe_mean``, ``probe_max``, ``probe_min``, ``probe_last``: time mean,
    largest, smallest and last value of a probe between ``since`` and ``until``. ``contact_time``: last time at which a
    wall or another body exerts a force, s. ``contact_loss``: energy dissipated by contact, divided by the initial
    energy. ``penetration``: thickness of all other parts in front of the end of the hole that the part has made along
    ``axis`` through the origin, m. Cavities ahead of the hole do not count. ``worst_residual``: largest residual of the
    energy ledger. The quantities ``extent`` and ``radius`` do not include free nodes.
    """

    quantity: Quantity
    """The measured quantity."""
    value: Annotated[float, Written(QUANTITY)]
    """Expected value, in the unit of ``quantity``."""
    tolerance: Annotated[float, Written(QUANTITY), Positive]
    """Largest allowed absolute difference from ``value``, in the unit of ``quantity``."""
    source: str
    """Source of the value: publication, derivation or measurement."""
    part: Name | None = None
    """With quantities of a part: name of the part."""
    probe: Name | None = None
    """With ``probe_mean``, ``probe_max``, ``probe_min`` and ``probe_last``: name of the probe."""
    axis: Axis | None = None
    """With ``extent``, ``radius``, ``speed_mean`` and ``penetration``: direction along which the quantity is
    measured."""
    since: Time = 0.0
    """With ``probe_*``: start of the time window in which the probe is evaluated."""
    until: Time | None = None
    """With ``probe_*``: end of the time window; the end of the run if absent."""

    @property
    def title(self) -> str:
        """Title of the reference in reports."""
        return " ".join(word for word in (self.quantity, self.part, self.probe, self.axis) if word)
