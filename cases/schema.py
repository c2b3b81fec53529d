"""What a case is. Frozen models, unknown keys forbidden, every quantity in SI once read.

``parse_case`` in ``cases/load.py`` is the way in: it reads TOML or JSON and reports every error at once. Bodies and
their meshes are in ``cases/bodies.py``.
"""

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from .bodies import Mesh
from .tables import Axis, Count, Direction, Model, Name, Point, Positive, Velocity
from .units import (
    Acceleration,
    AngularSpeed,
    Density,
    Length,
    Rate,
    Ratio,
    SpecificHeat,
    Speed,
    Stress,
    Temperature,
    Time,
)


def _off(value: Any) -> Any:
    return None if value == "none" else value


def _acute(angle: float) -> float:
    if not 0.0 <= angle < 0.5 * math.pi:
        raise ValueError("must be at least 0 and below 90 deg; without a unit it is in rad, write it like '55 deg'")
    return angle


# Materials ------------------------------------------------------------------------------------------------------------


class Elastic(Model):
    """Isotropic elasticity: Young's modulus, Pa, and Poisson's ratio."""

    young: Annotated[Stress, Positive]
    poisson: Annotated[Ratio, Field(gt=-1, lt=0.5)]


class LinearHardening(Model):
    """J2 plasticity: yield stress ``yield + hardening * plastic strain``, Pa."""

    model: Literal["linear_hardening"]
    yield_stress: Annotated[Stress, Positive]
    hardening: Annotated[Stress, Field(ge=0)] = 0.0


class JohnsonCook(Model):
    """Flow stress (A + B e^n)(1 + C ln max(rate/reference_rate, 1))(1 - T*^m), adiabatic heating.

    T* = (T - reference_temperature) / (melt_temperature - reference_temperature), clamped to [0, 1].
    """

    model: Literal["johnson_cook"]
    A: Annotated[Stress, Positive]
    B: Annotated[Stress, Field(ge=0)]
    n: Annotated[Ratio, Field(gt=0, le=1)]
    C: Annotated[Ratio, Field(ge=0)]
    m: Annotated[Ratio, Positive]
    reference_rate: Annotated[Rate, Positive] = 1.0
    reference_temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    melt_temperature: Annotated[Temperature, Positive]
    specific_heat: Annotated[SpecificHeat, Positive]
    taylor_quinney: Annotated[Ratio, Field(ge=0, le=1)] = 0.9
    """Share of the plastic work that becomes heat."""


class MohrCoulomb(Model):
    """Brittle strength (s1 - s3) + (s1 + s3) sin(friction_angle) <= 2 cohesion cos(friction_angle), s1 >= s2 >= s3.

    Tension is positive. Flow keeps the volume: there is no dilation. Tension beyond the apex takes the deviatoric
    stress and leaves the pressure as it is.
    """

    model: Literal["mohr_coulomb"]
    cohesion: Annotated[Stress, Positive]
    friction_angle: Annotated[Ratio, AfterValidator(_acute)]
    """``"55 deg"``."""
    strength_cap: Annotated[Stress, Positive] | None = None
    """Largest s1 - s3, however high the pressure; none by default."""
    failure_strain: Annotated[Ratio, Positive] | None = None
    """Effective plastic strain beyond which the residual values hold; without it material never fails."""
    residual_cohesion: Annotated[Stress, Field(ge=0)] | None = None
    """0 by default."""
    residual_friction_angle: Annotated[Ratio, AfterValidator(_acute)] | None = None
    """30 deg by default, or the friction angle if that is smaller."""


Strength = Annotated[LinearHardening | JohnsonCook | MohrCoulomb, Field(discriminator="model")]


class MieGruneisen(Model):
    """Mie-Grueneisen equation of state on the Hugoniot U_s = c0 + S u_p."""

    model: Literal["mie_gruneisen"]
    c0: Annotated[Speed, Positive]
    S: Annotated[Ratio, Field(ge=0)]
    gamma0: Annotated[Ratio, Field(ge=0)]


class Material(Model):
    """Density, kg/m^3; elasticity; strength (none: elastic); equation of state (none: linear, from the elasticity)."""

    density: Annotated[Density, Positive]
    elastic: Elastic
    strength: Strength | None = None
    eos: MieGruneisen | None = None
    description: str = ""


# The scene ------------------------------------------------------------------------------------------------------------


class Spin(Model):
    """Rigid rotation about a line through ``centre``; ``rate`` is the rotation vector, rad/s."""

    centre: Point
    rate: tuple[AngularSpeed, AngularSpeed, AngularSpeed]


class Turn(Model):
    """A body is turned about the line along ``axis`` through ``centre`` before anything else, right-handed."""

    axis: Axis
    angle: Ratio
    """rad; ``"45 deg"``."""
    centre: Point = (0.0, 0.0, 0.0)


class Erosion(Model):
    """Tets that are worn out leave the body: what lay behind them is laid bare, and meets other bodies from then on.

    A tet leaves when any of the three is passed. Its elastic energy is booked as eroded.
    """

    plastic_strain: Annotated[Ratio, Positive] | None = None
    """Largest effective plastic strain; none by default."""
    volume: tuple[Annotated[Ratio, Field(gt=0, lt=1)], Annotated[Ratio, Field(gt=1)]] = (0.1, 10.0)
    """Smallest and largest volume, of the initial one."""
    time_step: Annotated[Ratio, Field(gt=0, lt=1)] = 0.02
    """Smallest stable step of a tet, of the first step of the run."""
    nodes: Literal["particles", "remove"] = "particles"
    """What becomes of a node without tets: it flies on with its mass and meets faces, or it leaves with its mass,
    momentum and energy, which are booked."""


class Part(Model):
    """A body: where it is, what it is made of, how it moves at the start."""

    name: Name
    material: Name
    """A name from ``[materials]`` of the case or from the library."""
    mesh: Mesh
    turn: Turn | None = None
    """Only whole bodies can be turned, no sectors."""
    velocity: Velocity = (0.0, 0.0, 0.0)
    spin: Spin | None = None
    temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    erosion: Erosion | None = None


class Symmetry(Model):
    """Nodes that start on the plane ``axis = at`` stay on it; no friction. All parts when ``parts`` is empty."""

    kind: Literal["symmetry"]
    axis: Axis
    at: Length = 0.0
    parts: tuple[Name, ...] = ()


class Wall(Model):
    """A rigid, fixed, frictionless half-space: nodes cannot go to the side that ``normal`` points away from."""

    kind: Literal["wall"]
    name: Name = "wall"
    point: Point
    normal: Direction
    parts: tuple[Name, ...] = ()


class Prescribed(Model):
    """Nodes that start inside the box ``low``..``high`` (all of the parts when absent) move with a given velocity.

    Only the components that are given are prescribed.
    """

    kind: Literal["velocity"]
    parts: tuple[Name, ...] = ()
    low: Point | None = None
    high: Point | None = None
    x: Speed | None = None
    y: Speed | None = None
    z: Speed | None = None


class Rotation(Model):
    """All nodes of the parts turn rigidly, exactly, at the given spin."""

    kind: Literal["rotation"]
    parts: tuple[Name, ...] = ()
    spin: Spin


class Gravity(Model):
    """A constant acceleration of all nodes of the parts, of all parts when ``parts`` is empty."""

    kind: Literal["gravity"]
    acceleration: tuple[Acceleration, Acceleration, Acceleration]
    parts: tuple[Name, ...] = ()


Boundary = Annotated[Symmetry | Wall | Prescribed | Rotation | Gravity, Field(discriminator="kind")]


class ContactPair(Model):
    """Two parts whose friction differs from that of the others."""

    parts: tuple[Name, Name]
    friction: Annotated[Ratio, Field(ge=0)]


class Contact(Model):
    """Bodies push each other where they meet: nodes on faces, sharp edges on edges; by impulses, no stiffness."""

    parts: tuple[Name, ...] = ()
    """Parts that meet each other; all when empty."""
    self_contact: tuple[Name, ...] = ()
    """Parts whose surface can meet itself."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient."""
    pairs: tuple[ContactPair, ...] = ()
    edges: bool = True
    """Whether sharp edges meet edges."""
    overlap: Literal["refuse", "push"] = "refuse"
    """What becomes of bodies that overlap at the start: an error, or they are moved apart without a stress."""
    sweeps: Annotated[Count, Field(ge=1, le=1000)] = 5
    """Jacobi sweeps over the meetings of a step."""
    skin: Annotated[Ratio, Positive] = 0.25
    """Of the (harmonic) mean face size: how far a node may stray from free flight before the next search, twice."""
    domain: Literal["arbitrary", "box"] = "arbitrary"
    """How a rank finds the faces that others must see: by occupied cells, or by bounding boxes."""


ProbeField = Literal[
    "stress_xx", "stress_yy", "stress_zz", "stress_yz", "stress_zx", "stress_xy",
    "pressure", "mises", "plastic_strain", "temperature", "density", "internal_energy",
    "velocity_x", "velocity_y", "velocity_z", "contact_force_x", "contact_force_y", "contact_force_z",
]  # fmt: skip


class Probe(Model):
    """A column of history.csv: the mean of a field over the tets of a part whose centre starts in a box.

    Without ``low`` and ``high`` it is the whole part. ``internal_energy`` is per mass, J/kg; stresses are positive in
    tension, pressure in compression. ``contact_force`` is what other bodies push the whole part with, N, as a mean
    since the line before.
    """

    name: Name
    part: Name
    field: ProbeField
    low: Point | None = None
    high: Point | None = None


class Viscosity(Model):
    """Bulk viscosity q = density * l * (quadratic * l * rate^2 + linear * c * |rate|) in compression.

    l is V^(1/3) for a regular tet and follows the altitude of a flat one: 1.2009 / sqrt(sum |grad N|^2).
    """

    linear: Annotated[Ratio, Field(ge=0)] = 0.06
    quadratic: Annotated[Ratio, Field(ge=0)] = 1.5


class Numerics(Model):
    """How the equations are solved."""

    pressure: Literal["standard", "nodal", "split"] = "nodal"
    """``standard``: pressure from each tet (locks in plastic flow). ``nodal``: averaged nodal pressure. ``split``: the
    operator split, stabilised by pressure-gradient projection."""
    viscosity: Annotated[Viscosity | None, BeforeValidator(_off)] = Viscosity()
    """``viscosity = "none"`` switches it off."""
    dt_safety: Annotated[Ratio, Field(gt=0, le=1)] = 0.9
    """Share of the rigorous element bound 1 / (c sqrt(sum |grad N|^2))."""
    dt_growth: Annotated[Ratio, Field(gt=1, le=2)] = 1.05
    """Largest growth of the time step in one step."""


class Run(Model):
    """How long, on how many ranks, and what is written."""

    end_time: Annotated[Time, Positive]
    ranks: Annotated[Count, Field(ge=1, le=4096)] = 1
    frames: Annotated[Count, Field(ge=0, le=100_000)] = 20
    """Number of frames, evenly spaced to the end; the initial state is frame 0 (0: none are written)."""
    samples: Annotated[Count, Field(ge=1, le=1_000_000)] = 500
    """Number of lines of history.csv, evenly spaced."""
    max_steps: Annotated[Count, Field(ge=1)] = 100_000_000
    max_wall_time: Annotated[Time, Positive] | None = None
    """Counted from the first step."""
    residual_limit: Annotated[Ratio, Positive] = 0.05
    """The run fails with cause ``energy`` when the energy residual passes this."""


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
    ``penetration``: how much of the thickness of all other parts along ``axis`` a part has opened round the axis
    through the origin, m. Nodes without tets do not count for ``extent`` and ``radius``.
    ``worst_residual``: of the energy ledger.
    """

    quantity: Quantity
    value: float
    tolerance: Annotated[float, Positive]
    """Absolute, in SI as ``value``."""
    source: str
    part: Name | None = None
    probe: Name | None = None
    axis: Axis | None = None
    since: Time = 0.0
    until: Time | None = None


class Case(Model):
    """A whole case."""

    name: Name
    title: str = ""
    description: str = ""
    materials: dict[Name, Material] = Field(default_factory=dict)
    parts: Annotated[tuple[Part, ...], Field(min_length=1, max_length=256)]
    boundaries: tuple[Boundary, ...] = ()
    contact: Annotated[Contact | None, BeforeValidator(_off)] = Contact()
    """``contact = "none"`` lets bodies pass through each other. A single part meets only itself, if it may."""
    probes: tuple[Probe, ...] = ()
    numerics: Numerics = Numerics()
    run: Run
    reference: tuple[Reference, ...] = ()

    @property
    def erodes(self) -> bool:
        """Whether tets may leave."""
        return any(part.erosion is not None for part in self.parts)

    @property
    def in_contact(self) -> bool:
        """Whether anything of the scene can meet anything."""
        return self.contact is not None and (len(self.parts) > 1 or bool(self.contact.self_contact))
