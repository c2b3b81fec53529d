"""What a case is. Frozen models, unknown keys forbidden, every quantity in SI once read.

``parse_case`` in ``cases/load.py`` is the way in: it reads TOML or JSON and reports every error at once. Beside
it: ``bodies`` (bodies and their meshes), ``motion``, ``materials``, ``boundaries``, ``bonds``, ``failure`` and
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
    """A body: where it is, what it is made of, how it moves at the start."""

    name: Name
    """For messages, results and the keys that name parts; each part has its own."""
    material: Name
    """A name from ``[materials]`` of the case or from the library."""
    mesh: Mesh
    """The body, where it lies and how fine it is; ``shape`` says which kind."""
    turn: Turn | None = None
    """How the body is turned out of the axes.
    Only whole bodies can be turned, no sectors."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    """Of the whole body at the start, along x, y, z."""
    spin: Spin | None = None
    """A rotation at the start, besides ``velocity``."""
    stretch: Stretch | None = None
    """A stretching at the start, besides ``velocity``."""
    jitter: Annotated[Speed, Field(ge=0)] = 0.0
    """Each node starts with a random velocity besides, each component between minus and plus this: the same in every
    run."""
    temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    """At the start; of meaning for Johnson-Cook's law."""
    erosion: Erosion | None = None
    """With this table the part's own tets leave where they are worn out; without it none of its tets ever does."""
    fracture: Fracture | None = None
    """With this table the part breaks; its material must be ``brittle``."""
    rigid: Annotated[Rigid | None, BeforeValidator(read_rigid), Flag()] = None
    """``true``, or a table of mass, centre and inertia: the part has six degrees of freedom and no stress. It costs
    what its surface costs in contact, and does not limit the time step. Gravity acts on it; planes of symmetry on
    which it has nodes, and boundaries that drive all of its nodes, leave it the motions that they allow: with one
    component given it may turn about that axis, with more it does not turn. A plane of symmetry beside which it starts
    is a wall without friction for it, with the ``restitution`` of contact."""


class ContactPair(Model):
    """Two parts whose friction differs from that of the others."""

    parts: tuple[Name, Name]
    """The names of the two."""
    friction: Annotated[Ratio, Field(ge=0)]
    """Coulomb's coefficient between them."""


class Contact(Model):
    """Bodies push each other where they meet: nodes on faces, sharp edges on edges; by impulses, no stiffness."""

    parts: tuple[Name, ...] = ()
    """Parts that meet each other; all when empty."""
    self_contact: tuple[Name, ...] | None = None
    """Parts whose surface can meet itself; by default those that erode, whose nodes without tets would else pass
    through the part that they come from. A list takes the place of this default: ``[]`` for none. Those that fracture
    always can."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient."""
    pairs: tuple[ContactPair, ...] = ()
    """Pairs of parts with a friction of their own."""
    restitution: Annotated[Ratio, Field(ge=0, le=1)] = 0.0
    """Share of the speed of approach with which nodes part from faces, and edges from edges, that they run into: at 0
    an impact of nodes is perfectly plastic; at 1 it takes no energy but what ``sweeps`` leave undone, mostly below 0.1
    %. In the impact of two bodies it is their first nodes that pay, and what they pay falls with the size of the tets;
    where erosion lays bare ever new nodes, or a cloud of debris arrives, all of them do, whatever their size: 8 to 9 %
    in a penetration at constant speed. Bodies rebound by their elasticity whatever it is. Above 0 ``sweeps`` and
    ``numerics.dt_growth`` have other defaults, and what parts falls back: next to 0 is not 0. At a high speed unequal
    time steps may take or make more than it gives back: the outcome says when it is above 1 %. Walls are not concerned:
    there it is always 0."""
    edges: bool = True
    """Whether sharp edges meet edges."""
    overlap: Literal["refuse", "push"] = "refuse"
    """What becomes of bodies that overlap at the start: ``refuse`` ends with an error, ``push`` moves them apart
    without a stress, and ends with an error where they overlap too deeply for their tets. A body overlaps another where
    their primitives reach into each other, or where a node of its surface lies inside the mesh of the other, deeper
    than a millionth of the size of a face: bodies that touch do not.
    Parts that do not meet each other may overlap."""
    sweeps: Annotated[Count, Field(ge=1, le=1000)] | None = None
    """Jacobi sweeps over the active contacts of a step, with momentum. By default as many as are needed, from 5 to 80:
    more where the last one of the step before has changed the impulses by more than 0.15 %, as it does in rubble under
    pressure, fewer where it was less than half of that. At least 10 where parts meet at more than a fifth of the speed
    of waves in one of them; at least 40 with ``restitution``, where what they leave undone is energy, and where parts
    fracture and a motion or a traction drives something that may press them. With too few what has broken is too soft
    under pressure, and shatters into more pieces than it should, or fewer."""
    skin: Annotated[Ratio, Positive] = 0.3
    """Of the (harmonic) mean face size: twice how far a node may depart from its extrapolated motion before its
    candidate pairs are searched again. Changes the cost, not the answer."""
    domain: Literal["arbitrary", "box"] = "arbitrary"
    """How a rank selects the faces that others receive as ghosts: by occupied cells, or by bounding boxes. Changes the
    cost, not the answer."""


class Viscosity(Model):
    """Bulk viscosity q = density * u * ((linear + shock * S) * c + quadratic * u), u = l * |rate|, in compression.

    S = u / (u + c / 100) is next to nothing in elastic waves and next to one in shocks.
    l is V^(1/3) for a regular tet and follows the altitude of a flat one: 1.2009 / sqrt(sum |grad N|^2). The rate is
    that which the pressure sees: with ``nodal`` and ``split`` the mean of its nodes.
    """

    linear: Annotated[Ratio, Field(ge=0)] = 0.06
    """Coefficient of the linear term: damps ringing, that of elastic waves too. A jump of some m/s rings at 0.06: in
    the spall plane of a flyer the tension is a third too high, at 0.3 a sixth."""
    shock: Annotated[Ratio, Field(ge=0)] = 0.4
    """By how much the linear coefficient is larger in shocks: spreads them over some tets, so that they do not
    overshoot."""
    quadratic: Annotated[Ratio, Field(ge=0)] = 1.5
    """Coefficient of the quadratic term: spreads strong shocks."""


class Numerics(Model):
    """How the equations are solved."""

    pressure: Literal["standard", "nodal", "split"] = "nodal"
    """``standard``: pressure from each tet (locks in plastic flow). ``nodal``: averaged nodal pressure. ``split``: the
    operator split, stabilised by pressure-gradient projection, which damps elastic motion: a free ball of 6,400 tets
    that breathes loses 15 % of its energy in ten periods, and none with the others. Tets whose smallest altitude is
    below a tenth of their longest edge at the start keep a pressure of their own in both."""
    viscosity: Annotated[Viscosity | None, BeforeValidator(_off), Switch()] = Viscosity()
    """``viscosity = "none"`` switches it off."""
    dt_safety: Annotated[Ratio, Field(gt=0, le=1)] = 0.9
    """Share of the rigorous element bound 1 / (c sqrt(sum |grad N|^2)). Bodies that shatter end with some 15 % less
    energy of fracture at 0.9, and with fewer fragments, than at 0.6 and below; where cohesive zones are not resolved,
    which a warning says, it may as well be more."""
    dt_growth: Annotated[Ratio, Field(gt=1, le=2)] | None = None
    """Largest growth of the time step in one step: 1.05 by default, and 1.002 with ``contact.restitution``, since steps
    that rise and fall with the impacts give energy that nothing takes then."""


Scale = Annotated[Ratio, Field(gt=0)]


FrameField = Literal["density", "strain", "strain_rate", "contact_pressure"]

MOST_RANKS, MOST_THREADS, MOST_PARTS = 4096, 256, 256
"""Of a run, of a case. Chosen: far beyond what has been run."""


class Run(Model):
    """How long, on how many ranks, and what is written."""

    end_time: Annotated[Time, Positive]
    """Simulated time at which the run ends; it begins at 0."""
    ranks: Annotated[Count, Field(ge=1, le=MOST_RANKS)] = 1
    """MPI processes that share the work. The answer does not depend on it."""
    threads: Annotated[Count, Field(ge=1, le=MOST_THREADS)] = 1
    """Threads of each MPI process that share its work. The answer does not depend on it. A run takes ``ranks`` times
    ``threads`` cores; more threads than cores make it slower."""
    profile: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{0,32}$")] = ""
    """Where a batch system runs it: a profile of the site (docs/howto/cluster.md). The submitter's choice comes before
    it."""
    cut_scale: tuple[Scale, Scale, Scale] = (1.0, 1.0, 1.0)
    """Positions are multiplied by this before the mesh is cut for the ranks: no cut is made across a direction that is
    short then. Small along the way of an impact, every rank gets a share of where it happens. The answer does not
    depend on it."""
    frames: Annotated[Count, Field(ge=0, le=100_000)] = 20
    """Number of frames, evenly spaced to the end; the initial state is frame 0 (0: none are written). A step ends at
    each, so another number makes other steps: what shatters then breaks otherwise, as by another ``dt_safety``."""
    fields: tuple[FrameField, ...] = ()
    """Fields of frames besides those that every frame has. ``density``: of the tets as they are. ``strain``: the
    logarithmic strain ln V (Hencky) between the start and the present shape of each tet, six components, and
    ``effective_strain``, sqrt(2/3 e' : e') of its deviator; where the axes of the strain do not turn, that is the
    integral of the rate that other explicit codes store, with shear components of tensors. ``strain_rate``:
    sqrt(2/3 d' : d') of the rate of deformation d, of the velocities in the frame. ``contact_pressure`` of nodes: what
    contact and walls have given a node since the frame before, along the normal of its share of the surface that is
    pushed (a third of each face that is met at less than 60 degrees), over that area and time; 0 in the first frame.
    What walls give to rigid parts is not in it: a probe of the force of a wall on a part has it."""
    samples: Annotated[Count, Field(ge=1, le=1_000_000)] = 500
    """Number of lines of history.csv, evenly spaced."""
    snapshots: Annotated[Count, Field(ge=0, le=100_000)] = 100
    """Number of snapshots of the surface of the fragments, for looking on: evenly spaced to the end, and one of the
    initial state (0: none but those asked for). At most one a second of wall time, and fewer where they would take more
    than 1/200 of it; the first and the last are always made."""
    max_steps: Annotated[Count, Field(ge=1)] = 100_000_000
    """The run stops, with a checkpoint, when it needs more: state ``timed_out``, cause ``steps``. A restart with a
    larger number goes on (``conoid restart RUN --max-steps NUMBER``)."""
    max_wall_time: Annotated[Time, Positive] | None = None
    """The run stops, with a checkpoint, when it has taken longer.
    Counted from the first step."""
    checkpoint_every: Annotated[Annotated[Time, Positive] | None, BeforeValidator(_off), Switch()] = 600.0
    """Wall time between checkpoints; one is also written when somebody asks for it, and when a run is stopped on
    request or by ``max_wall_time``. ``"none"``: only then."""
    residual_limit: Annotated[Ratio, Positive] = 0.05
    """The run fails with cause ``energy`` when the energy residual, or what moves beyond all energy that has come in,
    passes this share of the largest energy so far."""
    made_limit: Annotated[Ratio, Positive] = 0.02
    """The run fails with cause ``energy`` when a line of the ledger has made more than this share of the largest energy
    so far: one that takes for good has fallen (``plastic``, ``viscous``, ``friction``, ``fracture``), one that gives
    back what it has taken is below zero (``contact``, ``averaging``, ``eroded``, ``cohesive``), or unequal time steps
    have made or taken it (``stepping``). Two hundredths of an energy are one of a speed."""

    @property
    def cores(self) -> int:
        """That it takes."""
        return self.ranks * self.threads


class Balance(Model):
    """When tets move to other ranks so that all have the same to do, and what counts. No answer depends on it."""

    policy: Literal["measured", "outside", "every", "never"] = "measured"
    """``measured``: when the time lost to imbalance since the last cut exceeds what a cut costs. ``outside``: when a
    rank has more than ``alpha`` times the outside nodes that it had at the last cut (Moon, Kim and Lee's trigger).
    ``every``: each so many steps."""
    alpha: Annotated[Ratio, Field(gt=1)] = 1.2
    """Of ``policy = "outside"``: growth that a rank may have before it is cut anew."""
    every: Annotated[Count, Field(ge=1)] = 1000
    """Of ``policy = "every"``: steps between two cuts."""
    weights: Literal["measured", "outside", "tets"] = "measured"
    """What is divided evenly: CPU time as measured, outside nodes, or tets."""


Kind = TypeVar("Kind", Symmetry, Wall, Prescribed, Rotation, Gravity, Traction)


class Case(Model):
    """A whole case."""

    name: Name
    """Of the case and of its runs."""
    title: Annotated[str, Field(max_length=200)] = ""
    """One line for people."""
    description: Annotated[str, Field(max_length=20_000)] = ""
    """What the case shows, for people."""
    materials: dict[Name, Material] = Field(default_factory=dict)
    """Materials of the case's own, each under its name; they win over those of the library."""
    parts: Annotated[tuple[Part, ...], Field(min_length=1, max_length=MOST_PARTS)]
    """The bodies, in TOML one ``[[parts]]`` each."""
    boundaries: tuple[Boundary, ...] = ()
    """What holds or drives nodes, in TOML one ``[[boundaries]]`` each; ``kind`` says which."""
    bond: tuple[Bond, ...] = ()
    """Parts that hold together, in TOML one ``[[bond]]`` each; ``kind`` says how their meshes are joined. Parts without
    a bond are bodies of their own, also where their surfaces coincide."""
    contact: Annotated[Contact | None, BeforeValidator(_off), Switch()] = Contact()
    """How bodies meet; they do by default. ``contact = "none"`` lets them pass through each other. A single part meets
    only itself, if it may."""
    probes: tuple[Probe, ...] = ()
    """Columns of history.csv, in TOML one ``[[probes]]`` each."""
    numerics: Numerics = Numerics()
    """Pressure form, viscosity, time step."""
    run: Run
    """The end, the ranks, what is written, when to stop."""
    balance: Balance = Balance()
    """When tets move to other ranks."""
    reference: tuple[Reference, ...] = ()
    """Numbers that the run is compared with, in TOML one ``[[reference]]`` each."""

    def boundaries_of(self, kind: type[Kind]) -> list[tuple[int, Kind]]:
        """The boundaries of one kind, each with its place in ``boundaries``."""
        return [(index, spec) for index, spec in enumerate(self.boundaries) if isinstance(spec, kind)]

    @property
    def erodes(self) -> bool:
        """Whether tets may leave."""
        return any(part.erosion is not None for part in self.parts)

    @property
    def fractures(self) -> bool:
        """Whether facets may break."""
        return any(breakable(self))

    @property
    def rigid(self) -> list[int]:
        """The numbers of the rigid parts."""
        return [index for index, part in enumerate(self.parts) if part.rigid is not None]

    @property
    def dt_growth(self) -> float:
        """Largest growth of the time step in one step."""
        rebounds = self.contact is not None and self.contact.restitution > 0.0
        return self.numerics.dt_growth or (1.002 if rebounds else 1.05)

    @property
    def in_contact(self) -> bool:
        """Whether anything of the scene can meet anything."""
        return self.contact is not None and (len(set(bodies(self))) > 1 or any(meeting(self)))

    @property
    def self_contact(self) -> tuple[str, ...]:
        """The names of the parts whose surface can meet itself, in the order of the parts."""
        if self.contact is None:
            return ()
        named, meet = self.contact.self_contact, self.contact.parts
        wears = (part.name for part in self.parts if part.erosion is not None)
        may = {*(wears if named is None else named), *(part.name for part in self.parts if part.fracture is not None)}
        return tuple(part.name for part in self.parts if part.name in may and (not meet or part.name in meet))
