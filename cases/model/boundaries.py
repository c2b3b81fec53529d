"""The models of boundaries: planes of symmetry, walls, prescribed motion, gravity, tractions."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Acceleration, Length, Mass, Ratio, Speed, Stress, Time
from .motion import Spin
from .tables import Axis, Direction, Model, Name, Point, SetName, Velocity

Course = tuple[tuple[Time, Ratio], ...]
"""Pairs of a time and a factor."""


class Symmetry(Model):
    """A plane of symmetry ``axis = at``, without friction. Nodes that start on the plane stay on it; nodes that move
    towards it are in contact with their mirror image. No node passes the plane. The plane reflects free nodes (without
    tets). A crack cannot open in the plane itself: half of a body that fractures in its middle is not equivalent to the
    full body.
    """

    kind: Literal["symmetry"]
    """Selects this boundary."""
    axis: Axis
    """Normal of the plane."""
    at: Length = 0.0
    """Coordinate of the plane along ``axis``."""
    parts: tuple[Name, ...] = ()
    """Names of the parts to which it applies; all parts when empty."""
    on: SetName | None = None
    """Name of a node set or a surface in the mesh file of the parts ([howto/meshes.md](../howto/meshes.md)): exactly
    its nodes start on the plane, up to a hundredth of the shortest edge off it. All other nodes are beside the plane,
    also where they touch it, as on the faces of a crack. Default: the nodes on the plane within rounding."""


class Wall(Model):
    """A rigid wall that nodes cannot pass: a plane, a cylinder or a sphere; fixed, moving on a prescribed course, or
    free with a ``mass``. The wall does not rotate, and does not limit the time step.
    """

    kind: Literal["wall"]
    """Selects this boundary."""
    name: Name = "wall"
    """Name of the wall in messages and for probes. No two walls have the same name."""
    shape: Literal["plane", "cylinder", "sphere"] = "plane"
    """Surface of the wall. A cylinder is infinitely long."""
    point: Point
    """Position at the start: any point of a plane, any point of the axis of a cylinder, centre of a sphere."""
    normal: Direction | None = None
    """With ``shape = "plane"``: normal, which points out of the wall to the side of the bodies. Its length has no
    effect."""
    axis: Direction | None = None
    """With ``shape = "cylinder"``: direction of the axis. Its length has no effect."""
    radius: Annotated[Length, Field(gt=0)] | None = None
    """With ``shape = "cylinder"`` or ``"sphere"``: radius."""
    side: Literal["outside", "inside"] = "outside"
    """With ``shape = "cylinder"`` or ``"sphere"``: whether the bodies are outside or inside of the surface."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    """Velocity of the wall. Without ``mass`` it is prescribed during the whole run, and its work is external work;
    with ``mass`` it is the initial velocity."""
    course: Course = ()
    """Factor of ``velocity`` over time, as pairs of time and factor (see ``kind = "velocity"``). Must not be combined
    with ``mass``."""
    mass: Annotated[Mass, Field(gt=0)] | None = None
    """Mass of a free wall: only the impulses of the bodies change its velocity. Default: the velocity is prescribed."""
    parts: tuple[Name, ...] = ()
    """Names of the parts that it stops; all parts when empty."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient of friction."""

    @property
    def plain(self) -> bool:
        """Whether the wall is a fixed plane."""
        return self.shape == "plane" and self.mass is None and not any(self.velocity)


class Prescribed(Model):
    """A prescribed velocity of the nodes that start in the box ``low`` to ``high``; of all nodes of the parts without a
    box.

    Components that are absent are free. Two boundaries cannot prescribe different values for the same component of a
    node. Walls do not stop nodes of which a component is prescribed. Nodes up to a hundredth of the shortest edge of
    their part outside the box count as inside.
    """

    kind: Literal["velocity"]
    """Selects this boundary."""
    parts: tuple[Name, ...] = ()
    """Names of the parts to which it applies; all parts when empty."""
    low: Point | None = None
    """Corner of the box with the lowest coordinates; together with ``high``."""
    high: Point | None = None
    """Corner of the box with the highest coordinates; together with ``low``."""
    x: Speed | None = None
    """Velocity along x. Default: free."""
    y: Speed | None = None
    """Velocity along y. Default: free."""
    z: Speed | None = None
    """Velocity along z. Default: free."""
    on: SetName | None = None
    """Name of a node set or a surface in the mesh file of the parts (docs/howto/meshes.md), instead of a box. With a
    box: the nodes that are in both."""
    course: Course = ()
    """Factor of the velocity over time, as pairs of time and factor, such as ``[["0 us", 0], ["2 us", 1]]`` for a
    ramp: linear between the pairs, constant before the first and after the last. Default: constant velocity."""


class Rotation(Model):
    """A prescribed rigid rotation of all nodes of the parts at constant angular velocity. Walls do not stop nodes with
    a prescribed rotation."""

    kind: Literal["rotation"]
    """Selects this boundary."""
    parts: tuple[Name, ...] = ()
    """Names of the parts that rotate; all parts when empty."""
    spin: Spin
    """Axis of rotation and angular velocity."""
    on: SetName | None = None
    """Name of a node set or a surface in the mesh file of the parts (docs/howto/meshes.md): only its nodes are
    prescribed."""


class Gravity(Model):
    """A uniform acceleration of the parts."""

    kind: Literal["gravity"]
    """Selects this boundary."""
    acceleration: tuple[Acceleration, Acceleration, Acceleration]
    """Acceleration along x, y, z; not zero."""
    course: Course = ()
    """Factor of the acceleration over time, as pairs of time and factor (see ``kind = "velocity"``). Default:
    constant from the start, which makes bodies at rest vibrate; a ramp avoids that."""
    parts: tuple[Name, ...] = ()
    """Names of the parts on which it acts; all parts when empty. If ``shared`` bonds join parts to one body, name
    either all parts of this body or none."""


class Around(Model):
    """The region between two radii around an infinite line. The bore of a tube: ``radius`` equal to that of the
    bore; its outside: ``inner_radius`` equal to the outer radius, and a larger ``radius``.
    """

    base: Point = (0.0, 0.0, 0.0)
    """Any point of the line."""
    axis: Axis = "z"
    """Direction of the line."""
    inner_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Smallest distance from the line."""
    radius: Annotated[Length, Field(gt=0)]
    """Largest distance from the line; not below ``inner_radius``. Nodes up to a hundredth of the shortest edge of
    their part beyond either radius count as inside."""


class Traction(Model):
    """A distributed load on the free faces whose three nodes start in the region (box, cylinder and set; the whole
    surface of the parts without a region). Either ``stress`` or ``pressure`` is given.

    The load is a force per initial area with a constant direction; a pressure that ``follows`` acts on the deformed
    surface. A face is loaded until its tet is deleted; with ``follows`` also until its tet has separated from all
    others. Faces that become free later are not loaded, nor faces on a plane of symmetry. Nodes up to a hundredth of
    the shortest edge of their part outside the region count as inside. ``conoid validate`` prints the approximate
    loaded area; the run warns if the area in the mesh differs.
    """

    kind: Literal["traction"]
    """Selects this boundary."""
    stress: tuple[Stress, Stress, Stress] | None = None
    """Force per area along x, y, z; not zero."""
    pressure: Stress | None = None
    """Force per area against the outward normal of each face; not zero. The load uses the initial area and normal,
    except with ``follows``."""
    follows: bool = False
    """Whether ``pressure`` acts on the current area of each face, against its current normal, as a gas or a liquid
    does. On a closed surface the resultant force and moment of the pressure are zero up to rounding."""
    course: Course = ()
    """Factor of the load over time, as pairs of time and factor (see ``kind = "velocity"``). Default: constant from
    the start."""
    parts: tuple[Name, ...] = ()
    """Names of the parts on which it acts; all parts when empty."""
    low: Point | None = None
    """Corner of the box with the lowest coordinates; together with ``high``."""
    high: Point | None = None
    """Corner of the box with the highest coordinates; together with ``low``."""
    cylinder: Around | None = None
    """Region around a line: ``{ axis = "z", radius = "5 mm" }`` is the bore of a tube with this inner radius. With a
    box: the faces that are in both."""
    on: SetName | None = None
    """Name of a surface or a node set in the mesh file of the parts (docs/howto/meshes.md): the free faces of which
    all nodes are in it. With a box or a cylinder: the faces that are in both."""


Boundary = Annotated[Symmetry | Wall | Prescribed | Rotation | Gravity | Traction, Field(discriminator="kind")]
