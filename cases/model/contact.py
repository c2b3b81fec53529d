"""The model of contact: the parts in contact, friction, and the parameters of the contact solver."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Ratio
from .tables import Count, Model, Name, Positive


class ContactPair(Model):
    """A pair of parts with a different coefficient of friction."""

    parts: tuple[Name, Name]
    """Names of the two parts in contact."""
    friction: Annotated[Ratio, Field(ge=0)]
    """Coulomb's coefficient of friction between the two parts."""


class Contact(Model):
    """Contact between bodies: nodes are in contact with faces, and sharp edges with edges. The contact solver applies
    impulses; it has no penalty stiffness that a user must choose.
    """

    parts: tuple[Name, ...] = ()
    """Names of the parts that can be in contact; all parts if empty."""
    self_contact: tuple[Name, ...] | None = None
    """Names of the parts whose surface can be in contact with itself. Default: the parts that have ``erosion``, because
    the free nodes of deleted tets would otherwise pass through their own part. A given list replaces the default;
    ``[]`` means that no part has self-contact. Parts that have ``fracture`` always have self-contact."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coulomb's coefficient of friction between all bodies, except the ``pairs``."""
    pairs: tuple[ContactPair, ...] = ()
    """Pairs of parts with a different coefficient of friction, in TOML one ``[[contact.pairs]]`` each."""
    restitution: Annotated[Ratio, Field(ge=0, le=1)] = 0.0
    """Coefficient of restitution of the contact of single nodes and edges: speed of separation divided by speed of
    approach. Keep the default 0 unless a verification needs another value: elastic bodies rebound by their elasticity
    with any value. With restitution 0 the impact of a single node is perfectly plastic. In the impact of two bodies
    only the nodes that touch first lose energy, and smaller tets lose less. Where erosion exposes new nodes all the
    time, or a cloud of debris arrives, all nodes lose energy for any size of the tets: 8 to 9 % of the energy in a
    penetration at constant speed. With restitution 1 the impacts of nodes lose only the error of the ``sweeps``, mostly
    below 0.1 % of the energy. Any restitution above 0 changes the defaults of ``sweeps`` and ``numerics.dt_growth``. At
    high speed, changes of the length of the time step can remove or add more energy than the restitution saves; if this
    is above 1 % of the energy, the outcome contains a note. Contact with walls always has the coefficient of
    restitution 0."""
    edges: bool = True
    """Whether sharp edges are in contact with edges. With ``false`` contact is cheaper, but edges can pass through each
    other."""
    overlap: Literal["refuse", "push"] = "refuse"
    """Treatment of bodies that overlap at the start. ``refuse``: a run with overlapping bodies ends with an error.
    ``push``: the bodies are moved apart without stress; the run ends with an error where the bodies overlap too deeply
    for their tets. Two bodies overlap where their primitives intersect, or where a surface node of one body lies inside
    the mesh of the other body deeper than a millionth of a face's size; bodies that touch do not overlap. Parts between
    which contact is switched off may overlap."""
    sweeps: Annotated[Count, Field(ge=1, le=1000)] | None = None
    """Number of Jacobi sweeps, with momentum, of the contact solver over the active contacts of a time step. Default:
    the number of sweeps is adaptive, 5 to 80. The number of sweeps increases if the last sweep of the previous step
    changed the impulses by more than 0.15 %, as in rubble under pressure; it decreases if that change was below half of
    0.15 %. The adaptive number of sweeps is at least 10 if parts collide at more than a fifth of the wave speed of one
    of them. The adaptive number of sweeps is at least 40 with ``restitution``, and if a prescribed motion or a traction
    may press on parts that fracture. With too few sweeps, broken material is too soft under pressure, and the number of
    fragments is wrong. The cost of contact is proportional to the number of sweeps."""
    skin: Annotated[Ratio, Positive] = 0.3
    """Skin of the broad phase divided by the harmonic mean of the sizes of the faces. The skin is twice the distance by
    which a node may depart from its extrapolated motion before its candidate pairs are searched again. The skin changes
    the cost, not the answer."""
    domain: Literal["arbitrary", "box"] = "arbitrary"
    """Method by which a rank selects the faces that other ranks receive as ghosts: by occupied cells (``arbitrary``),
    or by bounding boxes (``box``). The method changes the cost, not the answer."""
