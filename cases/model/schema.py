"""The models of a case: frozen, without unknown keys, every quantity in SI units once read.

``parse_case`` in ``cases/load.py`` reads TOML or JSON and reports every error at once. Beside this module:
``bodies`` (bodies and their meshes), ``motion``, ``materials``, ``boundaries``, ``bonds``, ``failure`` and
``measures`` (probes and references).
"""

from typing import Annotated, Any, Literal, TypeVar

from pydantic import BeforeValidator, Field

from ..units import Ratio, Speed, Temperature, Time
from .bodies import Mesh
from .bonds import Bond
from .boundaries import Around, Boundary, Gravity, Prescribed, Rotation, Symmetry, Traction, Wall
from .failure import Erosion, Fracture
from .joined import bodies, breakable, meeting
from .materials import Material
from .measures import Probe, Reference
from .motion import Spin, Stretch, Turn
from .rigid import Flag, Rigid, read_rigid
from .tables import Count, Model, Name, Positive, Switch, Velocity

__all__ = [
    "MOST_RANKS", "Around", "Balance", "Bond", "Boundary", "Case", "Contact", "ContactPair", "Erosion", "Fracture",
    "Gravity", "Numerics", "Part", "Prescribed", "Probe", "Reference", "Rigid", "Rotation", "Run", "Spin", "Stretch",
    "Symmetry",
    "Traction", "Turn", "Viscosity", "Wall",
]  # fmt: skip


def _off(value: Any) -> Any:
    return None if value == "none" else value


class Part(Model):
    """A body: its material, its mesh, its motion at the start, and how it fails."""

    name: Name
    """Name of the part in messages, results and other keys of the case. No two parts have the same name."""
    material: Name
    """Name of a material: one of ``[materials]`` of the case, or one of the library (``conoid materials`` lists
    them)."""
    mesh: Mesh
    """Shape, place and element size of the body. ``shape`` selects one of the tables ``parts[].mesh`` below."""
    turn: Turn | None = None
    """Rotation of the mesh before the run starts, for bodies that are inclined to the axes. Only with ``sector =
    "full"``."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    """Initial velocity of the whole body along x, y, z."""
    spin: Spin | None = None
    """Initial rigid rotation, added to ``velocity``."""
    stretch: Stretch | None = None
    """Initial uniform stretching, added to ``velocity``."""
    jitter: Annotated[Speed, Field(ge=0)] = 0.0
    """Amplitude of a random initial velocity, added to ``velocity``: each component of each node is uniform between
    minus and plus this value. Every run has the same values. For tests of energy conservation."""
    temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    """Initial temperature. Used by ``strength`` with ``model = "johnson_cook"`` only."""
    erosion: Erosion | None = None
    """Criteria for the deletion of tets. Without this table no tet of the part is deleted. Not together with
    ``fracture``."""
    fracture: Fracture | None = None
    """Criteria for the fracture of facets between tets. Without this table the part does not fracture. Needs
    ``brittle`` in its material; not together with ``erosion``."""
    rigid: Annotated[Rigid | None, BeforeValidator(read_rigid), Flag()] = None
    """Whether the part is rigid: ``true``, or a table with its mass, centre of mass and inertia. A rigid part has
    six degrees of freedom and no stress; it costs only the contact of its surface and does not limit the time step.
    Gravity acts on it. A plane of symmetry on which it has nodes, and a boundary that drives all of its nodes, leave
    it the motions that they allow: with one velocity component prescribed it can still rotate about that axis, with
    two or three it cannot rotate. A plane of symmetry that it does not touch at the start acts on it as a wall
    without friction, with ``contact.restitution``."""


class ContactPair(Model):
    """A pair of parts with a coefficient of friction of its own."""

    parts: tuple[Name, Name]
    """Names of the two parts."""
    friction: Annotated[Ratio, Field(ge=0)]
    """Coulomb's coefficient of friction between the two parts."""


class Contact(Model):
    """Contact between bodies: nodes with faces, and sharp edges with edges. Contact acts by impulses; there is no
    penalty stiffness to choose."""

    parts: tuple[Name, ...] = ()
    """Names of the parts that can be in contact; all parts when empty."""
    self_contact: tuple[Name, ...] | None = None
    """Names of the parts whose surface can be in contact with itself. Default: the parts that have ``erosion``,
    because their free nodes would otherwise pass through the part that they come from. A list replaces this default;
    ``[]`` means none. Parts that have ``fracture`` always have self-contact."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient of friction between all bodies, except the ``pairs``."""
    pairs: tuple[ContactPair, ...] = ()
    """Pairs of parts with another coefficient of friction, in TOML one ``[[contact.pairs]]`` each."""
    restitution: Annotated[Ratio, Field(ge=0, le=1)] = 0.0
    """Coefficient of restitution of single nodes and edges: their speed of separation over their speed of approach.
    Keep 0 unless a verification needs more: elastic bodies rebound by their elasticity with any value. At 0 the
    impact of a node is perfectly plastic. In the impact of two bodies only the first nodes lose energy, and less of
    it the smaller the tets are; where erosion exposes new nodes all the time, or a cloud of debris arrives, all of
    them do, at any size: 8 to 9 % in a penetration at constant speed. At 1 the impacts of nodes lose only what the
    ``sweeps`` leave, mostly below 0.1 %. Any value above 0 changes the defaults of ``sweeps`` and
    ``numerics.dt_growth``. At high speed, time steps of unequal length can remove or add more energy than the
    restitution saves; the outcome contains a note above 1 %. Contact with walls always has 0."""
    edges: bool = True
    """Whether sharp edges are in contact with edges. ``false`` is cheaper, and edges can then pass through each
    other."""
    overlap: Literal["refuse", "push"] = "refuse"
    """Treatment of bodies that overlap at the start. ``refuse``: the run ends with an error. ``push``: the bodies
    are moved apart without stress; an error where they overlap too deeply for their tets. Two bodies overlap where
    their primitives intersect, or where a surface node of one lies inside the mesh of the other deeper than a
    millionth of a face's size; bodies that touch do not overlap. Parts that are not in contact with each other may
    overlap."""
    sweeps: Annotated[Count, Field(ge=1, le=1000)] | None = None
    """Number of Jacobi sweeps, with momentum, over the active contacts of a time step. Default: adaptive, 5 to 80.
    The number increases where the last sweep of the previous step changed the impulses by more than 0.15 %, as in
    rubble under pressure, and decreases below half of that. The adaptive number is at least 10 where parts meet at
    more than a fifth of the wave speed of one of them; at least 40 with ``restitution``, and where parts that
    fracture may be pressed by a prescribed motion or a traction. With too few sweeps broken material is too soft
    under pressure, and the number of fragments is wrong. Cost grows with the number."""
    skin: Annotated[Ratio, Positive] = 0.3
    """Skin of the broad phase over the harmonic mean of the face size: twice the distance by which a node may depart
    from its extrapolated motion before its candidate pairs are searched again. Changes the cost, not the answer."""
    domain: Literal["arbitrary", "box"] = "arbitrary"
    """Method by which a rank selects the faces that other ranks receive as ghosts: by occupied cells
    (``arbitrary``), or by bounding boxes (``box``). Changes the cost, not the answer."""


class Viscosity(Model):
    """Bulk viscosity ``q = density * u * ((linear + shock * S) * c + quadratic * u)``, ``u = l * |rate|``, in
    compression only.

    c is the wave speed. ``S = u / (u + c / 100)`` is close to 0 in elastic waves and close to 1 in shocks. ``l =
    1.2009 / sqrt(sum |grad N|^2)`` is V^(1/3) for a regular tet and follows the altitude of a flat one. The rate is
    the volumetric strain rate that the pressure uses: with ``nodal`` and ``split`` the mean over the nodes of the
    tet.
    """

    linear: Annotated[Ratio, Field(ge=0)] = 0.06
    """Coefficient of the linear term, which damps numerical ringing behind a wave front, and elastic waves too. A
    velocity jump of some m/s rings at 0.06: the tension in the spall plane of a flyer plate is then a third too
    high, at 0.3 a sixth."""
    shock: Annotated[Ratio, Field(ge=0)] = 0.4
    """Increase of the linear coefficient in shocks: the front is spread over some tets and does not overshoot."""
    quadratic: Annotated[Ratio, Field(ge=0)] = 1.5
    """Coefficient of the quadratic term, which spreads strong shocks over some tets."""


class Numerics(Model):
    """Numerical method: pressure, bulk viscosity and time step."""

    pressure: Literal["standard", "nodal", "split"] = "nodal"
    """Pressure form of the tets. ``nodal``: average nodal pressure, for plastic flow and in general. ``standard``:
    one pressure for each tet; cheaper, but it locks (is too stiff) in plastic flow. ``split``: operator split,
    stabilised by pressure-gradient projection; it damps elastic motion (a free ball of 6,400 tets that vibrates
    radially loses 15 % of its energy in ten periods, and none with the others). Tets whose smallest altitude at the
    start is below a tenth of their longest edge keep a pressure of their own with ``nodal`` and ``split``."""
    viscosity: Annotated[Viscosity | None, BeforeValidator(_off), Switch()] = Viscosity()
    """Bulk viscosity; ``"none"`` switches it off."""
    dt_safety: Annotated[Ratio, Field(gt=0, le=1)] = 0.9
    """Time step over the rigorous stability limit of the tets, ``1 / (c sqrt(sum |grad N|^2))``. Bodies that shatter
    absorb about 15 % less fracture energy at 0.9 than at 0.6 and below, and make fewer fragments; more where the
    cohesive zone is not resolved, which a warning reports."""
    dt_growth: Annotated[Ratio, Field(gt=1, le=2)] | None = None
    """Largest ratio of one time step to the one before. Default: 1.05; with ``contact.restitution`` 1.002, because
    time steps that change with the impacts add energy that nothing dissipates then."""


Scale = Annotated[Ratio, Field(gt=0)]


FrameField = Literal["density", "strain", "strain_rate", "contact_pressure"]

MOST_RANKS, MOST_THREADS, MOST_PARTS = 4096, 256, 256
"""Largest numbers of ranks, threads and parts. Chosen: far above what has been run."""


class Run(Model):
    """Duration of the run, cores, output, and limits at which it stops."""

    end_time: Annotated[Time, Positive]
    """Simulated time at which the run ends. It starts at 0."""
    ranks: Annotated[Count, Field(ge=1, le=MOST_RANKS)] = 1
    """Number of MPI processes. The answer does not depend on it."""
    threads: Annotated[Count, Field(ge=1, le=MOST_THREADS)] = 1
    """Number of threads of each MPI process. The answer does not depend on it. A run uses ``ranks`` times
    ``threads`` cores; more of them than the machine has cores make it slower."""
    profile: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{0,32}$")] = ""
    """Profile of the site under which a batch system executes the run (docs/howto/cluster.md). The profile that is
    given at submission has priority."""
    cut_scale: tuple[Scale, Scale, Scale] = (1.0, 1.0, 1.0)
    """Factors of the coordinates for the domain decomposition: cuts across a direction with a small factor are
    avoided. With a small factor along the direction of impact every rank receives a part of the impact zone. Changes
    the cost, not the answer."""
    frames: Annotated[Count, Field(ge=0, le=100_000)] = 20
    """Number of frames (complete fields, VTKHDF), evenly spaced up to the end; frame 0 is the initial state. 0: no
    frames. A time step ends at each frame, so another number changes the time steps, and with them the fracture
    pattern of bodies that shatter, as another ``dt_safety`` does."""
    fields: tuple[FrameField, ...] = ()
    """Additional fields of the frames. ``density``: current density of the tets. ``strain``: logarithmic (Hencky)
    strain ln V of each tet, six components, and ``effective_strain``, sqrt(2/3 e' : e') of its deviator; where the
    principal axes do not rotate, this is the integral of the strain rate that other explicit codes store, with
    tensor shear components. ``strain_rate``: sqrt(2/3 d' : d') of the rate of deformation d. ``contact_pressure``:
    impulse of contact and walls on a node since the previous frame, along the normal of its share of the loaded
    surface (a third of each face that is hit at less than 60 degrees), over that area and time; 0 in the first
    frame. Walls that push rigid parts are not included: use a probe of ``wall_force``."""
    samples: Annotated[Count, Field(ge=1, le=1_000_000)] = 500
    """Number of lines of history.csv, evenly spaced up to the end."""
    snapshots: Annotated[Count, Field(ge=0, le=100_000)] = 100
    """Number of snapshots of the fragments' surface for the live view, evenly spaced up to the end, and one of the
    initial state. 0: only snapshots on request. At most one per second of wall time, and fewer where they would use
    more than 1/200 of it; the first and the last are always made."""
    max_steps: Annotated[Count, Field(ge=1)] = 100_000_000
    """Largest number of time steps. A run that reaches it writes a checkpoint and stops with state ``timed_out``,
    cause ``steps``. ``conoid restart RUN --max-steps NUMBER`` continues it."""
    max_wall_time: Annotated[Time, Positive] | None = None
    """Largest wall time, counted from the first time step. A run that reaches it writes a checkpoint and stops.
    Default: no limit."""
    checkpoint_every: Annotated[Annotated[Time, Positive] | None, BeforeValidator(_off), Switch()] = 600.0
    """Wall time between checkpoints. A checkpoint is also written on request, when a user stops the run, and at
    ``max_wall_time``; with ``"none"`` only then."""
    residual_limit: Annotated[Ratio, Positive] = 0.05
    """Largest energy residual over the largest energy so far; beyond it the run fails with cause ``energy``. The
    same limit holds for kinetic energy that exceeds all energy that has entered."""
    made_limit: Annotated[Ratio, Positive] = 0.02
    """Largest energy that a single line of the energy ledger may create, over the largest energy so far; beyond it
    the run fails with cause ``energy``. It is exceeded where a dissipation decreases (``plastic``, ``viscous``,
    ``friction``, ``fracture``), where a store releases more than it has absorbed (``contact``, ``averaging``,
    ``eroded``, ``cohesive``), or where time steps of unequal length create or remove energy (``stepping``). 2 % of
    an energy are 1 % of a speed."""

    @property
    def cores(self) -> int:
        """The number of cores of the run."""
        return self.ranks * self.threads


class Balance(Model):
    """Load balance: when tets are redistributed over the ranks, and by which weight. No answer depends on it."""

    policy: Literal["measured", "outside", "every", "never"] = "measured"
    """Criterion for a new decomposition of the mesh. ``measured``: the time lost by imbalance since the last
    decomposition exceeds the cost of a new one. ``outside``: when the outside nodes of a rank have grown by the
    factor ``alpha`` (criterion of Moon, Kim and Lee). ``every``: after a fixed number of time steps. ``never``: not
    at all."""
    alpha: Annotated[Ratio, Field(gt=1)] = 1.2
    """With ``policy = "outside"``: growth factor of the outside nodes of a rank that triggers a decomposition."""
    every: Annotated[Count, Field(ge=1)] = 1000
    """With ``policy = "every"``: time steps between two decompositions."""
    weights: Literal["measured", "outside", "tets"] = "measured"
    """Quantity that is divided evenly among the ranks: measured CPU time, outside nodes, or tets."""


Kind = TypeVar("Kind", Symmetry, Wall, Prescribed, Rotation, Gravity, Traction)


class Case(Model):
    """The top level of the file."""

    name: Name
    """Name of the case and of its runs."""
    title: Annotated[str, Field(max_length=200)] = ""
    """Title: one line about the case."""
    description: Annotated[str, Field(max_length=20_000)] = ""
    """Description of the case, as long as needed."""
    materials: dict[Name, Material] = Field(default_factory=dict)
    """Materials of this case, each a table ``[materials.NAME]``. A name that the library also has replaces the
    material of the library."""
    parts: Annotated[tuple[Part, ...], Field(min_length=1, max_length=MOST_PARTS)]
    """The bodies, in TOML one ``[[parts]]`` each."""
    boundaries: tuple[Boundary, ...] = ()
    """Planes of symmetry, walls, prescribed motions, gravity and loads, in TOML one ``[[boundaries]]`` each;
    ``kind`` selects which."""
    bond: tuple[Bond, ...] = ()
    """Bonds between parts, in TOML one ``[[bond]]`` each; ``kind`` selects how the meshes are joined. Parts without
    a bond are separate bodies, also where their surfaces coincide."""
    contact: Annotated[Contact | None, BeforeValidator(_off), Switch()] = Contact()
    """Contact between bodies, on by default. ``"none"`` switches it off: bodies then pass through each other."""
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
        """The boundaries of one kind, each with its index in ``boundaries``."""
        return [(index, spec) for index, spec in enumerate(self.boundaries) if isinstance(spec, kind)]

    @property
    def erodes(self) -> bool:
        """Whether a part has ``erosion``."""
        return any(part.erosion is not None for part in self.parts)

    @property
    def fractures(self) -> bool:
        """Whether facets of a part or of a bond can break."""
        return any(breakable(self))

    @property
    def rigid(self) -> list[int]:
        """Indices of the rigid parts."""
        return [index for index, part in enumerate(self.parts) if part.rigid is not None]

    @property
    def dt_growth(self) -> float:
        """Largest ratio of one time step to the one before."""
        rebounds = self.contact is not None and self.contact.restitution > 0.0
        return self.numerics.dt_growth or (1.002 if rebounds else 1.05)

    @property
    def in_contact(self) -> bool:
        """Whether contact is possible in the scene."""
        return self.contact is not None and (len(set(bodies(self))) > 1 or any(meeting(self)))

    @property
    def self_contact(self) -> tuple[str, ...]:
        """Names of the parts with self-contact, in the order of the parts."""
        if self.contact is None:
            return ()
        named, meet = self.contact.self_contact, self.contact.parts
        wears = (part.name for part in self.parts if part.erosion is not None)
        may = {*(wears if named is None else named), *(part.name for part in self.parts if part.fracture is not None)}
        return tuple(part.name for part in self.parts if part.name in may and (not meet or part.name in meet))
