"""What holds or drives nodes: symmetry planes, walls, prescribed motion, gravity, tractions."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Acceleration, Length, Mass, Ratio, Speed, Stress, Time
from .motion import Spin
from .tables import Axis, Direction, Model, Name, Point, SetName, Velocity

Course = tuple[tuple[Time, Ratio], ...]
"""Times and factors, in this order."""


class Symmetry(Model):
    """Nodes that start on the plane ``axis = at`` stay on it. What flies at it meets its mirror image there: no node
    passes the plane, and none sticks to it. Nodes without tets do not meet each other: they are reflected, and nothing
    holds them on the plane. No friction. All parts when ``parts`` is empty. No crack opens in the plane
    itself, as the one below a blow in the middle of a plate would: half of a body that fractures is not the whole.
    """

    kind: Literal["symmetry"]
    """The kind of boundary."""
    axis: Axis
    """The normal of the plane."""
    at: Length = 0.0
    """Where the plane cuts the axis."""
    parts: tuple[Name, ...] = ()
    """Parts that it holds; all when empty."""


class Wall(Model):
    """A rigid surface that nodes cannot pass: a plane, a cylinder or a sphere; fixed, driven along a ``course``, or
    free with a ``mass``. It does not turn, and what it stops does not limit the time step.
    """

    kind: Literal["wall"]
    """The kind of boundary."""
    name: Name = "wall"
    """For messages; each wall has its own."""
    shape: Literal["plane", "cylinder", "sphere"] = "plane"
    """Of its surface; a cylinder has no ends."""
    point: Point
    """At the start: any point of a plane, any point of the axis of a cylinder, the centre of a sphere."""
    normal: Direction | None = None
    """Of a plane: points out of the wall, to the side where bodies are; its length does not count."""
    axis: Direction | None = None
    """Of a cylinder: the direction of its axis; its length does not count."""
    radius: Annotated[Length, Field(gt=0)] | None = None
    """Of a cylinder or a sphere."""
    side: Literal["outside", "inside"] = "outside"
    """Of a cylinder or a sphere: where bodies are, round it or in it."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    """How it moves: all the time where it has no ``mass``, and then what it does is work from outside; at the start
    where it has one."""
    course: Course = ()
    """Pairs of a time and a factor of the velocity, as of a prescribed velocity; not with ``mass``."""
    mass: Annotated[Mass, Field(gt=0)] | None = None
    """With it the wall is free: it moves by the impulses that it gets, and only by these."""
    parts: tuple[Name, ...] = ()
    """Parts that it stops; all when empty."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient."""

    @property
    def plain(self) -> bool:
        """Whether it is a plane that never moves."""
        return self.shape == "plane" and self.mass is None and not any(self.velocity)


class Prescribed(Model):
    """Nodes that start inside the box ``low``..``high`` (all of the parts when absent) move with a given velocity.
    Nodes no further outside of it than a hundredth of the shortest edge of their part are in.

    Only the components that are given are prescribed. Two boundaries may not prescribe one component of a node in two
    ways. Walls do not hold nodes of which a component is prescribed.
    """

    kind: Literal["velocity"]
    """The kind of boundary."""
    parts: tuple[Name, ...] = ()
    """Parts that it moves; all when empty."""
    low: Point | None = None
    """Lowest corner of the box; with ``high``."""
    high: Point | None = None
    """Highest corner of the box; with ``low``."""
    x: Speed | None = None
    """Velocity along x; without it the nodes are free along x."""
    y: Speed | None = None
    """Velocity along y; without it the nodes are free along y."""
    z: Speed | None = None
    """Velocity along z; without it the nodes are free along z."""
    on: SetName | None = None
    """A set of nodes or a surface of the mesh file of its parts, by name (docs/howto/meshes.md): its nodes move so.
    With a box those that are in both."""
    course: Course = ()
    """Pairs of a time and a factor of the velocity: linear in between, constant before the first and after the last.
    Without them the velocity is constant. ``[["0 us", 0], ["2 us", 1]]`` is a ramp."""


class Rotation(Model):
    """All nodes of the parts turn rigidly, exactly, at the given spin; walls do not hold them."""

    kind: Literal["rotation"]
    """The kind of boundary."""
    parts: tuple[Name, ...] = ()
    """Parts that turn; all when empty."""
    spin: Spin
    """The line that they turn about, and how fast."""
    on: SetName | None = None
    """A set of nodes or a surface of the mesh file of its parts, by name (docs/howto/meshes.md): its nodes alone
    turn."""


class Gravity(Model):
    """An acceleration of all nodes of the parts, of all parts when ``parts`` is empty."""

    kind: Literal["gravity"]
    """The kind of boundary."""
    acceleration: tuple[Acceleration, Acceleration, Acceleration]
    """Along x, y, z; not zero."""
    course: Course = ()
    """Pairs of a time and a factor of the acceleration: linear in between, constant before the first and after the
    last. Without them it is constant from the first moment on, and what stood free begins to bounce."""
    parts: tuple[Name, ...] = ()
    """Parts that it acts on; all when empty. Of a body that bonds of the kind ``shared`` make, all parts or none."""


class Around(Model):
    """What lies between two radii round a line, however far along it. With the ``radius`` of its hole it is the bore of
    a tube, with its outer one as ``inner_radius`` the outside.
    """

    base: Point = (0.0, 0.0, 0.0)
    """Any point of the line."""
    axis: Axis = "z"
    """Direction of the line."""
    inner_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Smallest distance from the line."""
    radius: Annotated[Length, Field(gt=0)]
    """Largest distance from the line; not below ``inner_radius``. Nodes that are no further outside of either than a
    hundredth of the shortest edge of their part are in."""


class Traction(Model):
    """A force per area, Pa, on the exposed faces whose three nodes start inside the box ``low``..``high`` and the
    ``cylinder`` (all of the parts when both are absent). By default it is per initial area and turns with nothing; a
    pressure that ``follows`` acts on the surface as it is. A face has its load until erosion takes its tet, or, of a
    pressure that ``follows``, until its tet has come off alone, all four faces of it being surface; faces that come to
    the surface later have none. Nodes no further outside than a hundredth of the shortest edge of their part are in.
    Either ``stress`` or ``pressure`` is given. ``conoid validate`` says about how large the faces are together; a run
    whose faces are not warns.
    """

    kind: Literal["traction"]
    """The kind of boundary."""
    stress: tuple[Stress, Stress, Stress] | None = None
    """Force per area along x, y, z; not zero."""
    pressure: Stress | None = None
    """Force per area against the outward normal of each face; not zero. Of the initial area and normal, but for a
    pressure that ``follows``."""
    follows: bool = False
    """Whether ``pressure`` follows the surface: it acts on the present area of each face, against its present normal,
    as that of a gas or a liquid does. Its work is that of the forces along the way of the nodes. On a closed surface it
    is no force and no moment in sum, but for rounding."""
    course: Course = ()
    """Pairs of a time and a factor of the force: linear in between, constant before the first and after the last.
    Without them the force is constant from the first moment on."""
    parts: tuple[Name, ...] = ()
    """Parts that it acts on; all when empty."""
    low: Point | None = None
    """Lowest corner of the box; with ``high``."""
    high: Point | None = None
    """Highest corner of the box; with ``low``."""
    cylinder: Around | None = None
    """``{ axis = "z", radius = "5 mm" }`` is the bore of a tube with this inner radius; with a box, what is in both."""
    on: SetName | None = None
    """A surface of the mesh file of its parts, by name (docs/howto/meshes.md), or a set of nodes: the exposed faces all
    of whose nodes are in it. With a box or a cylinder what is in both."""


Boundary = Annotated[Symmetry | Wall | Prescribed | Rotation | Gravity | Traction, Field(discriminator="kind")]
