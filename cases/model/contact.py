"""The model of contact: which parts, friction, and the parameters of the solver."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Ratio
from .tables import Count, Model, Name, Positive


class ContactPair(Model):
    """A pair of parts with its own coefficient of friction."""

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
    Keep 0 unless a verification needs more: elastic bodies rebound by their elasticity with any value. At 0 the impact
    of a node is perfectly plastic. In the impact of two bodies only the first nodes lose energy, and less of it the
    smaller the tets are; where erosion exposes new nodes all the time, or a cloud of debris arrives, all of them do, at
    any size: 8 to 9 % in a penetration at constant speed. With 1 the impacts of nodes lose only the error of the
    ``sweeps``, mostly below 0.1 % of the energy. Any value above 0 changes the defaults of ``sweeps`` and
    ``numerics.dt_growth``. At high speed, time steps of unequal length can remove or add more energy than the
    restitution saves; the outcome contains a note above 1 %. Contact with walls always has the coefficient 0."""
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
    """Number of Jacobi sweeps, with momentum, over the active contacts of a time step. Default: adaptive, 5 to 80. The
    number increases where the last sweep of the previous step changed the impulses by more than 0.15 %, as in rubble
    under pressure, and decreases below half of that. The adaptive number is at least 10 if parts collide at more than a
    fifth of the wave speed of one of them. The adaptive number is at least 40 with ``restitution``, and if a prescribed
    motion or a traction may press on parts that fracture. With too few sweeps broken material is too soft under
    pressure, and the number of fragments is wrong. The cost of contact is proportional to the number of sweeps."""
    skin: Annotated[Ratio, Positive] = 0.3
    """Skin of the broad phase over the harmonic mean of the face size: twice the distance by which a node may depart
    from its extrapolated motion before its candidate pairs are searched again. Changes the cost, not the answer."""
    domain: Literal["arbitrary", "box"] = "arbitrary"
    """Method by which a rank selects the faces that other ranks receive as ghosts: by occupied cells
    (``arbitrary``), or by bounding boxes (``box``). Changes the cost, not the answer."""
