"""The models of boundaries: planes of symmetry, walls, prescribed motion, gravity, tractions."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Acceleration, Length, Mass, Ratio, Speed, Stress
from .courses import Course
from .motion import Spin
from .tables import Axis, Direction, Model, Name, Point, SetName, Velocity


class Symmetry(Model):
    """A plane of symmetry ``axis = at``, without friction. Nodes that start on the plane of symmetry stay on it; nodes
    that move towards the plane are in contact with their mirror image. No node passes the plane of symmetry. The plane
    of symmetry reflects free nodes (nodes without tets). A crack cannot open in a plane of symmetry: half of a body
    that fractures in its middle does not behave as the full body.
    """

    kind: Literal["symmetry"]
    """Selects this boundary."""
    axis: Axis
    """Normal of the plane of symmetry."""
    at: Length = 0.0
    """Coordinate of the plane of symmetry along ``axis``."""
    parts: tuple[Name, ...] = ()
    """Names of the parts to which the plane of symmetry applies; all parts if empty."""
    on: SetName | None = None
    """Name of a node set or a surface in the mesh file of the parts ([howto/meshes.md](../howto/meshes.md)). Exactly
    the nodes of the set are on the plane of symmetry; at the start a node of the set may be up to a hundredth of the
    shortest edge away from the plane. All other nodes are beside the plane even if they touch it, as on the faces of a
    crack. Default: the nodes that are on the plane within rounding errors."""


class Wall(Model):
    """A rigid wall that nodes cannot pass: a plane, a cylinder or a sphere. The wall is fixed, or has a prescribed
    motion, or moves freely with a ``mass``. A wall does not rotate and does not limit the time step.
    """

    kind: Literal["wall"]
    """Selects this boundary."""
    name: Name = "wall"
    """Name of the wall in messages and for probes. No two walls have the same name."""
    shape: Literal["plane", "cylinder", "sphere"] = "plane"
    """Shape of the wall's surface. A wall with the shape of a cylinder is infinitely long."""
    point: Point
    """Position of the wall at the start: any point of a plane, any point of the axis of a cylinder, centre of a
    sphere."""
    normal: Direction | None = None
    """With ``shape = "plane"``: normal of the wall, which points out of the wall to the side of the bodies. The length
    of the normal has no effect."""
    axis: Direction | None = None
    """With ``shape = "cylinder"``: direction of the axis of the wall. The length of this vector has no effect."""
    radius: Annotated[Length, Field(gt=0)] | None = None
    """With ``shape = "cylinder"`` or ``"sphere"``: radius of the wall."""
    side: Literal["outside", "inside"] = "outside"
    """With ``shape = "cylinder"`` or ``"sphere"``: whether the bodies are outside or inside of the wall's surface."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    """Velocity of the wall. Without ``mass`` the velocity is prescribed during the whole run, and the work of the wall
    counts as external work. With ``mass`` it is the initial velocity."""
    course: Course = ()
    """Factor of ``velocity`` over time, as pairs of time and factor (see ``kind = "velocity"``). The key ``course``
    must not be combined with ``mass``."""
    mass: Annotated[Mass, Field(gt=0)] | None = None
    """Mass of a wall that moves freely: only the impulses of the bodies change its velocity. If planes of symmetry cut
    the wall, the mass is that of the modelled part of the wall, and the wall does not move across these planes.
    Default: the wall has no mass, and its velocity is prescribed."""
    parts: tuple[Name, ...] = ()
    """Names of the parts that the wall stops; all parts if empty."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient of friction between the wall and the bodies."""

    @property
    def plain(self) -> bool:
        """Whether the wall is a fixed plane."""
        return self.shape == "plane" and self.mass is None and not any(self.velocity)


class Prescribed(Model):
    """A prescribed velocity of the nodes that start in the box ``low`` to ``high``; without a box, of all nodes of the
    parts.

    Velocity components that the case does not give are free. Two boundaries must not prescribe different values for the
    same velocity component of a node. Walls do not stop nodes that have a prescribed velocity component. Nodes outside
    of the box count as inside if their distance is at most a hundredth of the shortest edge of their part.
    """

    kind: Literal["velocity"]
    """Selects this boundary."""
    parts: tuple[Name, ...] = ()
    """Names of the parts to which the prescribed velocity applies; all parts if empty."""
    low: Point | None = None
    """Corner of the box with the lowest coordinates; must be combined with ``high``."""
    high: Point | None = None
    """Corner of the box with the highest coordinates; must be combined with ``low``."""
    x: Speed | None = None
    """Velocity along x. Default: the velocity along x is free."""
    y: Speed | None = None
    """Velocity along y. Default: the velocity along y is free."""
    z: Speed | None = None
    """Velocity along z. Default: the velocity along z is free."""
    on: SetName | None = None
    """Name of a node set or a surface in the mesh file of the parts (docs/howto/meshes.md), instead of a box. If a box
    is also given, only nodes that are in the set and in the box are selected."""
    course: Course = ()
    """Factor of the velocity over time, as pairs of time and factor, such as ``[["0 us", 0], ["2 us", 1]]`` for a ramp.
    The factor is linear between the pairs, constant before the first pair and after the last pair. Default: the
    velocity is constant."""


class Rotation(Model):
    """A prescribed rigid rotation of all nodes of the parts about an axis, which may move with a prescribed velocity.
    The axis keeps its direction. Walls do not stop nodes with a prescribed rotation."""

    kind: Literal["rotation"]
    """Selects this boundary."""
    parts: tuple[Name, ...] = ()
    """Names of the parts that rotate; all parts if empty."""
    spin: Spin
    """Axis of rotation at the start, and angular velocity of the prescribed rotation."""
    course: Course = ()
    """Factor of ``spin.rate`` over time, as pairs of time and factor (see ``kind = "velocity"``). Default: the angular
    velocity is constant."""
    velocity: tuple[Speed, Speed, Speed] = (0.0, 0.0, 0.0)
    """Velocity of the axis of rotation, such as the feed of a drill. The point ``spin.centre`` moves with the axis."""
    velocity_course: Course = ()
    """Factor of ``velocity`` over time, as pairs of time and factor. Default: the velocity of the axis is constant."""
    on: SetName | None = None
    """Name of a node set or a surface in the mesh file of the parts (docs/howto/meshes.md): only nodes of this set
    rotate."""


class Gravity(Model):
    """A uniform acceleration of the parts."""

    kind: Literal["gravity"]
    """Selects this boundary."""
    acceleration: tuple[Acceleration, Acceleration, Acceleration]
    """Acceleration along x, y, z; not the zero vector."""
    course: Course = ()
    """Factor of the acceleration over time, as pairs of time and factor (see ``kind = "velocity"``). Default: the
    acceleration is constant from the start, which makes bodies at rest vibrate; a ramp avoids the vibration."""
    parts: tuple[Name, ...] = ()
    """Names of the parts on which the acceleration acts; all parts if empty. If ``shared`` bonds join several parts to
    one body, name either all of these parts or none of them."""


class Around(Model):
    """The region between two radii around an infinite line. For the bore of a tube, set ``radius`` to the radius of the
    bore; for the outside of a tube, set ``inner_radius`` to the outer radius of the tube, and a larger ``radius``.
    """

    base: Point = (0.0, 0.0, 0.0)
    """Any point of the line around which the region lies."""
    axis: Axis = "z"
    """Direction of the line around which the region lies."""
    inner_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Smallest distance of the region from the line."""
    radius: Annotated[Length, Field(gt=0)]
    """Largest distance of the region from the line; not below ``inner_radius``. Nodes outside of the region count as
    inside if they are at most a hundredth of the shortest edge of their part beyond either radius."""


class Traction(Model):
    """A distributed load on free faces of the parts: on the faces whose three nodes start in the region (box, cylinder
    and set), or on the whole surface if no region is given. A load has either ``stress`` or ``pressure``.

    The load is a force per initial area in a constant direction. With ``follows`` a pressure acts on the deformed
    surface. A face is loaded until its tet is deleted. With ``follows`` the load also ends when the tet has separated
    from all other tets. Faces that become free during the run, and faces on a plane of symmetry, are not loaded. Nodes
    outside of the region count as inside if their distance is at most a hundredth of the shortest edge of their part.
    ``conoid validate`` prints the approximate loaded area. The run gives a warning if the loaded area in the mesh
    differs from the printed area.
    """

    kind: Literal["traction"]
    """Selects this boundary."""
    stress: tuple[Stress, Stress, Stress] | None = None
    """Force per area along x, y, z; not the zero vector."""
    pressure: Stress | None = None
    """Force per area against the outward normal of each face; not zero. The load uses the initial area and the initial
    normal of a face, except with ``follows``."""
    follows: bool = False
    """Whether ``pressure`` acts on the current area of each face, against its current normal, as a gas or a liquid
    does. The resultant force and moment of the pressure on a closed surface are zero, except for rounding errors."""
    course: Course = ()
    """Factor of the load over time, as pairs of time and factor (see ``kind = "velocity"``). Default: the load is
    constant from the start."""
    parts: tuple[Name, ...] = ()
    """Names of the parts on which the load acts; all parts if empty."""
    low: Point | None = None
    """Corner of the box with the lowest coordinates; must be combined with ``high``."""
    high: Point | None = None
    """Corner of the box with the highest coordinates; must be combined with ``low``."""
    cylinder: Around | None = None
    """Region around a line: ``{ axis = "z", radius = "5 mm" }`` is the bore of a tube with this inner radius. If a box
    is also given, only faces that are in the cylinder and in the box are loaded."""
    on: SetName | None = None
    """Name of a surface or a node set in the mesh file of the parts (docs/howto/meshes.md): loads the free faces whose
    nodes are all in this set. If a box or a cylinder is also given, only faces that are in all given regions are
    loaded."""


Boundary = Annotated[Symmetry | Wall | Prescribed | Rotation | Gravity | Traction, Field(discriminator="kind")]
