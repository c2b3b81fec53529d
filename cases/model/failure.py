"""The models of failure: deletion of tets (erosion), and fracture of facets."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Ratio
from .tables import Model, Positive


class Erosion(Model):
    """Erosion: tets that exceed a limit are deleted, and the free faces of their neighbours become contact surface. A
    part may have both ``erosion`` and ``fracture``.

    A tet that exceeds a limit of strain or damage is deleted within ten time steps; a tet that exceeds another limit is
    deleted at once. The elastic energy of a deleted tet is counted as eroded energy. In a body that can break, by
    ``fracture`` or by a bond with ``strength``, the remaining tets stay connected only through common faces: where a
    deletion leaves tets connected only through an edge or a node, their nodes separate.
    """

    plastic_strain: Annotated[Ratio, Positive] | None = None
    """Largest effective plastic strain of a tet. Default: no limit."""
    damage: Annotated[Ratio, Field(gt=0, le=1)] | None = None
    """Largest damage of a tet; needs a law with damage (Johnson-Cook: 1 is complete damage). Default: no limit."""
    volume: tuple[Annotated[Ratio, Field(gt=0, lt=1)], Annotated[Ratio, Field(gt=1)]] = (0.1, 10.0)
    """Smallest and largest volume of a tet divided by its initial volume."""
    time_step: Annotated[Ratio, Field(gt=0, lt=1)] = 0.02
    """Smallest stable time step of a tet divided by the first time step of the run. A larger value makes the run
    cheaper and deletes more tets."""
    nodes: Literal["strike", "particles", "remove"] = "strike"
    """Treatment of free nodes: nodes that have lost all tets are particles with mass and without volume. ``strike``: a
    free node moves on, and is deleted after its contact with a face. ``particles``: a free node is never deleted. Many
    free nodes can gather on a line, and then dig a hole that real material would not dig. ``remove``: a free node is
    deleted at once. The balances contain the mass, momentum and energy of deleted nodes."""


class Fracture(Model):
    """Fracture: facets between tets break, nodes separate, and the fragments are in contact with each other. The table
    ``fracture`` needs ``brittle`` in the material.
    """

    model: Literal["instant", "cohesive"] = "instant"
    """Behaviour of a broken facet. ``instant``: a broken facet carries no traction. ``cohesive``: the traction of a
    broken facet falls linearly with the opening and absorbs the fracture energy (Camacho and Ortiz 1996)."""
    shear_weight: Annotated[Ratio, Field(ge=0)] | None = None
    """Weight beta_tau of the shear traction t_s in the effective traction ``sqrt(<t_n>^2 + beta_tau t_s^2)``, which is
    compared with the strength; <t_n> is the tensile normal traction. Default: 0 for ``instant`` (the largest normal
    traction decides), 1 for ``cohesive``; the model ``cohesive`` needs a weight above 0. With the weight 1, shear alone
    breaks a facet at the tensile strength: material that is compressed across the crack, such as a disc between
    platens, then breaks too early unless ``friction`` prevents it."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coefficient of internal friction: under a compressive traction |t_n| the shear traction is reduced by
    ``friction * |t_n|``."""
    traction: Literal["tets", "nodes"] = "tets"
    """Method that computes the traction of a facet. ``tets``: from the stress of the two tets of the facet. ``nodes``:
    from the stress of the two tets, and from the stress of the three nodes, each a volume-weighted mean over the tets
    around the node; both tractions must exceed the strength. The method ``nodes`` gives smoother fracture."""
    delay: Annotated[Ratio, Field(ge=0)] = 1.0
    """Factor ``delay`` of the time ``t_c = delay * density * c * energy / strength^2`` for which a facet must be above
    its strength before it breaks; c is the wave speed. 0: the facet breaks in the step in which it exceeds the
    strength. The published equation of this criterion has the factor 0.5; the derivation in the same paper gives 1."""
    order: Literal["simultaneous", "local_maximum"] = "simultaneous"
    """Choice of the facets that break in one time step. ``simultaneous``: all facets that fulfil the criterion break.
    ``local_maximum``: among all facets with a common node, only the facet that exceeds its strength most breaks."""
    resolve: Literal["none", "strength"] = "none"
    """Adaptation of the strength to the mesh. ``strength``: reduces the strength until ``resolution`` elements fit in
    the cohesive zone; the fracture energy is unchanged."""
    resolution: Annotated[Ratio, Positive] = 3.0
    """With ``resolve = "strength"``: number of elements in the cohesive zone."""
