"""The models of a case: immutable objects without unknown keys; after reading, every quantity is in SI units.

The function ``parse_case`` in ``cases/load.py`` reads TOML or JSON and reports every error at once. Further models are
in the modules ``bodies`` (bodies and their meshes), ``motion``, ``materials``, ``boundaries``, ``bonds``, ``failure``
and ``measures`` (probes and references).
"""

from typing import Annotated, TypeVar

from pydantic import BeforeValidator, Field

from ..units import Speed, Temperature
from .bodies import Mesh
from .bonds import Bond
from .boundaries import Around, Boundary, Gravity, Prescribed, Rotation, Symmetry, Traction, Wall
from .contact import Contact, ContactPair
from .failure import Erosion, Fracture
from .joined import bodies, breakable, meeting
from .materials import Material
from .measures import Probe, Reference
from .motion import Spin, Stretch, Turn
from .numerics import Numerics, Viscosity
from .rigid import Flag, Rigid, read_rigid
from .run import MOST_RANKS, Balance, Run
from .tables import Model, Name, Switch, Velocity, off

__all__ = [
    "MOST_RANKS", "Around", "Balance", "Bond", "Boundary", "Case", "Contact", "ContactPair", "Erosion", "Fracture",
    "Gravity", "Numerics", "Part", "Prescribed", "Probe", "Reference", "Rigid", "Rotation", "Run", "Spin", "Stretch",
    "Symmetry",
    "Traction", "Turn", "Viscosity", "Wall",
]  # fmt: skip


class Part(Model):
    """A body: its material, its mesh, its motion at the start, and its criteria of failure."""

    name: Name
    """Name of the part in messages, results and other keys of the case. No two parts have the same name."""
    material: Name
    """Name of a material: one of ``[materials]`` of the case, or one of the library (``conoid materials`` lists
    them)."""
    mesh: Mesh
    """Shape, place and element size of the body. The key ``shape`` selects one of the tables ``parts[].mesh``."""
    turn: Turn | None = None
    """Rotation of the mesh before the run starts, for bodies that are inclined to the axes. A rotation requires
    ``sector = "full"``."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    """Initial velocity of the whole body along x, y, z."""
    spin: Spin | None = None
    """Initial rigid rotation of the body, added to ``velocity``."""
    stretch: Stretch | None = None
    """Initial uniform stretching of the body, added to ``velocity``."""
    jitter: Annotated[Speed, Field(ge=0)] = 0.0
    """Amplitude of a random initial velocity, added to ``velocity``: each component of each node is uniform between
    minus and plus this value. Every run of the case has the same random velocities. The key ``jitter`` is meant for
    tests of energy conservation."""
    temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    """Initial temperature of the body. The temperature is used only by ``strength`` with ``model = "johnson_cook"``."""
    erosion: Erosion | None = None
    """Criteria for the deletion of tets. Without the table ``erosion`` no tet of the part is deleted."""
    fracture: Fracture | None = None
    """Criteria for the fracture of facets between tets. Without the table ``fracture`` the part does not fracture. The
    table ``fracture`` needs ``brittle`` in the material of the part."""
    rigid: Annotated[Rigid | None, BeforeValidator(read_rigid), Flag()] = None
    """Whether the part is rigid: ``true``, or a table with mass, centre of mass and inertia. A rigid part has six
    degrees of freedom and no stress; it costs only the contact of its surface and does not limit the time step. Gravity
    acts on a rigid part. A plane of symmetry that contains nodes of a rigid part restricts the motion of the part, as
    does a boundary that drives all of its nodes. A rigid part with one prescribed velocity component can still rotate
    about the axis of this component; with two or three prescribed components it cannot rotate. A plane of symmetry that
    a rigid part does not touch at the start acts on the part as a wall without friction, with ``contact.restitution``.
    """


MOST_PARTS = 256
"""Largest number of parts of a case: far above the number of parts in any run so far (chosen value)."""


Kind = TypeVar("Kind", Symmetry, Wall, Prescribed, Rotation, Gravity, Traction)


class Case(Model):
    """The top level of a case file."""

    name: Name
    """Name of the case and of its runs."""
    title: Annotated[str, Field(max_length=200)] = ""
    """Title: one line about the case."""
    description: Annotated[str, Field(max_length=20_000)] = ""
    """Description of the case, of any length."""
    materials: dict[Name, Material] = Field(default_factory=dict)
    """Materials of this case, each a table ``[materials.NAME]``. A material of the case replaces the material of the
    library with the same name."""
    parts: Annotated[tuple[Part, ...], Field(min_length=1, max_length=MOST_PARTS)]
    """The bodies, in TOML one ``[[parts]]`` each."""
    boundaries: tuple[Boundary, ...] = ()
    """Planes of symmetry, walls, prescribed motions, gravity and loads, in TOML one ``[[boundaries]]`` each; the key
    ``kind`` selects which."""
    bond: tuple[Bond, ...] = ()
    """Bonds between parts, in TOML one ``[[bond]]`` each; the key ``kind`` selects how the meshes are joined. Parts
    without a bond are separate bodies, even if their surfaces coincide."""
    contact: Annotated[Contact | None, BeforeValidator(off), Switch()] = Contact()
    """Contact between bodies, switched on by default. The value ``"none"`` switches contact off: bodies then pass
    through each other."""
    probes: tuple[Probe, ...] = ()
    """Probes, in TOML one ``[[probes]]`` each: additional columns of history.csv."""
    numerics: Numerics = Numerics()
    """Numerical method: pressure, bulk viscosity, time step."""
    run: Run
    """End time, cores, output and limits of the run."""
    balance: Balance = Balance()
    """Load balance between the ranks."""
    reference: tuple[Reference, ...] = ()
    """Values with which the finished run is compared, in TOML one ``[[reference]]`` each."""

    def boundaries_of(self, kind: type[Kind]) -> list[tuple[int, Kind]]:
        """Returns the boundaries of one kind, each with its index in ``boundaries``."""
        return [(index, spec) for index, spec in enumerate(self.boundaries) if isinstance(spec, kind)]

    @property
    def erodes(self) -> bool:
        """Whether a part of the case has ``erosion``."""
        return any(part.erosion is not None for part in self.parts)

    @property
    def fractures(self) -> bool:
        """Whether facets of a part or of a bond can break."""
        return any(breakable(self))

    @property
    def rigid(self) -> list[int]:
        """Returns the indices of the rigid parts."""
        return [index for index, part in enumerate(self.parts) if part.rigid is not None]

    @property
    def dt_growth(self) -> float:
        """Returns the largest ratio of a time step to the previous time step."""
        rebounds = self.contact is not None and self.contact.restitution > 0.0
        return self.numerics.dt_growth or (1.002 if rebounds else 1.05)

    @property
    def in_contact(self) -> bool:
        """Whether contact is possible in the scene."""
        return self.contact is not None and (len(set(bodies(self))) > 1 or any(meeting(self)))

    @property
    def self_contact(self) -> tuple[str, ...]:
        """Returns the names of the parts with self-contact, in the order of the parts."""
        if self.contact is None:
            return ()
        named, meet = self.contact.self_contact, self.contact.parts
        wears = (part.name for part in self.parts if part.erosion is not None)
        may = {*(wears if named is None else named), *(part.name for part in self.parts if part.fracture is not None)}
        return tuple(part.name for part in self.parts if part.name in may and (not meet or part.name in meet))
